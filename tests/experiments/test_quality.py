"""Trainings against the criteria, in a reproduction."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.evaluation.metrics import METRIC_NAMES
from clearway.experiments import quality
from clearway.experiments.correction import corrected
from clearway.experiments.groups import Group, Scores
from clearway.experiments.in_short import is_judged
from clearway.experiments.job import episodes_of
from clearway.experiments.reproduce import planned
from clearway.experiments.section import Claim
from clearway.experiments.setting import Setting
from helpers.small_setting import do_here, small_setting


@pytest.fixture
def setting(tmp_path: Path) -> Setting:
    """One learner, five seeds."""
    setting = small_setting(tmp_path, seeds=5)
    return replace(setting, learners={"paper": setting.learners["paper"]})


def test_rows_are_those_of_the_episodes(setting: Setting) -> None:
    own = replace(setting, seeds=(0, 1))
    jobs = planned(own, [quality.NAME])
    assert {job.run.reward.name for job in jobs} == {"collision-aware"}
    do_here(own.out, jobs, threads=1)
    section = quality.section(own)
    table, settled = section.tables
    assert [row[:3] for row in settled.rows] == [("paper", "collision-aware", 2)]
    rows = {tuple(row[:3]): dict(zip(table.headings, row, strict=True)) for row in table.rows}
    assert [key for key in rows if key[0] == "paper"] == [("paper", "collision-aware", seed) for seed in (0, 1)]
    for job in jobs:
        found = episodes_of(own.out, job.run, job.trials[0])
        assert found is not None
        row = rows["paper", "collision-aware", job.run.seed]
        solved = [(found.reached & (found.steps < 500))[found.target == target].all() for target in range(5)]
        ratios = [
            found.steps[found.target == target].sum() / found.shortest_path_steps[found.target == target].sum()
            for target in range(5)
        ]
        assert row["targets solved"] == f"{sum(solved)} of 5"
        assert row["worst target"] == pytest.approx(max(ratios))
        for name, column in (("x the shortest path", found.steps), ("collisions", found.collisions)):
            means = [column[found.target == target].mean() for target in range(5)]
            shortest = [found.shortest_path_steps[found.target == target].mean() for target in range(5)]
            ours, below = ((sum(each[:3]) / 3 + sum(each[3:]) / 2) / 2 for each in (means, shortest))
            assert row[name] == pytest.approx(ours / below if column is found.steps else ours)
        asked = {"targets solved": all(solved), "x the shortest path": row["x the shortest path"] <= 1.05}
        asked |= {"worst target": row["worst target"] <= 1.15, "collisions": row["collisions"] < 0.05}
        assert row["misses"] == ", ".join(name for name, met in asked.items() if not met)
        scene, state = [("bathroom", 0), ("bathroom", 13), ("bathroom", 30), ("kitchen", 5), ("kitchen", 22)][
            int(np.argmax(ratios))
        ]
        assert row["which is the worst"] == f"{scene}, {state}"
    assert rows["planner on a learnt map", "7,500 frames", 1]["misses"] == "none"
    assert rows["walked", "random walk", None]["misses"] != "none"


Judge = Callable[..., Claim]


@pytest.fixture
def judge(setting: Setting, monkeypatch: pytest.MonkeyPatch) -> Judge:
    """The claim where so many runs are there, the last of them with other figures."""

    def claim(complete: int = 5, **last: float) -> Claim:
        def scores(group: Group, out: Path, count: int) -> Scores:
            values = np.ones((complete, count, len(METRIC_NAMES)))
            perfect = {"sc": 1.0, "steps": 10.4, "shortest_path_steps": 10.0, "path_ratio": 1.04, "collisions": 0.04}
            for name, value in perfect.items():
                values[:, :, METRIC_NAMES.index(name)] = value
            for name, value in last.items():
                values[-1, 0, METRIC_NAMES.index(name)] = value
            return Scores(tuple(range(complete)), values)

        monkeypatch.setattr(Group, "scores", scores)
        section = corrected(quality.section(setting))
        (found,) = section.claims
        assert found.further and found.p is None
        assert is_judged([section]) == (complete >= 4)
        return found

    return claim


def test_all_must_meet_all(judge: Judge) -> None:
    found = judge()
    assert (found.verdict, found.evidence) == ("holds", "5 of 5 trainings meet all criteria.")


@pytest.mark.parametrize(
    ("last", "missed"),
    [
        ({"sc": 0.99}, "targets solved"),
        ({"steps": 11.3}, "x the shortest path"),  # one target of a room's three
        ({"path_ratio": 1.16}, "worst target"),
        ({"collisions": 0.11}, "collisions"),
    ],
)
def test_one_criterion_of_one_training_is_enough_to_say_no(judge: Judge, last: dict[str, float], missed: str) -> None:
    found = judge(**last)
    assert (found.verdict, found.evidence) == (
        "does not hold",
        f"4 of 5 trainings meet all criteria; missed: {missed}.",
    )


def test_few_or_unfinished_trainings_are_undecided(judge: Judge) -> None:
    assert judge(3).verdict == "undecided" and "Fewer than 4" in judge(3, sc=0.5).evidence
    assert judge(4).verdict == "undecided" and judge(4).evidence.endswith(" Still to come: 1.")
    assert judge(4, sc=0.5).verdict == "does not hold"  # the fifth cannot mend it
