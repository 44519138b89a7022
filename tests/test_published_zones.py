"""What the pages say of zones, and of time in them, is what their records come to."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from clearway.experiments import shuffles, step_size, table1, zone_time, zones_or_step
from clearway.experiments.convergence import frames_until_settled, mark_steps
from clearway.experiments.groups import compared
from clearway.experiments.reproduce import gather
from clearway.experiments.section import ReportTable, Section
from clearway.experiments.setting import Setting
from helpers.published import (
    EVIDENCE,
    RESULTS,
    assert_judged,
    assert_shown,
    assert_written,
    benchmark,
    check_arms,
    check_beside,
    ends_of,
    numbers,
    rows_of,
    seconds_of_runs,
    section_of,
    unpack,
)
from helpers.report_tables import by_heading

MAPS = {"planner on a learnt map", "nearest picture"}
AGENTS = r"collision-aware|dearer|shuffled|shortest"


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
    rows = {row["agent"]: row for row in by_heading(table)}
    told = {
        "shortest": "| shortest | 812",
        "dearer": "| steps as dear as zones",
        "shuffled": "| zones of shuffled",
        "collision-aware": "| collision-aware | 460",
    }
    lines = RESULTS.splitlines()
    for agent, begin in told.items():
        (line,) = [line for line in lines if line.startswith(begin)]
        _, cell, *_ = line.strip("|").split("|")
        mean, *interval, settled = numbers(cell.removesuffix(" of 5 ").replace(",", ""))
        assert_written(mean, rows[agent]["frames"], agent)
        assert interval == numbers(str(rows[agent]["95 %"]).replace(",", ""))
        assert int(settled) == rows[agent]["settled"]
    evidence = section_of(EVIDENCE, "Zones, or a larger step?")
    seconds = [
        json.loads(path.read_text().splitlines()[-1])["seconds"]
        for path in (tmp_path / "zones").glob("runs/*/metrics.jsonl")
        if json.loads((path.parent / "run.json").read_text())["zone_level"] == "pose"
    ]
    assert f"{min(seconds):.0f} to {round(max(seconds), -1):,.0f} s a run" in evidence
    table = section.tables[0]
    for row in by_heading(table):
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
    check_sooner(section, evidence)
    verdicts = [claim.verdict for claim in section.claims]
    assert verdicts == ["holds", "holds", "undecided", "undecided", "undecided"]


def check_sooner(section: Section, evidence: str) -> None:
    """What the page says of who settles sooner than whom: a row a claim."""
    claims = {" than ".join(re.findall(AGENTS, claim.text)): claim for claim in section.claims[1:]}
    claims["collision-aware than shortest"] = section.claims[0]
    assert len(claims) == 5
    for name, claim in claims.items():
        (line,) = [line for line in evidence.splitlines() if line.startswith(f"| {name} |")]
        _, difference, p, corrected, verdict = (cell.strip() for cell in line.strip("|").split("|"))
        mean, low, high = (float(end.replace(",", "")) for end in re.findall(r"-?\d[\d,]*", difference))
        found = claim.numbers["difference"]
        for written, value in zip((mean, low, high), (found.value, *found.interval), strict=True):
            assert abs(written - value) <= 500
        assert f"p = {p}, for 5 claims {corrected} (Holm)" in claim.evidence
        assert verdict == claim.verdict


@pytest.mark.slow
def test_zones_or_a_larger_step_in_four_rooms_is_what_its_record_comes_to(tmp_path: Path) -> None:
    folder = tmp_path / "four"
    unpack("four-rooms", folder, "four-rooms-default", "four-rooms-zones")
    (section,) = gather(folder).sections
    assert not section.missing and {claim.verdict for claim in section.claims} == {"undecided"}
    part = section_of(EVIDENCE, "In four rooms: zones")
    check_sooner(section, part)
    lines, table = rows_of(part), section.tables[0]
    found = {(row["figure"], row["agent"]): row for row in by_heading(table) if row["learner"] == "default"}
    settled = by_heading(section.tables[-1])
    assert {row["agent"] for row in settled} == {"shortest", "collision-aware", "dearer", "shuffled"}
    for row in settled:
        ((_, after, steps, collisions, failed),) = [line for line in lines if line[0] == row["agent"]]
        after, ran = after.split("), ")
        assert_shown(after, row["frames"], row["95 %"])
        assert ran == f"{row['settled']} of 5" and failed == found["steps", row["agent"]]["failed targets"]
        for cell, figure in ((steps, "steps"), (collisions, "collisions")):
            own = found[figure, row["agent"]]
            assert_shown(cell, own["average"], own["95 %"])
    frames = [row["frames"] for row in settled]
    assert max(frames) / min(frames) < 1.03
    ends = [abs(end) for claim in section.claims for end in claim.numbers["difference"].interval]
    least, most = (100 * end / np.mean(frames) for end in (min(ends), max(ends)))
    assert f"reach from {least:.0f} to {most:.0f} % to a side" in part
    assert check_beside(lines, table.rows, 2, 3) == MAPS | {"shortest path", "random walk"}
    cost = -zones_or_step.mean_cost(gather(folder).setting)
    assert f"every step costs {cost:.6f}" in part
    seconds = [s for reward in ("dearer", "shuffled") for s in seconds_of_runs(folder, f"ppo-{reward}-*")]
    assert len(seconds) == 10 and f"{min(seconds):.0f} to {max(seconds):.0f} s a run" in part


@pytest.mark.slow
def test_zones_at_several_step_sizes_are_what_their_record_comes_to(tmp_path: Path) -> None:
    unpack("step-size-bathroom", tmp_path / "steps")
    (section,) = gather(tmp_path / "steps").sections
    assert not section.missing
    part = section_of(EVIDENCE, "Zones, at several step sizes")
    lines = rows_of(part)
    table, late = section.tables[0], section.tables[-1]
    rows = by_heading(table)
    assert len(late.rows) == 2 * len(step_size.ALL)
    check_arms(lines, table, late, {f"paper, {step}": str(step) for step in step_size.ALL})
    assert check_beside(lines, table.rows, 3, 4) == {"planner on a learnt map", "nearest picture", "random walk"}
    told = {line[0]: line[1:] for line in lines if len(line) == 7}
    assert len(told) == 1 + len(section.claims)  # with the heading
    for claim in section.claims:
        verdict, own, other, difference, p, corrected = told[claim.text.removeprefix("paper: ")]
        assert_judged(claim, verdict, p, corrected, own, other, difference)
    setting = gather(tmp_path / "steps").setting
    mark = mark_steps(setting, setting.targets)
    settled = {
        (group.learner, group.agent): frames_until_settled(setting.out, group, mark)[0]
        for group in step_size._groups(setting)
    }
    largest, published = (
        ("paper, 4 x rate, whitened", "shortest"),
        ("paper, 1 x rate, features as they are", "collision-aware"),
    )
    assert settled[largest].max() < settled[published].min()
    first, second = (f"{settled[kind].mean():,.0f}" for kind in (largest, published))
    both = rf"`shortest` [^.]*after {first} frames[^.]*`collision-aware` as published[^.]*{second}"
    assert re.search(both, part)
    bumps = {(r["learner"], r["agent"]): r["average"] for r in rows if r["figure"] == "collisions"}
    ended = [str(step) for step in step_size.ALL if step.rate >= 1]
    assert len(ended) == 6
    assert all(bumps[f"paper, {step}", "collision-aware"] < bumps[f"paper, {step}", "shortest"] for step in ended)
    assert all((settled[kind] == setting.budget.frames).all() for kind in settled if "0.5 x" in kind[0])
    seconds = seconds_of_runs(tmp_path / "steps")
    assert len(seconds) == 80 and f"{min(seconds):.0f} to {max(seconds):.0f} s a run" in part


def check_results_of_shuffles(table: ReportTable, late: ReportTable) -> None:
    """The right half of a table of the results."""
    lines = rows_of(section_of(RESULTS, "Zones, or a larger step?"))
    names = {"own shuffle": "zones of shuffled poses"}
    for row in by_heading(late):
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
    groups = {group.agent: group for group in (*shuffles._groups(setting), *compared(setting, table1.TABLE_1_REWARDS))}
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
    arrived = scores["bump"].of("success")
    told = f"fails {(arrived < 1).sum()} of 40 targets ({100 * arrived.mean():.2f} % of its episodes arrive) and has "
    told += f"{bumps['bump'].mean():.2f} collisions, `shortest` {bumps['shortest'].mean():.2f}, `collision-aware` "
    assert f"{told}{aware.mean():.3f};" in time_in.replace("\n", " ")
    assert sum(map(len, others)) == 9
    assert min(each.min() for each in others) > own.max()


@pytest.mark.slow
def test_zones_shuffled_anew_and_time_in_the_zones_are_what_their_record_comes_to(tmp_path: Path) -> None:
    unpack("shuffles-bathroom", tmp_path / "shuffles")
    shuffled, zones = gather(tmp_path / "shuffles").sections
    assert not shuffled.missing and not zones.missing
    part = section_of(EVIDENCE, "Zones shuffled anew")
    lines = rows_of(part)
    table, late = shuffled.tables[0], shuffled.tables[-1]
    for row in by_heading(late):
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
    beside = check_beside(lines, table.rows, 2, 3)
    assert beside == {"planner on a learnt map", "nearest picture", "random walk"}
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
            for cell, value in zip(cells[:4], (100 * share, visits, 100 * near, steps), strict=True):
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
