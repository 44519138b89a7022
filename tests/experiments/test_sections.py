"""Every experiment on small scenes: what is planned, and what the report says before and after."""

import csv
import json
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clearway.evaluation.across_seeds import mean_estimate
from clearway.evaluation.episode_files import read_episodes
from clearway.evaluation.episodes import EpisodeTable, episode_starts
from clearway.evaluation.optimum import world_yardsticks
from clearway.experiments import (
    analysis,
    fig3,
    fig5,
    fig6,
    generalisation,
    hard_tables,
    hard_targets,
    job,
    learnt_maps,
    navigation_tables,
    off_grid,
    perturbed,
    table1,
)
from clearway.experiments.analysis import pareto_front
from clearway.experiments.catalogue import EXPERIMENTS
from clearway.experiments.groups import EXACT, WALKED, Scores, compared
from clearway.experiments.job import do, episodes_of, is_done, trial_path, unfinished
from clearway.experiments.reproduce import planned
from clearway.experiments.section import ReportTable, Section
from clearway.experiments.setting import Setting
from clearway.reward import COLLISION_AWARE
from clearway.viz import report
from clearway.viz.report import HTML, JSON, MARKDOWN, write_report
from helpers.report_tables import by_heading
from helpers.small_pictures import shrink_pictures
from helpers.small_setting import FRAMES, small_setting

pytestmark = pytest.mark.slow  # what they share takes long to make


@pytest.fixture(autouse=True, scope="module")
def _small_pictures() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        shrink_pictures(patch)
        yield


@pytest.fixture(scope="module")
def setting(tmp_path_factory: pytest.TempPathFactory) -> Setting:
    """The small setting, all its jobs done."""
    setting = small_setting(tmp_path_factory.mktemp("reproduction"))
    for each in planned(setting, list(EXPERIMENTS)):
        do(setting.out, each, threads=1)
    return setting


@pytest.fixture(scope="module")
def sections(setting: Setting) -> dict[str, Section]:
    """All sections by name."""
    return {name: experiment.section(setting) for name, experiment in EXPERIMENTS.items()}


def judged(sections: dict[str, Section]) -> dict[str, Section]:
    """The same as if of enough runs."""
    return {
        name: replace(section, claims=tuple(replace(claim, p=0.5) for claim in section.claims))
        for name, section in sections.items()
    }


def column(table: ReportTable, heading: str) -> list:
    """The values under a heading."""
    return [row[table.headings.index(heading)] for row in table.rows]


def test_runs_are_shared_between_experiments(setting: Setting) -> None:
    jobs = planned(setting, list(EXPERIMENTS))
    assert len({job.run.name for job in jobs}) == len(jobs)
    table1 = {job.run.name for job in planned(setting, ["table1"])}
    assert {job.run.name for job in planned(setting, ["fig3", "fig4", "fig5"])} < table1
    assert all(is_done(setting.out, job) for job in jobs)


@pytest.mark.parametrize("solved", [True, False])
def test_before_any_run_all_is_missing_and_undecided(
    tmp_path: Path, setting: Setting, sections: dict[str, Section], solved: bool
) -> None:
    empty = small_setting(tmp_path, seeds=1)
    for file in (analysis.FILE, hard_tables.FILE) if solved else ():  # what needs no run
        shutil.copy(setting.out / file, tmp_path)
    for experiment in EXPERIMENTS.values():
        section = experiment.section(empty)
        left = unfinished(empty.out, experiment.jobs(empty))
        assert left or section.name in (off_grid.NAME, perturbed.NAME)  # these scenes are none of our rooms
        assert all(claim.verdict == "undecided" for claim in section.claims)


def test_trials_on_unseen_targets_end_when_success_is_settled(
    setting: Setting, monkeypatch: pytest.MonkeyPatch
) -> None:
    def caps(*names: str) -> set[int]:
        patient = replace(setting, budget=replace(setting.budget, step_limit=10_000))
        return {trial.step_limit for job in planned(patient, names) for trial in job.trials}

    assert caps("table1", "table2", "fig4") == {10_000}
    assert caps("fig5", "fig6") == {500}
    monkeypatch.setattr(generalisation, "SC_STEPS", 3)
    held_out = fig6.held_out_targets(setting)
    paths = [scene.distances_to(np.array(own)) for scene, own in zip(setting.scenes, held_out, strict=True)]
    assert 4 * max(int(steps.max()) for steps in paths) in caps("fig6")  # four times the shortest path takes longer


def test_sections_are_called_as_their_experiments(sections: dict[str, Section]) -> None:
    assert list(sections) == [section.name for section in sections.values()]


def test_table1_holds_what_the_episodes_say(setting: Setting, sections: dict[str, Section]) -> None:
    table, by_target = sections["table1"].tables
    (row,) = [r for r in table.rows if r[:3] == ("steps", "default", "bump")]
    runs = [job for job in planned(setting, ["table1"]) if job.run.reward.name == "bump" and job.run.learner.hindsight]
    tables = [episodes_of(setting.out, job.run, job.trials[0]) for job in runs]
    per_target = [[t.steps[t.target == m].mean() for m in range(5)] for t in tables]
    scene = [[sum(own[:3]) / 3, sum(own[3:]) / 2] for own in per_target]
    expected = [(scene[0][k] + scene[1][k]) / 2 for k in range(2)]
    named = dict(zip(table.headings, row, strict=True))
    assert [named["bathroom"], named["kitchen"]] == pytest.approx(expected)
    assert named["average"] == pytest.approx(sum(expected) / 2)
    assert named["seeds"] == 2
    # targets; learners by rewards, two without clipping, two other learners, two agents on maps; seeds
    assert len(by_target.rows) == 5 * (2 * 3 + 2 + 2 + 2) * 2
    assert set(column(by_target, "seed")) == {0, 1}


def test_table1_has_the_exact_references_and_the_paper_s_figures(sections: dict[str, Section]) -> None:
    table = sections["table1"].tables[0]
    agents = column(table, "agent")
    assert {"shortest path", "optimum (collision-aware)", "soft fixed point (shortest)", "random walk"} <= set(agents)
    paper = [row[-1] for row in table.rows if row[:3] == ("collisions", "default", "collision-aware")]
    assert paper == [pytest.approx((0.03 + 0.12) / 2)]  # of the two kinds of rooms that are there
    (row,) = [row for row in table.rows if row[:3] == ("collisions", "printed in the paper", "collision-aware")]
    assert (row[table.headings.index("bathroom")], row[table.headings.index("kitchen")]) == (0.03, 0.12)
    assert any("other scenes and features" in note for note in table.notes)


def test_exact_references_begin_where_the_agents_did(
    setting: Setting, sections: dict[str, Section], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With few starts, and with so many that they are nearly all of them."""
    for name in ("table1", "table2"):
        table, by_target = sections[name].tables[:2]
        (row,) = [row for row in table.rows if row[0] == "steps" and row[2] == "shortest path"]
        named = dict(zip(table.headings, row, strict=True))
        paths = {
            scene: np.mean([row[6] for row in by_target.rows if (row[0], *row[2:5]) == (scene, "default", "bump", 0)])
            for scene in ("bathroom", "kitchen")
        }
        assert by_target.headings[6] == "shortest_path_steps"
        assert {scene: named[scene] for scene in paths} == pytest.approx(paths)
    world = setting.world()
    clipped = replace(COLLISION_AWARE, clip=True)
    many = navigation_tables._references(world, [clipped], episode_starts(world, 2000, 0))
    every = [each.yardstick for each in world_yardsticks(world, clipped)]
    assert many[0][2]["steps"] == pytest.approx([each.shortest_path_steps for each in every], rel=0.05)
    assert many[2][2]["collisions"] == pytest.approx([each.soft.collisions for each in every], rel=0.2)


def test_figures_halfway_and_in_the_end_are_those_of_their_trials(
    setting: Setting, sections: dict[str, Section]
) -> None:
    table = sections["fig4"].tables[0]
    for halfway in (True, False):
        (group,) = [
            group for group in compared(setting, (COLLISION_AWARE,), halfway=halfway) if group.learner == "default"
        ]
        steps = group.scores(setting.out, 5).of("steps")
        frames = setting.learners["default"].frames // (2 if halfway else 1)
        (row,) = [row for row in table.rows if row[:3] == ("default", "collision-aware", frames)]
        expected = (steps[:, :3].mean(1) + steps[:, 3:].mean(1)).mean() / 2
        assert dict(zip(table.headings, row, strict=True))["steps"] == pytest.approx(expected)


def test_figure4_stands_beside_what_memory_solves(sections: dict[str, Section]) -> None:
    table, (first, _) = sections["fig4"].tables[0], sections["table1"].tables
    rows = by_heading(table)
    beside = [row for row in rows if row["learner"] not in ("paper", "default")]
    assert [(row["learner"], row["agent"], row["frames"], row["seeds"]) for row in beside] == [
        ("planner on a learnt map", None, 7_500, 2),
        ("nearest picture", None, 7_500, 2),
        ("walked", "random walk", None, None),
    ]
    average = first.headings.index("average")
    for row, agent in zip(beside, ("7,500 frames", "7,500 frames", "random walk"), strict=True):
        of_table1 = {
            other[0]: other[average] for other in first.rows if other[1:3] == (row["learner"], row["agent"] or agent)
        }
        assert {metric: row[metric] for metric in ("steps", "collisions")} == of_table1


def test_bands_reach_from_the_smallest_to_the_largest_seed(setting: Setting, sections: dict[str, Section]) -> None:
    for figure in sections["fig4"].figures:
        for line in figure.series:
            assert (np.array(line.low) <= np.array(line.y)).all() and (np.array(line.y) <= np.array(line.high)).all()
            assert (np.array(line.low) < np.array(line.high)).any()


def test_table3_s_agents_are_trained_twice_as_long(setting: Setting) -> None:
    frames = [
        {each.run.learner.frames for each in planned(setting, [name]) if each.run.learner.algorithm in ("ppo", "a2c")}
        for name in ("table2", "table3")
    ]
    assert frames == [{FRAMES}, {2 * FRAMES}]


def test_figure_3_shows_the_best_and_the_worst_seed(setting: Setting, sections: dict[str, Section]) -> None:
    for figure in sections["fig3"].figures:
        ends = {line.label.split(" (")[0]: line.y[-1] for line in figure.series}
        for agent in ("shortest", "collision-aware"):
            assert ends[f"{agent}, best"] <= ends[f"{agent}, worst"]


def test_figure_3_tells_the_ends_of_seeds_and_of_targets_beside_maps_and_a_random_walk(
    setting: Setting, sections: dict[str, Section]
) -> None:
    (table,) = sections["fig3"].tables
    rows = {(row["figure"], row["learner"], row["agent"]): row for row in by_heading(table)}
    of_table1 = {(row["figure"], row["learner"], row["agent"]): row for row in by_heading(sections["table1"].tables[0])}
    by_target = by_heading(sections["table1"].tables[1])
    maps = {learner for _, learner, _ in rows} - {EXACT, WALKED, *setting.learners}
    assert len(maps) == 2 and len(rows) == 2 * (2 * len(setting.learners) + len(maps) + 2)
    for (metric, learner, agent), row in rows.items():
        if learner in (EXACT, WALKED):
            average = of_table1[metric, learner, agent]["average"]
            assert row["best seed"] == row["worst seed"] == pytest.approx(average) and row["seeds"] is None
            continue
        own = [each for each in by_target if (each["learner"], each["agent"]) == (learner, agent)]
        of_seeds = [[each for each in own if each["seed"] == seed] for seed in sorted({each["seed"] for each in own})]
        means = [np.mean([np.mean(values) for values in by_scene_name(each, metric)]) for each in of_seeds]
        worst = [max(each[metric] for each in targets) for targets in of_seeds]
        assert row["seeds"] == len(worst) > 1
        assert [row["best seed"], row["worst seed"]] == pytest.approx([min(means), max(means)])
        assert row["worst target"] == pytest.approx(np.mean(worst)) and row["worst target of any seed"] == max(worst)
        assert row["95 %"] == mean_estimate(np.array(worst)[:, None], np.zeros(1, int)).ends
    assert len({row["best seed"] == row["worst seed"] for row in rows.values()}) == 2


def by_scene_name(rows: list[dict[str, Any]], metric: str) -> list[list[float]]:
    """The figure of each target, scene by scene."""
    return [[row[metric] for row in rows if row["scene"] == scene] for scene in sorted({row["scene"] for row in rows})]


def test_sets_tried_together_are_those_of_the_seeds_that_all_have() -> None:
    first, second = (
        generalisation.Tried(
            Scores(seeds, np.array(seeds, dtype=float)[:, None, None] + np.zeros((len(seeds), 2, 8))), np.array([0, 1])
        )
        for seeds in ((0, 1, 2), (2, 0))
    )
    both = generalisation.together([first, second])
    assert both.scores.seeds == (0, 2)
    assert both.scores.values[:, :, 0].tolist() == [[0] * 4, [2] * 4]
    assert len(set(both.target_scene.tolist())) == 4


def test_table1_repeats_the_clipping_learner_without_clipping(setting: Setting, sections: dict[str, Section]) -> None:
    table = sections["table1"].tables[0]
    kinds = {row[1:3] for row in table.rows if row[1] not in ("exact", "walked")}
    assert {agent for learner, agent in kinds if learner == "paper, unclipped"} == {"shortest", "collision-aware"}
    assert not any(learner == "default, unclipped" for learner, _ in kinds)  # it does not clip
    learners = [job.run.learner for job in planned(setting, ["table1"])]
    unclipped = {learner.clip_rewards for learner in learners if learner.algorithm == "a2c"}
    assert unclipped == {True, False}


def test_maps_show_both_agents_from_one_start(setting: Setting, sections: dict[str, Section]) -> None:
    shown = sections["table1"].maps
    assert len(shown) == 3 * 2 == len({each.name for each in shown})  # learners with the unclipped one, scenes
    for each in shown:
        assert set(each.walks) == {"shortest", "collision-aware"}
        assert len({walk[0] for walk in each.walks.values()}) == 1
        (scene,) = [scene for scene in setting.scenes if scene.name == each.scene]
        assert all(0 <= state < scene.state_count for walk in each.walks.values() for state in walk)
        assert each.target in setting.targets[setting.scenes.index(scene)]


def test_no_two_figures_share_a_name(setting: Setting, sections: dict[str, Section]) -> None:
    both = replace(setting, learners={**setting.learners, "paper-a3c": setting.learners["paper"]})
    names = [figure.name for figure in fig3.section(both).figures]
    assert len(set(names)) == len(names) == 3 * 2 * 2  # learners, scenes, steps and collisions


def test_every_claim_names_its_learner(sections: dict[str, Section]) -> None:
    claims = [claim for section in sections.values() for claim in section.claims]
    # tables 1 to 3; table 1 unclipped; figures 4 to 6; settled; memory; zones, steps, levels; ablations; what else
    expected = 3 * 2 * 4 + 2 + 3 * 4 + 3 * 2 + 4 + 5 * 2 + 5 * 2 + 6 * 2 + 6 * 2
    # shuffles; time in the zones; step sizes, of the learner that does not whiten; clipping, of the one that clips
    expected += 3 * 2 + 4 * 2 + 6 + 6
    expected += 2 + 3 * 2 + 2 * 3 * 2  # quality; across rooms; rewards
    assert len(claims) == expected
    assert len({claim.text for section in ("table2", "table3") for claim in sections[section].claims}) == 2 * 2 * 6
    learners = ("paper: ", "paper, unclipped: ", "default: ", "q-learning: ", "bc: ")
    assert all(claim.text.startswith(learners) for claim in claims)


def test_the_paper_s_further_claims_are_judged(setting: Setting, sections: dict[str, Section]) -> None:
    """Each against the episodes themselves, of the default learner."""

    def runs(name: str, reward: str, halfway: bool = False) -> list[EpisodeTable]:
        own = [
            (job.run, trial)
            for job in planned(setting, [name])
            for trial in job.trials
            if job.run.reward.name == reward and job.run.learner.hindsight and trial.halfway == halfway
        ]
        return [episodes_of(setting.out, *each) for each in own]

    def numbers(name: str, words: str) -> list[float]:
        (claim,) = [each for each in sections[name].claims if each.text.startswith("default: ") and words in each.text]
        return [claim.numbers[each].value for each in ("first", "second")]

    def mean(figures: list[list[float]]) -> float:
        return float(np.mean([(sum(own[:3]) / 3 + sum(own[3:]) / 2) / 2 for own in figures]))

    def by_target(tables: list[EpisodeTable], metric: str) -> list[list[float]]:
        return [[getattr(t, metric)[t.target == m].mean() for m in range(5)] for t in tables]

    ours, theirs = (by_target(runs("fig3", name), "collisions") for name in ("collision-aware", "shortest"))
    assert numbers("fig3", "worst case") == pytest.approx(
        [np.mean([max(own) for own in each]) for each in (ours, theirs)]
    )
    assert numbers("table1", "a tenth") == pytest.approx([mean(ours), mean(theirs) / 10])
    halves = [mean(by_target(runs("fig4", "collision-aware", halfway), "steps")) for halfway in (True, False)]
    assert numbers("fig4", "close to the end") == pytest.approx(halves)
    near, far = numbers("fig5", "falls with distance")
    table = sections["fig5"].tables[0]
    rows = [dict(zip(table.headings, row, strict=True)) for row in table.rows if row[1] == "default"]
    for steps, found in ((1, near), (8, far)):
        assert found == pytest.approx(np.mean([row["sc"] for row in rows if row["steps away"] == steps]))
    hard, easy = numbers("table2", "harder")
    assert easy > 1 and hard > 1
    assert numbers("table3", "repair")[1] == pytest.approx(easy)


def test_success_on_unseen_targets_stands_beside_the_random_walk_s(sections: dict[str, Section]) -> None:
    for name, places in (("fig5", 5), ("fig6", 1)):
        table, _ = sections[name].tables
        assert column(table, "agent").count("random walk") == places
        assert all(0 <= value <= 1 + 1e-12 for value in column(table, "sc"))
        assert all(
            strict <= loose
            for strict, loose in zip(column(table, "sc within 4 x shortest"), column(table, "sc"), strict=True)
        )


def test_figure_5_averages_over_the_distances(sections: dict[str, Section]) -> None:
    table, _ = sections["fig5"].tables
    rows = by_heading(table)
    for kind in {(row["learner"], row["agent"]) for row in rows}:
        own = [row for row in rows if (row["learner"], row["agent"]) == kind]
        assert [row["steps away"] for row in own] == [1, 2, 4, 8, "average"]
        for metric in ("sc", "sc within 4 x shortest", "SPL"):
            assert own[-1][metric] == pytest.approx(sum(row[metric] for row in own[:-1]) / 4)


def test_accumulated_steps_end_at_the_sums_of_the_targets(setting: Setting) -> None:
    job = planned(setting, ["fig3"])[0]
    table = episodes_of(setting.out, job.run, job.trials[0])
    line = fig3.accumulated(table, "steps")
    assert line.shape == (5, 3)  # targets, their episodes
    assert line[:, -1].sum() == table.steps.sum()


def test_the_analysis_knows_that_clipping_matters(setting: Setting, sections: dict[str, Section]) -> None:
    (table,) = sections["analysis"].tables
    rows = by_heading(table)

    def collisions(beta: float, clipped: bool) -> float:
        (found,) = [
            row["collisions"]
            for row in rows
            if (row["policy"], row["beta"], row["entropy weight"], row["rewards clipped"], row["zones of"])
            == ("soft", beta, 0.01, clipped, "pose")
        ]
        return found

    assert collisions(-0.01, True) > collisions(-0.02, True) > 0
    assert collisions(-0.01, False) < collisions(-0.01, True)


def test_the_analysis_is_solved_once(setting: Setting, monkeypatch: pytest.MonkeyPatch) -> None:
    before = analysis.section(setting).tables
    monkeypatch.setattr(analysis, "world_yardsticks", lambda *a, **k: pytest.fail("solved again"))
    assert analysis.section(setting).tables == before


@pytest.mark.parametrize("damage", ["", "{", "[]", '{"scenes": {}}', "[" * 10**5, "found"])
def test_a_damaged_file_of_kept_results_is_made_anew(
    setting: Setting, sections: dict, damage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = setting.out / hard_tables.FILE
    before = json.loads(path.read_text())
    path.write_text(json.dumps(before | {"found": {}}) if damage == "found" else damage)
    if damage:  # else they are solved again
        kept = {name: hard_targets.HardTargets(**found) for name, found in before["found"].items()}
        monkeypatch.setattr(hard_tables, "hard_targets", lambda scene: kept[scene.name])
    assert EXPERIMENTS["table2"].section(setting) == sections["table2"]
    assert json.loads(path.read_text()) == before


def test_pareto_front_by_hand() -> None:
    assert pareto_front([(3, 1), (1, 3), (2, 2), (2, 3), (4, 1), (1, 4)]) == [(1, 3), (2, 2), (3, 1)]


def test_the_report_is_complete_and_stands_alone(
    tmp_path: Path, setting: Setting, sections: dict[str, Section]
) -> None:
    sections = {  # of figures that are drawn alike each section's first
        name: replace(section, figures=section.figures[:1], maps=section.maps[:1])
        for name, section in judged(sections).items()
    }
    page = write_report(
        tmp_path, "Title", list(sections.values()), {"command": "clearway <reproduce>"}, "Only smoke.", setting.scenes
    )
    html = page.read_text(encoding="utf-8")
    assert page.name == HTML
    assert "clearway &lt;reproduce&gt;" in html and "Only smoke." in html
    assert "://" not in html  # nothing is loaded from elsewhere; pictures inside may spell anything but a colon
    markdown = (tmp_path / MARKDOWN).read_text(encoding="utf-8")
    content = json.loads((tmp_path / JSON).read_text(encoding="utf-8"))
    assert [section["name"] for section in content["sections"]] == list(sections)
    summary = html[: html.index('<section id="table1">')], markdown[: markdown.index(sections["table1"].title + "\n\n")]
    for section in sections.values():
        assert section.title in markdown
        untold = [claim.text for claim in section.claims for text in summary if claim.text not in text]
        assert not untold
        for table in section.tables:
            with (tmp_path / "tables" / f"{table.name}.csv").open(newline="", encoding="utf-8") as file:
                rows = list(csv.reader(file))
            assert rows[0] == list(table.headings)
            assert len(rows) == 1 + len(table.rows)
        for figure in section.pictures:
            assert (tmp_path / "figures" / f"{figure.name}.png").stat().st_size > 1000
            assert f"figures/{figure.name}.png" in markdown


@pytest.fixture
def failing(setting: Setting, monkeypatch: pytest.MonkeyPatch) -> tuple[str, int]:
    """One target that one agent never reaches; the scene's name and the target."""
    (group, *_) = table1.all_groups(setting)
    path = trial_path(setting.out, group.runs[1], group.trial)

    def damaged(found: Path) -> tuple[EpisodeTable, dict]:
        table, about = read_episodes(found)
        if found != path:
            return replace(table, reached=np.ones_like(table.reached)), about
        return replace(table, reached=table.target != 4), about

    monkeypatch.setattr(job, "read_episodes", damaged)
    return "kitchen", setting.targets[1][1]


def test_a_failed_target_is_counted_named_and_listed_first(setting: Setting, failing: tuple[str, int]) -> None:
    section = table1.section(setting)
    table, by_target = section.tables
    rows = [row[:5] for row in table.rows if row[1:3] == ("paper", "shortest")]
    assert [row[3:] for row in rows] == [(2, "1 of 10")] * 2
    assert [row[4] for row in table.rows if row[1:3] == ("paper", "bump")] == ["0 of 10"] * 2
    assert f"Failed, paper, shortest: {failing[0]} {failing[1]} (seed 1)." in table.notes
    lost = [row[:5] for row in by_target.rows if row[2] != learnt_maps.NEAREST]  # made pictures are too alike for it
    assert lost[0] == (*failing, "paper", "shortest", 1)
    told = [
        claim.evidence for claim in section.claims if claim.text.startswith("paper: fewer collisions than with the")
    ]
    assert "Failed targets, over all seeds: 0 of 10, 1 of 10; episodes that arrived: 100.00%, 87.50%" in told[0]


def test_per_target_figures_of_unseen_targets_name_them(setting: Setting, sections: dict[str, Section]) -> None:
    _, table = sections["fig5"].tables
    for steps in fig5.DISTANCES:
        named = {row[1:3] for row in table.rows if row[0] == steps}
        chosen = zip(setting.scenes, fig5.unseen_targets(setting, steps), strict=True)
        assert named == {(scene.name, target) for scene, own in chosen for target in own}
    _, table = sections["fig6"].tables
    held_out = zip(setting.scenes, fig6.held_out_targets(setting), strict=True)
    assert {row[1:3] for row in table.rows} == {(scene.name, target) for scene, own in held_out for target in own}


def test_a_trial_s_file_says_on_which_targets(setting: Setting) -> None:
    for each in planned(setting, ["fig5"]):
        for trial in each.trials:
            about = read_episodes(trial_path(setting.out, each.run, trial))[1]
            assert about["targets"] == dict(zip(("bathroom", "kitchen"), map(list, trial.targets), strict=True))


def test_figure_6_says_how_well_the_trained_targets_were_learnt(setting: Setting, sections: dict[str, Section]) -> None:
    table, _ = sections["fig6"].tables
    row = next(dict(zip(table.headings, row, strict=True)) for row in table.rows if row[:2] == (5, "default"))
    tables = []
    for each in planned(setting, ["fig6"]):
        if each.run.learner.hindsight and len(each.run.targets[0]) == 5:
            (trial,) = [trial for trial in each.trials if trial.targets == each.run.targets]
            tables.append(episodes_of(setting.out, each.run, trial))
    assert len(tables) == 2
    assert row["sc on trained targets"] == pytest.approx(np.mean([table.reached.mean() for table in tables]))


def test_memory_says_what_a_map_holds_of_the_frames_it_was_learnt_in(sections: dict[str, Section]) -> None:
    section = sections["memory"]
    (table,), (figure,) = section.tables, section.figures
    (line,) = figure.series
    assert list(line.x) == sorted(line.x) and line.y[0] < line.y[-1] == 1.0
    rows = by_heading(table)
    by_frames = [row["steps"] for row in rows if row["agent"] == learnt_maps.PLANNER]
    best = min(row["steps"] for row in rows)
    assert by_frames[-1] == best and by_frames[0] > best  # nobody takes fewer than the shortest paths
    assert {"q-learning", "bc", "default", "paper", "random walk"} < {row["agent"] for row in rows}
    assert all(claim.further for claim in section.claims)


def test_what_the_paper_asks_stands_apart_from_further_questions(sections: dict[str, Section]) -> None:
    further = [claim.text for claim in sections["table1"].claims if claim.further]
    assert "default: fewer collisions than with a penalty for bumping" in further
    assert "paper, unclipped: fewer collisions than with the shortest-path reward" in further
    assert "paper: fewer collisions than with the shortest-path reward" not in further
    summary = report._summary(list(judged(sections).values()))
    assert [len(table.rows) for table in summary] == [42, 96]


def test_a_report_takes_with_it_what_one_that_was_cut_off_left(
    tmp_path: Path, setting: Setting, sections: dict[str, Section], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Killed(BaseException):
        pass

    def killed(*_: object) -> None:
        raise Killed

    with monkeypatch.context() as patch, pytest.raises(Killed):
        patch.setattr(report, "_markdown", killed)
        write_report(tmp_path, "Title", [sections["memory"]], {}, "", setting.scenes)
    assert list((tmp_path / "figures").iterdir())
    write_report(tmp_path, "Title", [sections["fig5"]], {}, "", setting.scenes)
    assert [path.name for path in (tmp_path / "figures").iterdir()] == ["fig5.png"]


def test_a_report_takes_with_it_what_an_earlier_one_left(
    tmp_path: Path, setting: Setting, sections: dict[str, Section]
) -> None:
    own = tmp_path / "figures" / "mine.png"
    own.parent.mkdir()
    own.write_bytes(b"mine")
    for names in (["memory", "fig5"], ["fig5"]):
        write_report(tmp_path, "Title", [sections[name] for name in names], {}, "", setting.scenes)
    assert {path.name for path in (tmp_path / "figures").iterdir()} == {"fig5.png", "mine.png"}
    content = json.loads((tmp_path / JSON).read_text())
    content["sections"][0]["tables"][0]["name"] = "../../outside"
    outside = tmp_path.parent / "outside.csv"
    outside.write_text("kept")
    (tmp_path / JSON).write_text(json.dumps(content))
    write_report(tmp_path, "Title", [sections["memory"]], {}, "", setting.scenes)
    assert outside.exists() and not (tmp_path / "figures" / "fig5.png").exists()
