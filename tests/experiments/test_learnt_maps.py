"""What memory alone solves stands in the tables of what agents learn."""

from dataclasses import replace
from pathlib import Path

import pytest

from clearway.experiments import fig5, fig6, hard_tables, learnt_maps, table1
from clearway.experiments.groups import all_jobs
from clearway.experiments.job import unfinished
from clearway.experiments.learnt_maps import PLANNER, on_maps
from clearway.experiments.other_learners import other_learners
from clearway.experiments.plan import NEAREST
from clearway.experiments.section import Section
from clearway.experiments.setting import Setting
from helpers.report_tables import by_heading
from helpers.small_setting import do_here, small_setting

MOST = "7,500 frames"


@pytest.fixture
def setting(tmp_path: Path) -> Setting:
    """Nothing is trained."""
    return small_setting(tmp_path)


@pytest.mark.parametrize("experiment", [table1, hard_tables.TABLE2, hard_tables.TABLE3])
def test_the_paper_s_tables_hold_agents_on_maps_and_other_learners(setting: Setting, experiment: object) -> None:
    setting = replace(setting, learners={"paper": setting.learners["paper"]})
    targets = None if experiment is table1 else hard_tables.chosen(setting)
    do_here(setting.out, all_jobs(other_learners(setting, targets)), threads=1)
    section: Section = experiment.section(setting)
    steps = [row for row in by_heading(section.tables[0]) if row["figure"] == "steps"]
    found = {row["learner"]: row for row in steps}
    for learner in (PLANNER, NEAREST, "q-learning", "bc"):
        assert found[learner]["seeds"] == 2
        assert found[learner]["the paper's average of these scenes"] is None
        frames = "2,400 frames" if learner in ("q-learning", "bc") else MOST
        assert found[learner]["agent"] == frames
    (shortest,) = [row["average"] for row in steps if row["agent"] == "shortest path"]
    assert found[PLANNER]["average"] == pytest.approx(shortest)
    exact = [row["agent"] for row in steps if row["learner"] == "exact"]
    unclipped = 2 if experiment is table1 else 0
    assert len(exact) == 1 + 2 * (3 + unclipped)  # two policies of each reward as the paper's learner is paid it
    left = unfinished(setting.out, experiment.jobs(setting))
    assert not any(name.startswith(("bc-", "q-learning-")) for name in left)
    assert {row["learner"] for row in by_heading(section.tables[1])} == {PLANNER, NEAREST, "q-learning", "bc"}
    assert not [claim for claim in section.claims if claim.text.startswith(("bc:", "q-learning:"))]


def test_other_learners_are_missing_until_they_are_trained(setting: Setting) -> None:
    for experiment in (table1, hard_tables.TABLE2):
        kinds = [name.partition("-shortest-")[0] for name in unfinished(setting.out, experiment.jobs(setting))]
        assert kinds.count("bc") == kinds.count("q-learning") == 2


def test_a_map_knows_targets_that_nobody_was_given(setting: Setting) -> None:
    for experiment, count in ((fig5, 5), (fig6, 2)):
        section = experiment.section(setting)
        own = [row for row in by_heading(section.tables[0]) if str(row["learner"]).startswith(PLANNER)]
        assert len(own) == count
        of_most = [row["SPL"] for row in own if row["agent"] == MOST]
        assert of_most == pytest.approx([1.0] * (5 if experiment is fig5 else 1))
        lines = {line.label: line.y for line in section.figures[0].series if line.label.startswith(PLANNER)}
        assert lines[f"{PLANNER}, {MOST}"] == pytest.approx([1.0] * len(lines[f"{PLANNER}, {MOST}"]))
    assert 0.9 < own[0]["SPL"] < 1  # fewer frames are not enough


def test_agents_on_maps_walk_each_trial_once(setting: Setting, monkeypatch: pytest.MonkeyPatch) -> None:
    trials = setting.trial(), fig5._groups(setting, 2)[0].trial
    first = [each for trial in trials for each in on_maps(setting, trial)]
    assert [each.scores.values.shape[:2] for each in first] == [(2, 5), (2, 5), (2, 10), (2, 10)]

    def never(*_: object, **__: object) -> None:
        raise AssertionError("walked again")

    monkeypatch.setattr(learnt_maps, "run_episodes", never)
    again = [each for trial in trials for each in on_maps(setting, trial)]
    for one, other in zip(first, again, strict=True):
        assert (one.called, one.exact) == (other.called, other.exact)
        assert (one.scores.values == other.scores.values).all()
    with pytest.raises(AssertionError, match="walked again"):
        list(on_maps(replace(setting, seeds=(7,)), trials[0]))
    with pytest.raises(AssertionError, match="walked again"):
        list(on_maps(setting, trials[0], (1,)))
