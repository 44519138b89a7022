"""How long agents stay in the zones."""

from dataclasses import replace
from pathlib import Path

import pytest

from clearway.evaluation.metrics import METRIC_NAMES
from clearway.experiments import zone_time
from clearway.experiments.correction import corrected
from clearway.experiments.groups import Group, Scores
from clearway.experiments.job import episodes_of
from clearway.experiments.reproduce import planned
from clearway.experiments.setting import Setting
from clearway.zones import Zone
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
    assert not section.missing
    (table,) = section.tables
    rows = {row["agent"]: row for row in (dict(zip(table.headings, row, strict=True)) for row in table.rows)}
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


def test_four_claims_are_judged_of_each_learner(setting: Setting, monkeypatch: pytest.MonkeyPatch) -> None:
    do_here(setting.out, planned(setting, [zone_time.NAME]), threads=1)
    whole = Group.scores

    def scores(group: Group, out: Path, count: int) -> Scores:
        found = whole(group, out, count)
        values = found.values.copy()
        stays = {"shortest": 0.3, "bump": 0.2, "collision-aware": 0.1}[group.agent]
        for number, seed in enumerate(found.seeds):
            values[number, :, METRIC_NAMES.index("share_collision")] = stays + 0.001 * seed
            values[number, :, METRIC_NAMES.index("success")] = 1.0
        return Scores(found.seeds, values)

    monkeypatch.setattr(Group, "scores", scores)
    claims = {claim.text: claim for claim in corrected(zone_time.section(setting)).claims}
    assert len(claims) == 4 and all(claim.further for claim in claims.values())
    for other in ("shortest", "bump"):
        begin = "paper: collision-aware,"
        assert claims[f"{begin} a smaller share of steps in the collision zone than {other}"].verdict == "holds"
        assert f"{begin} fewer steps in the collision zone than {other}" in claims
