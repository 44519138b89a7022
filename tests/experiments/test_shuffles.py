"""Zones of shuffled poses, each seed's in its own way."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.evaluation.metrics import METRIC_NAMES
from clearway.experiments import convergence, shuffles
from clearway.experiments.correction import corrected
from clearway.experiments.groups import Group, Scores
from clearway.experiments.job import run_folder
from clearway.experiments.reproduce import planned
from clearway.learn.load import load_network
from clearway.reward import COLLISION_AWARE
from clearway.scenes.actions import Action
from helpers.small_setting import do_here, small_setting


def test_each_seed_has_its_own_shuffle_of_as_many_zones(tmp_path: Path) -> None:
    moves = small_setting(tmp_path).world().moves()
    left = Action.TURN_LEFT  # leads to every pose once
    true, *others = (own.table(moves)[0][:, left] for own in (COLLISION_AWARE, *map(shuffles.reward, range(3))))
    assert all(sorted(other) == sorted(true) for other in others)
    assert len({other.tobytes() for other in (true, *others)}) == 4


def test_runs_are_paid_by_the_shuffle_of_their_seed(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    jobs = [job for job in planned(setting, [shuffles.NAME]) if job.run.reward.name.startswith("shuffle-")]
    assert [job.run.reward.name for job in jobs] == ["shuffle-0", "shuffle-1"] * 2  # learners, seeds
    assert len({job.run.name for job in jobs}) == 4
    do_here(setting.out, jobs, threads=1)
    for job in jobs:
        kept = load_network(run_folder(setting.out, job.run).path).record.reward
        assert kept.to_json()["terms"] == shuffles.reward(job.run.seed).to_json()["terms"]


def test_three_claims_are_made_of_each_learner(tmp_path: Path) -> None:
    section = shuffles.section(small_setting(tmp_path))
    assert [claim.text for claim in section.claims if claim.text.startswith("paper:")] == [
        "paper: collision-aware settles sooner than own shuffle",
        "paper: own shuffle settles sooner than shortest",
        "paper: collision-aware, fewer collisions than own shuffle",
    ]
    assert all(claim.further for claim in section.claims) and len(section.claims) == 6
    agents = {row[2] for row in section.tables[0].rows}
    assert {"own shuffle", "soft fixed point (shuffle-0, unclipped)"} < agents


@pytest.mark.parametrize(("arrives", "verdicts"), [(1.0, ["holds"] * 3), (0.9, ["holds", "holds", "undecided"])])
def test_each_claim_compares_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arrives: float, verdicts: list[str]
) -> None:
    setting = small_setting(tmp_path, seeds=5)
    setting = replace(setting, learners={"paper": setting.learners["paper"]})
    places = {"collision-aware": 1.0, "own shuffle": 2.0, "shortest": 3.0}

    def settled(out: Path, group: Group, mark: float) -> dict[int, tuple[float, bool]]:
        return {run.seed: (1000 * places[group.agent] + run.seed, True) for run in group.runs}

    def scores(group: Group, out: Path, count: int) -> Scores:
        values = np.ones((5, count, len(METRIC_NAMES)))
        values[:, :, METRIC_NAMES.index("collisions")] = places[group.agent] + 0.01 * np.arange(5)[:, None]
        values[:, :, METRIC_NAMES.index("steps")] = 9.0 - places[group.agent]
        if group.agent == "collision-aware":
            values[:, :, METRIC_NAMES.index("success")] = arrives
        return Scores(tuple(range(5)), values)

    monkeypatch.setattr(convergence, "settled_by_seed", settled)
    monkeypatch.setattr(Group, "scores", scores)
    claims = corrected(shuffles.section(setting)).claims
    means = [[claim.numbers[name].value for name in ("first", "second")] for claim in claims]
    assert means == [pytest.approx(pair) for pair in ([1002, 2002], [2002, 3002], [1.02, 2.02])]
    assert [claim.verdict for claim in claims] == verdicts
