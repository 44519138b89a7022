"""What the pages say of agents is what their records come to."""

import json
import re
import tarfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clearway.agents.on_learnt_map import MOST_A_POSE
from clearway.evaluation.across_seeds import mean_estimate
from clearway.experiments import fig5, fig6, shuffles, table1, zone_time
from clearway.experiments.convergence import ONE_TARGET, frames_until_settled, mark_steps, settled_row
from clearway.experiments.correction import holm
from clearway.experiments.generalisation import Tried, tried
from clearway.experiments.groups import PAIR, compared
from clearway.experiments.learnt_maps import PLANNER, on_maps
from clearway.experiments.plan import NEAREST
from clearway.experiments.reproduce import REQUEST_FILE, gather
from clearway.experiments.section import ReportTable, Section
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import judged_less
from clearway.learn.run_folder import RunFolder
from clearway.reward import COLLISION_AWARE
from helpers.published import (
    DOCS,
    EVIDENCE,
    RESULTS,
    assert_judged,
    assert_shown,
    assert_written,
    benchmark,
    ends_of,
    numbers,
    rows_of,
    seconds_of_runs,
    section_of,
    unpack,
)

AGENTS = r"collision-aware|dearer|shuffled|shortest"


def test_a_figure_that_differs_in_its_last_digit_is_seen() -> None:
    assert_written("93.3", 93.34, "near")
    with pytest.raises(AssertionError, match=r"written 93\.3, recorded 93\.36"):
        assert_written("93.3", 93.36, "far")


@pytest.mark.slow
def test_what_memory_solves_is_what_its_record_comes_to(tmp_path: Path) -> None:
    unpack("memory-bathroom", tmp_path / "memory")
    found = gather(tmp_path / "memory")
    (section,) = found.sections
    assert not section.missing
    (table,) = section.tables
    rows = [dict(zip(table.headings, row, strict=True)) for row in table.rows]
    lines = RESULTS.splitlines()
    told = [line.strip("|").split("|") for line in lines if line.startswith("| planner on a learnt map")]
    assert len(told) == 3
    for label, agents in (("default recipe | 3,", ["default"]), ("Q-learning, behaviour", ["q-learning", "bc"])):
        for line in lines:
            if line.startswith(f"| {label}"):
                told += [[agent, *line.strip("|").split("|")[1:]] for agent in agents]
    assert len(told) == 6
    for agent, frames, steps, collisions, shortest in told:
        count = int(frames.replace(",", ""))
        (row,) = [row for row in rows if row["agent"] == agent.strip() and row["frames"] == count]
        if numbers(shortest):
            least, *most = (float(end.rstrip("%")) for end in row["shortest ways"].split(" to "))
            assert_written(numbers(shortest)[0], least, "least")
            assert_written(numbers(shortest)[-1], most[0], "most")
        for cell, name in ((steps, "steps"), (collisions, "collisions")):
            mean, *interval = numbers(cell)
            assert_written(mean, row[name], f"{name} after {count} frames")
            recorded = numbers(str(row[f"95 % of {name}"]))
            assert not interval or [*map(float, interval)] == [*map(float, recorded)]
    shown = rows_of(section_of(EVIDENCE, "What memory alone solves"))
    maps = [row for row in rows if row["reward"] == "map"]
    for planner, nearest in zip(maps[::2], maps[1::2], strict=True):
        ((steps, bumps, spl, own_steps, own_bumps, failed),) = [
            cells for frames, *cells in shown if frames == f"{planner['frames']:,}"
        ]
        for cell, row in ((steps, planner), (own_steps, nearest)):
            mean, *ends = numbers(cell.replace(",", ""))
            assert_written(mean, row["steps"], cell)
            assert not ends or ends == numbers(str(row["95 % of steps"]).replace(",", ""))
        assert_written(bumps, planner["collisions"], bumps)
        assert_written(own_bumps.replace(",", ""), nearest["collisions"], own_bumps)
        assert_written(numbers(spl)[0], 100 * planner["spl"], spl)
        assert failed == nearest["failed targets"] and planner["failed targets"] == "0 of 25"
    check_targets_that_maps_were_not_given(found.setting)
    mark = mark_steps(found.setting, found.setting.targets)
    runs = [RunFolder(path) for path in (tmp_path / "memory" / "runs").glob("ppo-*")]
    settled = [settled_row(run.metrics(), mark)["frames"] for run in runs]
    assert len(settled) == 5 and f"settled after {round(np.mean(settled), -3):,.0f} frames" in RESULTS
    verdicts = {claim.text.partition(":")[0]: claim.verdict for claim in section.claims}
    assert verdicts == {"default": "does not hold", "q-learning": "undecided", "bc": "undecided"}


def check_targets_that_maps_were_not_given(setting: Setting) -> None:
    """What the pages say of a planner on a learnt map, and the nearest picture, in figures 5 and 6."""
    held_out = fig6.held_out_targets(setting)
    (group,) = tried(setting, (COLLISION_AWARE,), held_out)
    scenes = setting.world(held_out).target_scene.numpy()
    part = section_of(EVIDENCE, "Figure 6: more training targets").splitlines()
    shown, found = 0, {}
    for mapped in on_maps(setting, group.trial, (fig6.FEW_A_POSE, MOST_A_POSE)):
        cells = Tried(mapped.scores, scenes).cells()
        found[mapped.called] = cells
        for line in (line for line in part if line.startswith(f"| {', '.join(mapped.called)} |")):
            for text, value, ends in zip(line.strip("|").split("|")[2:], cells[::2], cells[1::2], strict=True):
                mean, *interval = numbers(text.replace("-", " "))
                assert_written(mean, 100 * value, line)
                for written, end in zip(interval, numbers(ends) if interval else (), strict=True):
                    assert_written(written, 100 * float(end), line)
            shown += 1
    assert shown == 2
    assert "does as well, within 0.5 points" in EVIDENCE
    for frames in ("1,500 frames", "11,600 frames"):
        pairs = zip(found[PLANNER, frames][::2], found[NEAREST, frames][::2], strict=True)
        assert all(abs(one - other) < 0.005 for one, other in pairs)
    success, *_, spl, ends = found[PLANNER, "1,500 frames"]
    low, high = map(float, numbers(ends))
    row = f"| pose-told planner, 1,500 frames | {success:.0%} held-out | {spl:.0%} ({100 * low:.0f}-{high:.0%}) | | |"
    assert row.replace("%", " %").replace(" %)", ")") in RESULTS
    for steps in fig5.DISTANCES:
        (trial,) = {group.trial for group in fig5._groups(setting, steps)}
        for mapped in on_maps(setting, trial):
            assert mapped.scores.of("spl").min() == pytest.approx(1)


def test_own_goals_are_what_their_record_comes_to() -> None:
    record = json.loads((DOCS / "figures" / "own-goals.json").read_text(encoding="utf-8"))
    page = section_of(EVIDENCE, "Own goals")
    tables = {
        "fig5": [("steps away", "agent"), "| steps from a given target |", 2],
        "fig6": [("targets a scene",), "| given targets |", 1],
    }
    for name, (keys, heading, width) in tables.items():
        headings, *rows = record[name]
        found = {}
        for row in rows:
            figures = dict(zip(headings, row, strict=True))
            if figures["learner"]:
                found[tuple(figures[key] for key in keys)] = figures
        lines = page.partition(heading)[2].partition("\n\n")[0].splitlines()[2:]
        assert len(lines) == len([key for key in found if key[0] not in ("", "average")])
        for line in lines:
            cells = [cell.strip() for cell in line.strip("|").split("|")]
            figures = found[cells[0].replace("7 (two targets)", "8"), *cells[1:width]]
            for cell, of in zip(cells[width:], ("sc", "sc within 4 x shortest", "SPL"), strict=True):
                assert_written(numbers(cell)[0], 100 * float(figures[of]), f"{of} in {line}")
        if name == "fig5":
            (line,) = [line for line in RESULTS.splitlines() if line.startswith("| one to seven steps from five given")]
            of_all = [found["average", agent] for agent in ("shortest", "collision-aware")]
            for written, figures in zip(numbers(line.split("|")[3]), of_all, strict=True):
                assert_written(written, 100 * float(figures["SPL"]), line)


def check_zones_of_cells(section: Section) -> None:
    """Rows and claims of its section of the evidence."""
    lines = section_of(EVIDENCE, "Zones of cells").splitlines()
    steps, _, settled = section.tables
    for agent in ("shortest", "collision-aware, zones of poses", "collision-aware, zones of cells"):
        (line,) = [line for line in lines if line.startswith(f"| {agent} |")]
        cells = [cell.replace(",", "") for cell in re.split(r" \| ", line.strip("| "))]
        row = dict(zip(steps.headings, next(r for r in steps.rows if r[:3] == ("steps", "paper", agent)), strict=True))
        bumps = dict(
            zip(steps.headings, next(r for r in steps.rows if r[:3] == ("collisions", "paper", agent)), strict=True)
        )
        late = dict(zip(settled.headings, next(r for r in settled.rows if r[:2] == ("paper", agent)), strict=True))
        for cell, value, interval in (
            (cells[1], late["frames"], late["95 %"]),
            (cells[2], row["average"], row["95 %"]),
            (cells[3], bumps["average"], bumps["95 %"]),
        ):
            mean, low, high = numbers(cell)[:3]
            assert_written(mean, float(value), agent)
            assert [float(low), float(high)] == [
                pytest.approx(float(end.replace(",", "")), rel=0.01) for end in interval.split(" to ")
            ]
        assert cells[1].split()[-3] == str(late["settled"])
        assert cells[4] == row["failed targets"]
    told = [re.split(r" \| ", line.strip("| ")) for line in lines if re.match(r"\| (fewer|no more|settles)", line)]
    by_text = {
        claim.text.removeprefix("paper: ").replace(" with zones of cells", ""): claim for claim in section.claims
    }
    assert {text for text, *_ in told} == set(by_text) and len(told) == 5
    for text, difference, p, corrected in told:
        claim = by_text[text]
        assert f"p = {p}, for 5 claims {corrected} (Holm)" in claim.evidence
        low_to_high = difference.replace(" (", " [").replace(")", "]")
        assert f"difference {low_to_high}" in claim.evidence
        assert claim.verdict == "undecided"


@pytest.mark.slow
def test_zones_or_a_larger_step_is_what_its_record_comes_to(tmp_path: Path) -> None:
    unpack("zones-or-step-bathroom", tmp_path / "zones")
    section, of_cells = gather(tmp_path / "zones").sections
    assert not section.missing and not of_cells.missing
    check_zones_of_cells(of_cells)
    table = section.tables[-1]
    rows = {row["agent"]: row for row in (dict(zip(table.headings, row, strict=True)) for row in table.rows)}
    told = {
        "shortest": "| shortest | 812",
        "dearer": "| steps as dear as zones",
        "shuffled": "| zones of shuffled",
        "collision-aware": "| collision-aware | 460",
    }
    lines = RESULTS.splitlines()
    for agent, begin in told.items():
        (line,) = [line for line in lines if line.startswith(begin)]
        _, frames, settled, *_ = line.strip("|").split("|")
        mean, *interval = numbers(frames.replace(",", ""))
        assert_written(mean, rows[agent]["frames"], agent)
        assert interval == numbers(str(rows[agent]["95 %"]).replace(",", ""))
        assert int(settled.split()[0]) == rows[agent]["settled"]
    evidence = section_of(EVIDENCE, "Zones, or a larger step?")
    seconds = [
        json.loads(path.read_text().splitlines()[-1])["seconds"]
        for path in (tmp_path / "zones").glob("runs/*/metrics.jsonl")
        if json.loads((path.parent / "run.json").read_text())["zone_level"] == "pose"
    ]
    assert f"{min(seconds):.0f} to {round(max(seconds), -1):,.0f} s a run" in evidence
    table = section.tables[0]
    for row in (dict(zip(table.headings, row, strict=True)) for row in table.rows):
        if row["seeds"] == 5:
            name = row["agent"] if row["learner"] == "paper" else row["learner"]
            (line,) = [line for line in evidence.splitlines() if line.startswith(f"| {name} |")]
            assert name == row["agent"] or f"Maps are of {row['agent']}" in evidence
            cell = line.strip("|").split("|")[2 if row["figure"] == "steps" else 3]
            mean, *interval = numbers(cell)
            assert_written(mean, row["average"], line)
            ends = numbers(str(row["95 %"]))
            for written, end in zip(interval, ends if interval else (), strict=True):
                assert_written(written, float(end), line)
            assert interval or len(set(ends)) == 1
    claims = {" than ".join(re.findall(AGENTS, claim.text)): claim for claim in section.claims[1:]}
    claims["collision-aware than shortest"] = section.claims[0]
    for name, claim in claims.items():
        (line,) = [line for line in evidence.splitlines() if line.startswith(f"| {name} |")]
        _, difference, p, corrected, verdict = (cell.strip() for cell in line.strip("|").split("|"))
        mean, low, high = (float(end.replace(",", "")) for end in re.findall(r"-?\d[\d,]*", difference))
        found = claim.numbers["difference"]
        for written, value in zip((mean, low, high), (found.value, *found.interval), strict=True):
            assert abs(written - value) <= 500
        assert f"p = {p}, for 5 claims {corrected} (Holm)" in claim.evidence
        assert verdict == claim.verdict
    verdicts = [claim.verdict for claim in section.claims]
    assert verdicts == ["holds", "holds", "undecided", "undecided", "undecided"]


def check_results_of_shuffles(table: ReportTable, late: ReportTable) -> None:
    """The right half of a table of the results."""
    lines = rows_of(section_of(RESULTS, "Zones, or a larger step?"))
    names = {"own shuffle": "zones of shuffled poses"}
    for row in (dict(zip(late.headings, row, strict=True)) for row in late.rows):
        agent = names.get(str(row["agent"]), row["agent"])
        ((*_, frames, collisions),) = [line for line in lines if line[0] == agent]
        frames, ran = frames.split("), ")
        exact = row["frames"], *ends_of(row["95 %"])
        for written, value in zip(numbers(frames.replace(",", "")), exact, strict=True):
            assert abs(float(written) - value) <= 500
        assert ran == f"{row['settled']} of 8"
        (own,) = [r for r in table.rows if r[0] == "collisions" and r[1:3] == ("paper", row["agent"])]
        found = dict(zip(table.headings, own, strict=True))
        assert_shown(collisions.partition(", one run")[0], found["average"], found["95 %"])


def check_runs_one_by_one(setting: Setting, shuffled: str, time_in: str) -> None:
    """What the two sections say of single runs, and of those that had settled."""
    world, mark = setting.world(), mark_steps(setting, setting.targets)
    groups = {group.agent: group for group in (*shuffles._groups(setting), *compared(setting, table1.REWARDS))}
    scores = {agent: group.scores(setting.out, world.target_count) for agent, group in groups.items()}
    settled = {agent: frames_until_settled(setting.out, group, mark) for agent, group in groups.items()}
    ended = {agent: frames[:, 0] < setting.budget.frames for agent, (frames, _) in settled.items()}
    assert settled["collision-aware"][0].max() < settled["shortest"][0].min()
    bumps = {agent: own.of("collisions").mean(1) for agent, own in scores.items()}
    shuffle, aware, short = np.sort(bumps["own shuffle"]), bumps["collision-aware"], bumps["shortest"]
    short = short[ended["shortest"]]
    assert (
        f"({shuffle[-1]:.1f}); the other seven have {shuffle[0]:.3f} to {shuffle[-2]:.3f}, all of `collision-aware` "
        f"{aware.min():.3f} to {aware.max():.3f}, the five settled ones of `shortest` {short.min():.3f} to "
        f"{short.max():.3f}." in shuffled
    )
    for agent in ("shortest", "bump", "collision-aware"):
        line = next(line for line in time_in.splitlines() if line.startswith(f"| {agent} |"))
        assert line.endswith(f"| {settled[agent][1]} of 8 |")
    in_zone = {agent: own.of(next(iter(zone_time.FIGURES))).mean(1) * 100 for agent, own in scores.items()}
    others, own = [in_zone[agent][ended[agent]] for agent in ("shortest", "bump")], in_zone["collision-aware"]
    ranges = [f"{each.min():.1f} to {each.max():.1f} %" for each in (*others, own)]
    told = f"Settled runs differ, too: {ranges[0]} under `shortest`, {ranges[1]} under `bump`, against {ranges[2]}"
    assert told.removesuffix(" %") in time_in
    assert f"{bumps['bump'].mean():.2f} collisions, `shortest` {bumps['shortest'].mean():.2f}" in time_in
    assert sum(map(len, others)) == 9 and "settled runs (nine of 16) exceed all of its" in RESULTS
    assert min(each.min() for each in others) > own.max()


@pytest.mark.slow
def test_zones_shuffled_anew_and_time_in_the_zones_are_what_their_record_comes_to(tmp_path: Path) -> None:
    unpack("shuffles-bathroom", tmp_path / "shuffles")
    shuffled, zones = gather(tmp_path / "shuffles").sections
    assert not shuffled.missing and not zones.missing
    part = section_of(EVIDENCE, "Zones shuffled anew")
    lines = rows_of(part)
    table, late = shuffled.tables[0], shuffled.tables[-1]
    for row in (dict(zip(late.headings, row, strict=True)) for row in late.rows):
        ((frames, steps, collisions, lost),) = [cells for agent, *cells in lines if agent == row["agent"]]
        frames, settled = frames.split("), ")
        assert_shown(frames, row["frames"], row["95 %"])
        assert settled == f"{row['settled']} of 8"
        for figure, cell in (("steps", steps), ("collisions", collisions)):
            (own,) = [r for r in table.rows if r[0] == figure and r[1:3] == ("paper", row["agent"])]
            found = dict(zip(table.headings, own, strict=True))
            assert_shown(cell, found["average"], found["95 %"])
            assert lost == found["failed targets"]
    assert [claim.verdict for claim in shuffled.claims] == ["undecided", "holds", "holds"]
    check_results_of_shuffles(table, late)

    time_in = section_of(EVIDENCE, "Time in the zones")
    shares = rows_of(time_in)
    (table,) = zones.tables
    for _, agent, _, share, share_ends, visits, visits_ends, near, near_ends, steps, steps_ends in table.rows:
        if agent in ("shortest", "bump", "collision-aware"):
            first, *_ = [cells for name, *cells in shares if name == agent]
            assert_shown(first[0], share, share_ends, 100)
            assert_shown(first[1], visits, visits_ends)
            assert_shown(first[2], near, near_ends, 100)
            assert_shown(first[3], steps, steps_ends)
            low, high = (100 * end for end in ends_of(share_ends))
            assert f"{100 * share:.1f} %" in RESULTS and f"({low:.1f}-{high:.1f})" in RESULTS
        else:
            begin = "random walk" if agent == "random walk" else "planner on a learnt map; nearest picture"
            cells = next(cells for name, *cells in shares if name.startswith(begin))
            for cell, value in zip(cells, (100 * share, visits, 100 * near, steps), strict=True):
                assert_written(numbers(cell)[0], value, cell)
    assert [claim.verdict for claim in zones.claims] == ["holds"] * 4
    check_runs_one_by_one(gather(tmp_path / "shuffles").setting, part.replace("\n", " "), time_in)

    for claim in (*shuffled.claims, *zones.claims):
        text = claim.text.removeprefix("paper: ").removeprefix("collision-aware, ")
        ((difference, p, corrected, verdict),) = [
            cells for name, *cells in (*lines, *shares) if name.removeprefix("collision-aware, ") == text
        ]
        assert_judged(claim, verdict, p, corrected, difference=difference)
    seconds = seconds_of_runs(tmp_path / "shuffles")
    assert len(seconds) == 32 and f"{min(seconds):.0f} to {max(seconds):.0f} s a run" in part


@pytest.mark.slow
def test_hard_targets_of_fresh_seeds_are_what_their_record_comes_to(tmp_path: Path) -> None:
    unpack("hard-bathroom", tmp_path / "hard")
    sections = gather(tmp_path / "hard").sections
    assert [section.name for section in sections] == ["fig4", "table2", "table3"]
    page = section_of(EVIDENCE, "Hard targets")
    page = page.partition("Seeds 0 to 4")[0]
    lines = rows_of(page)
    for section, frames in zip(sections[1:], ("1 M", "2 M"), strict=True):
        assert not section.missing
        table, late = section.tables[0], section.tables[-1]
        for row in (dict(zip(late.headings, row, strict=True)) for row in late.rows):
            ((settled, *cells, lost),) = [cells for agent, of, *cells in lines if (agent, of) == (row["agent"], frames)]
            settled, ran = settled.split("), ")
            assert_shown(settled, row["frames"], row["95 %"])
            assert ran == f"{row['settled']} of 5"
            for figure, cell in zip(("steps", "collisions"), cells, strict=True):
                (own,) = [r for r in table.rows if r[0] == figure and r[1:3] == ("paper", row["agent"])]
                found = dict(zip(table.headings, own, strict=True))
                assert_shown(cell, found["average"], found["95 %"])
                assert lost == found["failed targets"]
        solved = {row[1] for row in table.rows if row[0] == "steps" and row[3] == 5 and f"{row[7]:.2f}" == "10.88"}
        assert solved == {"q-learning", "bc", "planner on a learnt map", "nearest picture"}
    shown = rows_of(section_of(RESULTS, "Hard targets"))
    for agent in ("shortest", "bump", "collision-aware"):
        ((_, *pairs),) = [line for line in shown if line[0] == agent]
        for pair, section in zip(pairs, sections[1:], strict=True):
            for figure, written in zip(("steps", "collisions"), pair.split(", "), strict=True):
                (own,) = [r for r in section.tables[0].rows if r[0] == figure and r[1:3] == ("paper", agent)]
                assert_written(written.replace(",", ""), own[7], agent)
    claims = [claim for section in sections for claim in section.claims]
    for claim in claims:
        ((verdict, *cells, p, corrected),) = [
            cells for text, *cells in lines if text == claim.text.removeprefix("paper: ")
        ]
        assert_judged(claim, verdict, p, corrected, *cells)
    assert sum(len(line) == 7 for line in lines) == len(claims) + 1
    seconds = seconds_of_runs(tmp_path / "hard", "a2c-*")
    assert len(seconds) == 40 and f"{min(seconds):.0f} to {max(seconds):.0f} s a run" in page


def four_rooms(record: str, folder: Path) -> Iterator[tuple[dict[str, Any], int, dict[str, np.ndarray], str]]:
    """Of each trial of a record: its run, after how many million frames, its episodes, and which targets were lost."""
    unpack(record, folder)
    for trial in sorted(folder.glob("runs/*/trials/*.json")):
        content = json.loads(trial.read_text(encoding="utf-8"))
        run = json.loads((trial.parents[1] / "run.json").read_text(encoding="utf-8"))
        episodes = {name: np.array(column) for name, column in content["episodes"].items()}
        lost = set(episodes["target"][~episodes["reached"].astype(bool)].tolist())
        yield run, 5 if content["about"]["halfway"] else 10, episodes, f"{len(lost)} of 20"


def row_of(begin: str) -> list[str]:
    """Cells of the row of the evidence that begins so, without commas."""
    lines = EVIDENCE.splitlines()
    (line,) = [line for line in lines if line.startswith(begin)]
    return line.removeprefix(begin).replace(",", "").strip(" |").split(" | ")


def test_four_rooms_otherwise_are_what_their_record_comes_to(tmp_path: Path) -> None:
    trials = list(four_rooms("four-rooms-otherwise", tmp_path / "four"))
    assert len(trials) == 8
    for run, frames, episodes, lost in trials:
        learner = run["learner"]
        changed = "whitened" if learner["whiten_features"] else "3 x rate"
        assert learner["lr_start"] == (0.0007 if changed == "whitened" else 0.0021)
        begin = f"| {run['reward']['name']}, {changed} | {frames} M | "
        steps, collisions, failed = row_of(begin)
        assert_written(steps, episodes["steps"].mean(), begin)
        assert_written(collisions, episodes["collisions"].mean(), begin)
        assert failed == lost


@pytest.mark.slow
def test_four_rooms_on_the_eyes_are_what_their_record_comes_to(tmp_path: Path) -> None:
    trials = list(four_rooms("four-rooms-eyes", tmp_path / "four"))
    assert len(trials) == 4
    for run, frames, episodes, lost in trials:
        assert {scene["encoder"] for scene in run["scenes"]} == {"clearway"}
        assert [scene["name"] for scene in run["scenes"]] == ["bathroom", "bedroom", "living_room", "kitchen"]
        begin = f"| {run['reward']['name']}, by the eyes | {frames} M | "
        *cells, failed = row_of(begin)
        assert failed == lost
        room = np.array([number for number, scene in enumerate(run["scenes"]) for _ in scene["targets"]])
        for number, cell in enumerate(cells):
            own = room[episodes["target"]] == number
            steps, collisions, arrive, _ = cell.split()
            assert_written(steps, episodes["steps"][own].mean(), begin)
            assert_written(collisions, episodes["collisions"][own].mean(), begin)
            assert_written(arrive, 100 * episodes["reached"][own].mean(), begin)
            assert arrive != "100" or episodes["reached"][own].all(), begin


@pytest.mark.slow
def test_the_bedroom_alone_is_what_its_record_comes_to(tmp_path: Path) -> None:
    folder = tmp_path / "bedroom"
    unpack("bedroom", folder)
    page = EVIDENCE.partition("### The bedroom alone")[2]
    page = page.partition("\n## ")[0]
    asked = json.loads((folder / REQUEST_FILE).read_text(encoding="utf-8"))
    compared = 0
    for millions, settled in (("2.5", []), ("5", [("shortest", 2.3, 3), ("collision-aware", 4.25, 2)])):
        (folder / REQUEST_FILE).write_text(json.dumps({**asked, "frames": int(float(millions) * 1e6)}))
        (section,) = gather(folder).sections
        assert not section.missing
        ends, late = section.tables[:2]
        for _, agent, frames, _, failed, steps, between, collisions, between_collisions in ends.rows:
            begin = f"| {agent} | {frames / 1e6:g} M | {millions} M |"
            (line,) = [line for line in page.splitlines() if line.startswith(begin)]
            written = line.removeprefix(begin).strip(" |").split(" | ")
            for cell, value, interval in zip(written, (steps, collisions), (between, between_collisions), strict=False):
                mean, _, low_to_high = cell.replace(",", "").partition(" ")
                assert_written(mean, value, begin)
                assert low_to_high == f"({interval.replace(',', '').replace(' to ', '-')})", begin
            assert written[2] == failed
            compared += 1
        rows = {row[1]: row for row in late.rows}
        for agent, mean, count in settled:
            assert rows[agent][3:5] == (count, mean * 1e6)
            assert f"`{agent}` after {mean:.2f} M" in page
    assert compared == 8


@pytest.mark.slow
def test_the_bedroom_of_fresh_seeds_is_what_its_record_comes_to(tmp_path: Path) -> None:
    unpack("bedroom-fresh", tmp_path / "bedroom")
    found = gather(tmp_path / "bedroom")
    (section,) = found.sections
    assert not section.missing
    page = section_of(EVIDENCE, "The bedroom, of fresh seeds")
    lines = rows_of(page)
    ends, late = section.tables[:2]
    for _, agent, frames, _, failed, steps, between, collisions, between_collisions in ends.rows:
        ((*_, shown, bumps, lost),) = [line for line in lines if line[:2] == [agent, f"{frames / 1e6:g} M"]]
        for cell, value, interval in ((shown, steps, between), (bumps, collisions, between_collisions)):
            mean, *low_high = numbers(cell.replace(",", ""))
            assert_written(mean, value, cell)
            for written, end in zip(low_high, numbers(interval.replace(",", "")), strict=True):
                assert_written(written, float(end), cell)
        assert lost == failed
    for _, agent, _, settled, frames, interval in late.rows:
        ((*_, told, _, _, _),) = [line for line in lines if line[:2] == [agent, "5 M"]]
        assert told == f"{frames:,.0f} ({interval.replace(' to ', '-')}), {settled} of 5"
        results = rf"`{agent}`[^`]* after {frames / 1e6:.2f} M(?: frames)? \({'-'.join(numbers(millions(interval)))}\)"
        assert re.search(results, RESULTS), results
    for claim in section.claims:
        text = claim.text.removeprefix("paper: ")
        ((_, verdict, own, other, p, corrected),) = [line for line in lines if line[0] == text]
        assert_judged(claim, verdict, p, corrected, own, other)
    # the question's own two claims
    setting, groups = found.setting, {group.agent: group for group in compared(found.setting, PAIR)}
    world, mark = setting.world(), mark_steps(setting, setting.targets)
    settled = {agent: frames_until_settled(setting.out, group, mark)[0] for agent, group in groups.items()}
    scores = {agent: group.scores(setting.out, world.target_count) for agent, group in groups.items()}
    bumps = [scores[agent].of("collisions") for agent in ("collision-aware", "shortest")]
    claims = [
        judged_less("sooner", "frames", settled["shortest"], settled["collision-aware"], ONE_TARGET),
        judged_less("fewer", "collisions", *bumps, world.target_scene.numpy()),
    ]
    told = [line for line in lines if line[-1] in ("holds", "undecided")]
    for claim, p_of_both, (_, difference, p, corrected, verdict) in zip(
        claims, holm([claim.p for claim in claims]), told, strict=True
    ):
        apart = claim.numbers["difference"]
        ends = re.findall(r"-?\d[\d,.]*", difference)
        for written, value in zip(ends, (apart.value, *apart.interval), strict=True):
            assert float(written.replace(",", "")) == pytest.approx(value, rel=0.01)
        assert_written(p, claim.p, verdict)
        assert_written(corrected, p_of_both, verdict)
        assert verdict == claim.verdict
    assert settled["shortest"].max() < settled["collision-aware"].min()
    aware, shortest = (np.sort(own.mean(1)) for own in bumps)
    assert aware[3] < shortest[0]
    assert "have 0.046 to 0.092 collisions, fewer than all of `shortest` (0.228 to 0.296)" in page
    for written, value in (("0.046", aware[0]), ("0.092", aware[3]), ("6.8", aware[4]), ("0.228", shortest[0])):
        assert_written(written, value, "collisions")
    seconds = seconds_of_runs(tmp_path / "bedroom")
    assert f"{round(min(seconds), -1):,.0f} to {round(max(seconds), -1):,.0f} s a run" in page


def millions(interval: str) -> str:
    """Frames of an interval, in millions."""
    return " ".join(f"{int(end) / 1e6:.2f}" for end in numbers(interval.replace(",", "")))


@pytest.mark.slow
def test_off_the_grid_is_what_its_record_comes_to(tmp_path: Path) -> None:
    unpack("off-grid-bathroom", tmp_path / "off-grid")
    (section,) = gather(tmp_path / "off-grid").sections
    assert not section.missing
    (table,) = section.tables
    rows = [dict(zip(table.headings, row, strict=True)) for row in table.rows]
    lines = section_of(EVIDENCE, "Five seeds, published settings").splitlines()
    figures = [heading for heading in table.headings[4:] if not heading.startswith("95 %")]
    means = [row for row in rows if row["setting"] == "all settings, mean"]
    assert len(means) == 6
    names = {"nearest picture": "nearest picture", "walked": "random walk"}
    for row in means:
        name = names.get(str(row["learner"]), row["reward"])
        (line,) = [line for line in lines if line.startswith(f"| {name} |") and line.count("|") == 8]
        for cell, name in zip(line.strip("|").split("|")[1:], figures, strict=True):
            scale = 1 if name == "contacts" else 100
            ends = (float(end) for end in str(row[f"95 % of {name}"]).split(" to "))
            for written, value in zip(re.findall(r"[\d.]+", cell), (float(str(row[name])), *ends), strict=True):
                assert abs(float(written) - scale * value) <= (0.0051 if name == "contacts" else 0.051), (
                    f"{row['reward']}, {name}"
                )
    under = [line.strip("| ").split(" | ") for line in lines if line.count("|") == 8 and "%, " in line]
    assert [label for label, *_ in under] == [str(row["setting"]) for row in rows[6::6]]
    for number, (label, *cells) in enumerate(under, start=1):
        for cell, row in zip(cells, rows[6 * number : 6 * number + 6], strict=True):
            success, contacts = cell.split(" %, ")
            assert_written(success, 100 * row["success"], label)
            assert_written(contacts, row["contacts"], label)
    claims = [
        line.strip("|").split("|") for line in lines if line.endswith(("undecided |", "holds |", "does not hold |"))
    ]
    assert len(claims) == len(section.claims) == 12
    for (text, difference, p, corrected, verdict), claim in zip(claims, section.claims, strict=True):
        assert claim.text.endswith(f": {text.strip()}")
        found = claim.numbers["difference"]
        assert found.interval is not None
        told = f"{found.value:.3g} ({found.interval[0]:.3g} to {found.interval[1]:.3g})"
        assert difference.strip() == told
        assert f"p = {p.strip()}, for 6 claims {corrected.strip()} (Holm)" in claim.evidence
        assert verdict.strip() == claim.verdict


@pytest.mark.slow
def test_what_single_parts_bring_is_what_its_record_comes_to(tmp_path: Path) -> None:
    unpack("ablations-two-rooms", tmp_path / "ablations")
    (section,) = gather(tmp_path / "ablations").sections
    assert not section.missing
    told = {
        "as it is: history 4": ("default", "collision-aware"),
        "history 1": ("default, history 1", "collision-aware"),
        "history 2": ("default, history 2", "collision-aware"),
        "history 8": ("default, history 8", "collision-aware"),
        "one head": ("default, one head", "collision-aware"),
        "the collision zone's penalty alone": ("default", "beta-alone"),
        "the precollision zone's penalty alone": ("default", "gamma-alone"),
    }
    rows = [dict(zip(table.headings, row, strict=True)) for table in section.tables for row in table.rows]
    part = section_of(EVIDENCE, "What single parts bring")
    lines = part.splitlines()
    for begin, (learner, agent) in told.items():
        (line,) = [line for line in lines if line.startswith(f"| {begin}") and line.count("|") == 5]
        shown = line.strip("|").split("|")[1:]
        mine = [row for row in rows if (row["learner"], row["agent"]) == (learner, agent) and "seed" not in row]
        steps, collisions, settled = (
            next(row for row in mine if row.get("figure") == "steps"),
            next(row for row in mine if row.get("figure") == "collisions"),
            next(row for row in mine if "settled" in row),
        )
        for text, row, name in zip(shown, (steps, collisions, settled), ("average", "average", "frames"), strict=True):
            mean, *interval = numbers(text.replace(",", "").replace("-", " "))
            assert_written(mean, row[name], begin)
            assert interval == numbers(str(row["95 %"]).replace(",", ""))
    maps = [row for row in rows if row["agent"] == "41,500 frames" and "seed" not in row]
    assert len(maps) == 4
    for row in maps:
        (line,) = [line for line in lines if line.startswith(f"| {row['learner']}, {row['agent']} |")]
        mean, *interval = numbers(line.strip("|").split("|")[1 if row["figure"] == "steps" else 2].replace("-", " "))
        assert_written(mean, row["average"], line)
        assert interval == numbers(str(row["95 %"]))
    verdicts = [claim.verdict for claim in section.claims]
    assert verdicts == ["undecided"] * 6
    claimed = [line.strip("| ").split(" | ") for line in lines if line.endswith("| undecided |")]
    for cells, claim in zip(claimed, section.claims, strict=True):
        assert f"p = {cells[2]}, for 6 claims {cells[3]} (Holm)" in claim.evidence
        told = re.search(r"difference (\S+) \[(\S+) to (\S+)\]", claim.evidence)
        assert told and re.findall(r"-?[\d.]+", cells[1]) == [f"{float(one):.3f}" for one in told.groups()], cells
        arm = cells[0].rpartition("than with ")[2]
        assert (
            claim.text.endswith(arm)
            or {"beta-alone": "collision", "gamma-alone": "precollision"}[claim.text.rpartition(" ")[2]]
            == arm.split()[1]
        ), cells
    failed = {row["learner"]: row["failed targets"] for row in rows if row.get("seeds") and "failed targets" in row}
    assert "All 50\ntargets" in part and "one of 50 targets is lost" in part
    assert failed.pop("nearest picture") == "1 of 50" and set(failed.values()) == {"0 of 50"}


def test_rooms_that_nobody_tuned_on_are_solved_as_their_record_says() -> None:
    sets = json.loads((DOCS / "figures" / "fresh-rooms.json").read_text(encoding="utf-8"))
    runs = [run for one in sets for run in one["seeds"]]
    assert len(runs) == 6 and all(run["met"]["all"] and run["solved_targets"] == 20 for run in runs)
    first, solved = ([run["first_met"][name]["seconds"] for run in runs] for name in ("all", "solved_targets"))
    columns = [[run[name] for run in runs] for name in ("path_ratio", "worst_path_ratio", "collisions")]
    (line,) = [line for line in RESULTS.splitlines() if "three times four" in line]
    for cell, values in zip(line.strip("|").split("|")[1:], [*columns, solved, first], strict=True):
        least, most = numbers(cell)
        assert_written(least, min(values), cell)
        assert_written(most, max(values), cell)
    for one in sets:
        for run in one["seeds"]:
            rows = run["evaluation"]["targets"]
            for name in ("steps", "collisions"):
                assert run[name] == pytest.approx(sum(row[name] for row in rows) / len(rows))


def test_other_encoders_and_rooms_meet_the_criteria_as_their_record_says() -> None:
    made = json.loads((DOCS / "figures" / "other-encoders-and-rooms.json").read_text(encoding="utf-8"))
    assert [one["command"].split()[-1] for one in made] == [
        f"{k}{n}.json" for k in ("encoder", "room") for n in range(1, 6)
    ]
    part = EVIDENCE.partition("**Other encoders, other rooms**")[2]
    for first, name in ((0, "| the random ResNet-50"), (5, "| the rooms")):
        runs = [run for one in made[first : first + 5] for run in one["seeds"]]
        assert len(runs) == 5 and all(run["met"]["all"] and run["solved_targets"] == 10 for run in runs)
        (line,) = [line for line in part.splitlines() if line.startswith(name)]
        cells = line.strip("|").split("|")[2:]
        for cell, figure in zip(cells, ("path_ratio", "worst_path_ratio", "collisions"), strict=True):
            least, most = numbers(cell)
            assert_written(least, min(run[figure] for run in runs), cell)
            assert_written(most, max(run[figure] for run in runs), cell)
        for run in runs:
            rows = run["evaluation"]["targets"]
            assert run["collisions"] == pytest.approx(sum(row["collisions"] for row in rows) / len(rows))


def test_one_pose_beside_four_is_what_its_record_comes_to() -> None:
    arms = benchmark("quality_arms")
    records = arms["records_in"]([DOCS / "figures" / "history.json"])
    assert [one["learner"]["history_length"] for one in records] == [1, 4]
    part = EVIDENCE.partition("### What single parts bring")[2]
    for name, (*values, p, corrected) in arms["compared"](*records).items():
        (line,) = [line for line in part.splitlines() if line.startswith(f"| {name}")]
        *shown, told, told_of_both = line.replace(",", "").strip("| ").split("|")[1:]
        for cell, runs in zip(shown, values, strict=True):
            for number, value in zip(numbers(cell), (runs.mean(), runs.min(), runs.max()), strict=True):
                assert_written(number, value, cell)
        assert_written(told.strip(), p, line)
        assert_written(told_of_both.strip(), corrected, line)
        assert corrected < 0.05
    lines = [line.strip("| ").split(" | ") for line in part.splitlines()]
    (ratios,) = [cells[1:3] for cells in lines if cells[0].startswith("steps, x the shortest path (not asked)")]
    (met,) = [cells[1:3] for cells in lines if cells[0].startswith("all criteria met")]
    for record, ratio, count in zip(records, ratios, met, strict=True):
        runs = record["seeds"]
        for number, value in zip(
            numbers(ratio), [f([run["path_ratio"] for run in runs]) for f in (min, max)], strict=True
        ):
            assert_written(number, value, ratio)
        assert count == f"{sum(run['met']['all'] for run in runs)} of {len(runs)}"
    worst = max(run["worst_path_ratio"] for run in records[1]["seeds"])
    assert f"ends with a target {100 * (worst - 1):.1f} % above" in part
    fewest = [float(np.mean([run["collisions"] for run in record["seeds"]])) for record in records]
    assert "{:.4f} collisions an episode, not {:.4f}".format(*fewest) in RESULTS


@pytest.mark.parametrize("record", sorted((DOCS / "records").glob("*.tar.xz")), ids=lambda path: path.name)
def test_a_record_does_not_say_where_its_folder_lay(record: Path) -> None:
    with tarfile.open(record, "r:xz") as archive:
        settings = [member for member in archive if member.name.endswith(("run.json", "reproduction.json"))]
        assert len(settings) >= 2
        for member in settings:
            file = archive.extractfile(member)
            assert file is not None and not re.search(rb'(?:"| )/\w', file.read()), member.name


def check_the_agents_of_fresh_seeds(setting: Setting, rows: list[list[str]]) -> None:
    """What the pages say of each kind of agent: steps, collisions, and when its trainings settled."""
    world, mark = setting.world(), mark_steps(setting, setting.targets)
    scenes = world.target_scene.numpy()
    for group in table1.all_groups(setting):
        name = group.agent + group.learner.removeprefix("paper")
        ((_, *cells, lost),) = [row for row in rows if row[0] == name]
        scores, frames = group.scores(setting.out, world.target_count), frames_until_settled(setting.out, group, mark)
        estimates = [mean_estimate(scores.of(figure), scenes) for figure in ("steps", "collisions")]
        for cell, found in zip(cells, (*estimates, mean_estimate(frames[0], ONE_TARGET)), strict=True):
            mean, *ends = numbers(cell.replace(",", ""))
            assert_written(mean, found.value, cell)
            for written, end in zip(ends, numbers(found.ends.replace(",", "")), strict=True):
                assert_written(written, float(end), cell)
        assert lost == "0 of 25" and frames[1] == 5
    bumps = {
        group.agent: group.scores(setting.out, world.target_count).of("collisions").mean(1)
        for group in compared(setting, table1.REWARDS)
    }
    ends = [sorted(bumps[agent])[:: len(bumps[agent]) - 1] for agent in ("shortest", "collision-aware", "bump")]
    (short, aware, bump), page = ends, EVIDENCE.replace("\n", " ")
    worst = (
        f"has {short[1]:.3f} collisions under `shortest`, {aware[1]:.3f} under `collision-aware`, {bump[1]:.3f} under"
    )
    assert f"{worst} `bump`; the best {short[0]:.3f}, {aware[0]:.3f} and {bump[0]:.3f}." in page
    settled = {
        (group.learner, group.agent): frames_until_settled(setting.out, group, mark)[0]
        for group in table1.all_groups(setting)
    }
    early, late = settled["paper, unclipped", "shortest"], settled["paper", "collision-aware"]
    assert early.max() < late.min()
    assert f"settles sooner ({early.mean():,.0f} frames)" in RESULTS


@pytest.mark.slow
def test_the_papers_claims_of_fresh_seeds_are_what_their_record_comes_to(tmp_path: Path) -> None:
    unpack("paper-bathroom", tmp_path / "paper")
    sections = gather(tmp_path / "paper").sections
    assert [section.name for section in sections] == ["table1", "fig3", "fig4", "fig5"]
    page = section_of(EVIDENCE, "The paper's claims of fresh seeds")
    rows = rows_of(page)
    claims = [claim for section in sections for claim in section.claims]
    for claim in claims:
        text = claim.text.removeprefix("paper: ").removeprefix("paper, ")
        ((_, verdict, own, other, apart, p, corrected),) = [row for row in rows if row[0] == text]
        assert_judged(claim, verdict, p, corrected, own, other, apart)
    assert sum(row[1:2] in (["holds"], ["undecided"], ["does not hold"]) for row in rows) == len(claims) == 15
    check_the_agents_of_fresh_seeds(gather(tmp_path / "paper").setting, rows)
    solved = {
        row[1]
        for row in sections[0].tables[0].rows
        if row[0] == "steps" and row[3:5] == (5, "0 of 25") and f"{row[7]:.2f}" == "8.79"
    }
    assert not sections[0].missing and solved == {"q-learning", "bc", "planner on a learnt map", "nearest picture"}
    seconds = seconds_of_runs(tmp_path / "paper", "a2c-*")
    assert f"{round(min(seconds), -1):,.0f} to {round(max(seconds), -1):,.0f} s a run" in page
    asked = [claim for claim in claims if not claim.further]
    counts = [sum(claim.verdict == verdict for claim in asked) for verdict in ("holds", "does not hold", "undecided")]
    assert len(asked) == 11
    words = {2: "two", 4: "four", 5: "five"}
    holds, fails, open_ = (words[count] for count in counts)
    assert (
        f"Of eleven claims asked of fresh seeds, corrected by table, {holds} hold, {fails} do not, {open_} are"
        in RESULTS
    )


@pytest.mark.slow
def test_both_sets_together_and_time_in_the_zones_are_what_their_records_come_to(tmp_path: Path) -> None:
    both = benchmark("both_sets")
    folders = [tmp_path / name for name in ("paper", "zones")]
    for folder, record in zip(folders, ("paper-bathroom", "zones-or-step-bathroom"), strict=True):
        unpack(record, folder)
    sets = [both["figures"](folder) for folder in folders]
    part = EVIDENCE.partition("**Both sets together.**")[2].partition("\n```")[0]
    shown = rows_of(part)[1:]
    for (name, *cells, p), figure in zip(shown, both["FIGURES"], strict=True):
        scale = 100 if "percent" in name else 1
        for cell, own in zip(cells, sets, strict=True):
            for written, reward in zip(cell.split(", "), ("collision-aware", "shortest"), strict=True):
                assert_written(written.replace(",", ""), scale * own[reward][figure].mean(), name)
        assert_written(
            p, both["stratified_p"]([(s["collision-aware"][figure], s["shortest"][figure]) for s in sets]), name
        )

    (table,) = zone_time.section(gather(folders[0]).setting).tables
    part = section_of(EVIDENCE, "Time in the zones").partition("After 2 M frames")[2]
    names = {"11,600 frames": "planner on a learnt map"}
    told = 0
    for learner, agent, _, *figures in table.rows:
        begin = f"| {names.get(str(agent), agent)} |"
        (line,) = [line for line in part.splitlines() if line.startswith(begin)]
        for number, cell in zip((0, 2, 4), line.strip("|").split("|")[1:], strict=True):
            scale = 1 if number == 2 else 100
            mean, *ends = numbers(cell)
            assert_written(mean, scale * figures[number], line)
            for written, end in zip(ends, numbers(str(figures[number + 1])) if ends else (), strict=True):
                assert abs(float(written) - scale * float(end)) <= 0.0501 * (1 if scale == 100 else 0.1), line
        told += learner != "nearest picture"
    assert told == 5


def test_the_stratified_test_counts_every_way_to_deal_runs_out() -> None:
    both = benchmark("both_sets")
    apart, alike = (np.array([1.0, 2.0]), np.array([3.0, 4.0])), (np.array([1.0, 4.0]), np.array([2.0, 3.0]))
    assert both["stratified_p"]([apart, apart]) == 2 / 36  # all runs of both sets on their sides, or all changed
    assert both["stratified_p"]([alike, alike]) == 1.0
    assert both["stratified_p"]([apart, apart[::-1]]) == 1.0  # sets that contradict each other
