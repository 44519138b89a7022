"""Zones of cells beside zones of poses."""

from pathlib import Path

from clearway.experiments.job import request_of
from clearway.experiments.zone_levels import CELLS, jobs, section
from clearway.reward import COLLISION_AWARE
from helpers.small_setting import small_setting


def test_zones_of_cells_are_trained_apart(tmp_path: Path) -> None:
    setting = small_setting(tmp_path, seeds=3)
    own = [job.run for job in jobs(setting)]
    assert len({run.name for run in own}) == len(own) == len(setting.learners) * 3 * 3
    of_cells = [run for run in own if run.zone_level == "cell"]
    assert {run.reward for run in of_cells} == {COLLISION_AWARE}
    assert len(of_cells) == 3 * len(setting.learners)
    assert [request_of(run).zone_level for run in (of_cells[0], own[0])] == ["cell", "pose"]


def test_five_claims_a_learner_wait_for_runs(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    found = section(setting)
    assert len(found.claims) == 5 * len(setting.learners)
    assert all(claim.further and claim.verdict == "undecided" for claim in found.claims)
    assert [row for row in found.tables[0].rows if CELLS in row]
