"""How long agents stay in the zones."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.evaluation.metrics import METRIC_NAMES
from clearway.experiments import zone_time
from clearway.experiments.correction import corrected
from clearway.experiments.groups import Group, Scores
from clearway.experiments.job import episodes_of
from clearway.experiments.reproduce import planned
from clearway.experiments.section import Claim
from clearway.experiments.setting import Setting
from clearway.zones import Zone
from helpers.report_tables import by_heading
from helpers.small_setting import do_here, small_setting


@pytest.fixture
def setting(tmp_path: Path) -> Setting:
    """One learner, five seeds."""
    setting = small_setting(tmp_path, seeds=5)
    return replace(setting, learners={"paper": setting.learners["paper"]})


def test_shares_are_those_of_the_episodes(setting: Setting) -> None:
    own = replace(setting, seeds=(0, 1))
    jobs = planned(own, [zone_time.NAME])
    do_here(own.out, jobs, threads=1)
    section = zone_time.section(own)
    (table,) = section.tables
    rows = {row["agent"]: row for row in by_heading(table)}
    shares = []
    for found in (episodes_of(own.out, job.run, job.trials[0]) for job in jobs if job.run.reward.name == "bump"):
        assert found is not None
        share = [
            found.zone_steps[found.target == target, Zone.COLLISION].sum() / found.steps[found.target == target].sum()
            for target in range(5)
        ]
        shares.append((sum(share[:3]) / 3 + sum(share[3:]) / 2) / 2)  # scene by scene
    assert rows["bump"]["share of steps in the collision zone"] == pytest.approx(sum(shares) / 2)
    assert {"shortest", "bump", "collision-aware", "7,500 frames", "random walk"} == set(rows)
    assert [agent for agent, row in rows.items() if row["seeds"] is None] == ["random walk"]


@pytest.fixture
def stays(setting: Setting, monkeypatch: pytest.MonkeyPatch) -> Callable[[float], list[Claim]]:
    """The claims where shares fall from reward to reward, visits rise, and the last arrives as often as it is told."""

    def claims(arrives: float) -> list[Claim]:
        def scores(group: Group, out: Path, count: int) -> Scores:
            place = ("shortest", "bump", "collision-aware").index(group.agent)
            values = np.ones((5, count, len(METRIC_NAMES)))
            apart = 0.001 * np.arange(5)[:, None]
            values[:, :, METRIC_NAMES.index("share_collision")] = 0.3 - 0.1 * place + apart
            values[:, :, METRIC_NAMES.index("collision_visits")] = 1.0 + place + apart
            values[:, :, METRIC_NAMES.index("success")] = arrives if group.agent == "collision-aware" else 1.0
            return Scores(tuple(range(5)), values)

        monkeypatch.setattr(Group, "scores", scores)
        return list(corrected(zone_time.section(setting)).claims)

    return claims


def test_each_claim_compares_what_it_says(stays: Callable[[float], list[Claim]]) -> None:
    claims = {claim.text: claim for claim in stays(1.0)}
    assert len(claims) == 4 and all(claim.further for claim in claims.values())
    for other, share, visits in (("shortest", 0.302, 1.002), ("bump", 0.202, 2.002)):
        begin = "paper: collision-aware,"
        less = claims[f"{begin} a smaller share of steps in the collision zone than {other}"]
        fewer = claims[f"{begin} fewer steps in the collision zone than {other}"]
        assert (less.verdict, fewer.verdict) == ("holds", "does not hold")
        means = [[claim.numbers[name].value for name in ("first", "second")] for claim in (less, fewer)]
        assert means == [pytest.approx([0.102, share]), pytest.approx([3.002, visits])]


def test_who_arrives_less_often_is_not_told_better(stays: Callable[[float], list[Claim]]) -> None:
    verdicts = [claim.verdict for claim in stays(0.9)]
    assert verdicts == ["undecided", "undecided", "does not hold", "does not hold"]
