"""What the pages say of agents is what their records come to."""

import json
import re
import tarfile
from pathlib import Path

import numpy as np
import pytest

from clearway.experiments.convergence import mark_steps, settled_row
from clearway.experiments.reproduce import gather
from clearway.learn.run_folder import RunFolder
from helpers.published import (
    DOCS,
    EVIDENCE,
    RESULTS,
    assert_written,
    benchmark,
    numbers,
    rows_of,
    section_of,
    unpack,
)
from helpers.report_tables import by_heading


def test_a_figure_that_differs_in_its_last_digit_is_seen() -> None:
    assert_written("93.3", 93.34, "near")
    with pytest.raises(AssertionError, match=r"written 93\.3, recorded 93\.36"):
        assert_written("93.3", 93.36, "far")


def test_the_page_names_every_record_and_how_many_runs_it_holds() -> None:
    table = rows_of(EVIDENCE.partition("## Records\n")[2].partition("\n## ")[0])[1:]
    told = [
        (name.strip("`"), int(count))
        for names, counts, _ in table
        for name, count in zip(names.split(", "), counts.split(", "), strict=True)
    ]
    found = {}
    for path in (DOCS / "records").glob("*.tar.xz"):
        with tarfile.open(path) as members:
            found[path.name.partition(".")[0]] = sum(name.endswith("/run.json") for name in members.getnames())
    assert found.pop("four-rooms") == 0 and "`four-rooms` holds the rooms" in EVIDENCE
    assert len(told) == len(found) and dict(told) == found


@pytest.mark.slow
def test_what_memory_solves_is_what_its_record_comes_to(tmp_path: Path) -> None:
    unpack("memory-bathroom", tmp_path / "memory")
    found = gather(tmp_path / "memory")
    (section,) = found.sections
    assert not section.missing
    (table,) = section.tables
    rows = by_heading(table)
    lines = RESULTS.splitlines()
    told = [line.strip("|").split("|") for line in lines if line.startswith("| planner on a learnt map")]
    assert len(told) == 1
    for label, agents in (("default recipe | 3,", ["default"]), ("Q-learning, behaviour", ["q-learning", "bc"])):
        for line in lines:
            if line.startswith(f"| {label}"):
                told += [[agent, *line.strip("|").split("|")[1:]] for agent in agents]
    assert len(told) == 4
    for agent, frames, steps, collisions in told:
        count = int(numbers(frames.replace(",", ""))[0])
        (row,) = [row for row in rows if row["agent"] == agent.strip() and row["frames"] == count]
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
    mark = mark_steps(found.setting, found.setting.targets)
    runs = [RunFolder(path) for path in (tmp_path / "memory" / "runs").glob("ppo-*")]
    settled = [settled_row(run.metrics(), mark)["frames"] for run in runs]
    after = f"{round(np.mean(settled), -3):,.0f}"
    assert len(settled) == 5 and f"recipe settled after {after} frames on average" in EVIDENCE
    assert f"| default recipe | 3,000,000 (settled: {after}) |" in RESULTS
    verdicts = {claim.text.partition(":")[0]: claim.verdict for claim in section.claims}
    assert verdicts == {"default": "does not hold", "q-learning": "undecided", "bc": "undecided"}


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
        kinds = [("average", agent) for agent in ("shortest", "collision-aware")] if name == "fig5" else [("5",)]
        assert {round(100 * float(found[kind]["SPL"])) for kind in kinds} == {97}
    assert "(bathroom, SPL 97 %)" in RESULTS


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
    columns = [[run[name] for run in runs] for name in ("path_ratio", "worst_path_ratio", "collisions")]
    (line,) = [line for line in RESULTS.splitlines() if "three times four" in line]
    for cell, values in zip(line.strip("|").split("|")[1:], columns, strict=True):
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


def test_the_default_of_seeds_5_to_9_is_as_good_as_its_record_says() -> None:
    _, record = json.loads((DOCS / "figures" / "history.json").read_text(encoding="utf-8"))
    runs = record["seeds"]
    assert [run["seed"] for run in runs] == [5, 6, 7, 8, 9] and record["learner"]["history_length"] == 4
    ((_, *cells),) = [row for row in rows_of(RESULTS) if row[0] == "four rooms, seeds 5 to 9"]
    for cell, name in zip(cells, ("path_ratio", "worst_path_ratio", "collisions"), strict=True):
        for end, value in zip(numbers(cell), (f(run[name] for run in runs) for f in (min, max)), strict=True):
            assert_written(end, value, name)
    solved, met = (
        sorted(run["first_met"][name]["seconds"] for run in runs if run["first_met"][name])
        for name in ("solved_targets", "all")
    )
    assert len(met) == 4 and sum(second <= 300 for second in met) == 3
    told = f"Of [seeds 5 to 9](evidence.md#what-single-parts-bring) four do, three in time (after {met[0]:.0f} to"
    assert f"{told} {met[-1]:.0f} s):" in RESULTS
    performance = (DOCS / "performance.md").read_text(encoding="utf-8")
    assert f"| {solved[0]:.0f} to {solved[-1]:.0f} s, five seeds |" in performance


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
        members = archive.getmembers()
        settings = [member for member in members if member.name.endswith(("run.json", "reproduction.json"))]
        assert len(settings) >= 2 or all(member.name.endswith(".h5") for member in members)  # rooms alone
        for member in settings:
            file = archive.extractfile(member)
            assert file is not None and not re.search(rb'(?:"| )/\w', file.read()), member.name


@pytest.mark.slow
def test_how_far_intervals_can_be_trusted_is_what_the_benchmark_gives() -> None:
    page = (DOCS / "reproduction.md").read_text(encoding="utf-8")
    found = benchmark("coverage")
    shown = {name: cells for name, *cells in rows_of(page.partition("| scores of runs |")[2].partition("\n\n")[0])}
    for name, draw in found["DRAWS"].items():
        told = shown[name.replace(" sd ", " standard deviations ")]
        exact = (*found["shares"](draw, 5, 2_000), *found["beside_a_narrow_kind"](draw, 5, 2_000))
        for cell, share in zip(told, exact, strict=True):
            assert cell == f"{100 * share:.0f} %", name
    for correlation, words in (
        (0.5, "are told apart in {:.1f} % at a correlation of 0.5"),
        (-0.5, "more ({:.1f} % at -0.5)"),
    ):
        share = found["size_of_same_runs"](correlation, 5, 2_000)
        assert words.format(100 * share) in page.replace("\n", " ")
