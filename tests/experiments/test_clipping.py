"""Both rewards clipped, unclipped, unclipped at a tenth, and with less entropy."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.evaluation.episodes import episode_starts
from clearway.evaluation.metrics import METRIC_NAMES
from clearway.evaluation.optimum import world_yardsticks
from clearway.experiments import clipping
from clearway.experiments.clipping import AT_A_TENTH, LESS_ENTROPY, variants
from clearway.experiments.correction import corrected
from clearway.experiments.groups import Group, Scores
from clearway.experiments.reproduce import planned
from clearway.experiments.table1 import UNCLIPPED
from clearway.learn.presets import DEFAULT, PAPER_A2C, PAPER_A3C
from clearway.reward import COLLISION_AWARE, SHORTEST
from helpers.report_tables import by_heading
from helpers.small_setting import small_setting


def test_each_variant_changes_one_thing() -> None:
    found = variants(PAPER_A2C)
    assert list(found) == ["", UNCLIPPED, AT_A_TENTH, LESS_ENTROPY]
    assert found[""] == PAPER_A2C
    assert found[UNCLIPPED] == replace(PAPER_A2C, clip_rewards=False)
    assert found[AT_A_TENTH] == replace(PAPER_A2C, clip_rewards=False, reward_scale=0.1)
    assert found[LESS_ENTROPY] == replace(PAPER_A2C, entropy_start=0.001, entropy_end=0.001)


def test_who_does_not_clip_or_cannot_scale_rewards_is_left_out(tmp_path: Path) -> None:
    assert not variants(DEFAULT) and not variants(PAPER_A3C)
    setting = replace(small_setting(tmp_path), learners={"default": DEFAULT, "paper-a3c": PAPER_A3C})
    section = clipping.section(setting)
    assert not (section.tables or section.claims or clipping.jobs(setting))


def test_table_1_trains_half_of_the_runs_too(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    runs = {job.run.name for job in planned(setting, [clipping.NAME])}
    assert len(runs) == 4 * 2 * 2  # variants, rewards, seeds
    assert len(runs & {job.run.name for job in planned(setting, ["table1"])}) == 2 * 2 * 2


def test_resting_points_are_of_what_each_is_paid(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    *_, table = clipping.section(setting).tables
    steps = {(row["learner"], row["agent"]): row["steps"] for row in by_heading(table)}
    assert len(table.rows) == len(steps) == 4 * 2
    world, trial = setting.world(), setting.trial()
    starts = episode_starts(world, trial.episodes_per_target, trial.seed)
    for variant, change, entropy in (
        ("paper", {"clip": True}, 0.01),
        (f"paper, {UNCLIPPED}", {}, 0.01),
        (f"paper, {AT_A_TENTH}", {"alpha": -0.001, "terminal": 1.0}, 0.01),
        (f"paper, {LESS_ENTROPY}", {"clip": True}, 0.001),
    ):
        found = world_yardsticks(world, SHORTEST.with_changes(**change), entropy_weight=entropy, starts=starts)
        own = [each.yardstick.soft.steps for each in found]  # three targets in one scene, two in the other
        assert steps[variant, "shortest"] == pytest.approx((np.mean(own[:3]) + np.mean(own[3:])) / 2), variant
    tenth, clipped = steps[f"paper, {AT_A_TENTH}", "shortest"], steps["paper", "shortest"]
    assert tenth > clipped > steps[f"paper, {LESS_ENTROPY}", "shortest"]


def test_six_claims_each_compare_what_they_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    setting = small_setting(tmp_path, seeds=5)
    ours, theirs = COLLISION_AWARE.name, SHORTEST.name
    collisions = {
        ("paper", ours): 1.0,
        ("paper", theirs): 2.0,
        (f"paper, {UNCLIPPED}", ours): 90.0,
        (f"paper, {UNCLIPPED}", theirs): 95.0,
        (f"paper, {AT_A_TENTH}", ours): 3.0,
        (f"paper, {AT_A_TENTH}", theirs): 4.0,
        (f"paper, {LESS_ENTROPY}", ours): 0.5,
        (f"paper, {LESS_ENTROPY}", theirs): 0.7,
    }

    def scores(group: Group, out: Path, target_count: int) -> Scores:
        mean = collisions[group.learner, group.agent]
        values = np.ones((5, target_count, len(METRIC_NAMES)))
        values[:, :, METRIC_NAMES.index("collisions")] = mean + np.arange(5)[:, None] / 100
        values[:, :, METRIC_NAMES.index("steps")] = 100 * mean + np.arange(5)[:, None] / 100
        return Scores(tuple(range(5)), values)

    monkeypatch.setattr(Group, "scores", scores)
    section = corrected(clipping.section(setting))
    means = {
        claim.text.removeprefix("paper: "): tuple(round(claim.numbers[n].value, 1) for n in ("first", "second"))
        for claim in section.claims
    }
    assert means == {
        f"{AT_A_TENTH}, {ours} has fewer collisions than {theirs}": (3.0, 4.0),
        f"{AT_A_TENTH}, {ours} has no more steps than {theirs}": (300.0, 400.0),
        f"{LESS_ENTROPY}, {ours} has fewer collisions than {theirs}": (0.5, 0.7),
        f"{LESS_ENTROPY}, {ours} has no more steps than {theirs}": (50.0, 70.0),
        f"{theirs} with {LESS_ENTROPY} has fewer collisions than as it is": (0.7, 2.0),
        f"{theirs} as it is has fewer collisions than {AT_A_TENTH}": (2.0, 4.0),
    }
    assert [claim.verdict for claim in section.claims] == ["holds"] * 6  # five seeds can decide so many
    assert all(claim.further and claim.learner == "paper" for claim in section.claims)
