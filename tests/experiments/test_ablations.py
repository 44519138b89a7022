"""The arms that take single parts away."""

from dataclasses import replace
from pathlib import Path

import pytest

from clearway.experiments.ablations import BETA, GAMMA, SHARED, arms, jobs, rewards
from clearway.learn.presets import DEFAULT, PAPER_A3C
from clearway.reward import COLLISION_AWARE
from clearway.zones import Zone
from helpers.small_setting import small_setting


def test_an_arm_differs_in_one_setting() -> None:
    found = arms("default", DEFAULT, scenes=2)
    assert list(found) == ["default, history 1", "default, history 2", "default, history 8", f"default, {SHARED}"]
    assert [own.history_length for own in found.values()] == [1, 2, 8, 4]
    assert [own.heads_by_scene for own in found.values()] == [True, True, True, False]
    assert "default, one head" not in arms("default", DEFAULT, scenes=1)


def test_a_learner_is_no_arm_of_itself() -> None:
    shared = replace(DEFAULT, history_length=2, heads="shared")
    assert list(arms("default", shared, scenes=2)) == ["default, history 1", "default, history 8"]


def test_a_learner_without_shared_heads_has_no_such_arm() -> None:
    assert list(arms("paper-a3c", PAPER_A3C, scenes=2)) == [f"paper-a3c, history {length}" for length in (1, 2, 8)]


@pytest.mark.parametrize(
    ("name", "dear", "plain"), [(BETA, "collision", "precollision"), (GAMMA, "precollision", "collision")]
)
def test_half_the_zones_cost_what_they_cost_together(tmp_path: Path, name: str, dear: str, plain: str) -> None:
    moves = small_setting(tmp_path).world().moves()
    own = next(reward for reward in rewards() if reward.name == name).table(moves)[0]
    whole = COLLISION_AWARE.table(moves)[0]
    zone = moves.zone[moves.next_state]
    at_dear, at_plain = zone == Zone[dear.upper()], zone == Zone[plain.upper()]
    assert at_dear.any()
    assert (own[at_dear] == whole[at_dear]).all()
    assert at_plain.any()
    assert (own[at_plain] == COLLISION_AWARE.parameters["alpha"]).all()


def test_every_arm_is_trained_with_every_seed(tmp_path: Path) -> None:
    setting = small_setting(tmp_path, seeds=3)
    kinds = {(job.run.learner, job.run.reward.name) for job in jobs(setting)}
    assert len(kinds) == sum(3 + len(arms(name, own, 2)) for name, own in setting.learners.items())
    assert len(jobs(setting)) == 3 * len(kinds)
