"""What the evidence says of agents on perturbed pictures is what the records come to."""

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clearway.evaluation.across_seeds import difference, permutation_p
from clearway.experiments import perturbed
from clearway.experiments.correction import LEVEL, holm
from clearway.experiments.job import trial_path
from clearway.experiments.perturbed import ALL, ALONE, HEADINGS, OWN, TOO
from clearway.experiments.plan import NEAREST, told_of
from clearway.experiments.reproduce import gather
from helpers.published import (
    DOCS,
    EVIDENCE,
    RESULTS,
    assert_judged,
    assert_shown,
    assert_written,
    numbers,
    rows_of,
    seconds_of_runs,
    section_of,
    unpack,
)
from helpers.report_tables import by_heading

PAGE = EVIDENCE.partition("\n## Perturbed pictures\n")[2].partition("\n## ")[0]
ASKED, EARLIER = (section_of(PAGE, title) for title in ("Ten seeds", "Seeds 0 to 4"))
KINDS = ("shortest", "bump", "collision-aware", "clearance")
SEEN = {"none": OWN, "geometry": "camera and furniture perturbed", "all": ALL}
LEARNING, SEEING = ((DOCS / name).read_text(encoding="utf-8") for name in ("learning.md", "seeing.md"))
FIGURES = ("success_4x", "spl", "collisions")
EARLIER_ROWS = [
    *(("reactive", 3, kind, seen) for kind in ("own", "perturbed") for seen in ("none", "geometry", "all")),
    *(("reactive-rewards", 5, kind, seen) for kind in KINDS for seen in ("none", "all")),
]
"""Of the earlier table: the record, its seeds, the runs' kind there and what they saw."""


@pytest.mark.slow
def test_perturbed_pictures_are_what_their_record_comes_to(tmp_path: Path) -> None:
    unpack("perturbed-bathroom", tmp_path / "runs")
    found = gather(tmp_path / "runs")
    (section,) = found.sections
    assert section.name == "perturbed" and not section.missing
    for job in perturbed.jobs(found.setting):
        for trial in job.trials:
            path = trial_path(found.setting.out, job.run, trial)
            about = json.loads(path.read_text(encoding="utf-8"))["about"]
            assert json.loads(json.dumps(told_of(job.run, trial))).items() <= about.items()
    agents, judged = (rows_of(part)[1:] for part in ASKED.split("\n\n") if part.startswith("| "))
    recorded = by_heading(section.tables[0])
    assert len(agents) == len(recorded) == 19
    for (seen, agent, trained_on, *cells), row in zip(agents, recorded, strict=True):
        assert seen == (row["seen on the way"] or "")
        assert agent == (f"nearest picture, {row['agent']}" if row["learner"] == NEAREST else row["agent"])
        assert trained_on == (row["trained on"] or "") and row["seeds"] in (10, None)
        assert row["success"] == 1 or (row["agent"] == "random walk" and f"{100 * row['success']:.1f} %" in ASKED)
        for cell, name, scale in zip(cells, HEADINGS[1:], (100, 100, 1), strict=True):
            assert_shown(cell, row[name], row[f"95 % of {name}"] or "", scale)
    assert [line[0] for line in judged] == [claim.text.removeprefix("default: ") for claim in section.claims]
    assert len(judged) == 6
    for claim, (_, verdict, own, other, apart, p, corrected) in zip(section.claims, judged, strict=True):
        assert_judged(claim, verdict, p, corrected, own, other, apart)
    means = {(row["agent"], row["trained on"], row["seen on the way"]): row for row in recorded}
    told = rows_of(LEARNING.partition("\n## Perturbed pictures\n")[2].partition("\n## ")[0])[1:]
    arms = ((own, seen) for own in (ALONE, TOO) for seen in (OWN, ALL))
    for (_, seen, spl, collisions), arm in zip(told, arms, strict=True):
        assert seen == arm[1]
        assert_written(spl.removesuffix(" %"), 100 * means["collision-aware", *arm]["SPL"], seen)
        assert_written(collisions, means["collision-aware", *arm]["collisions"], seen)
    check_sentences(means, recorded)
    check_times(tmp_path / "runs")
    seconds = seconds_of_runs(tmp_path / "runs")
    assert len(seconds) == 50 and f"{min(seconds):.0f} to {max(seconds):.0f} s of training a run" in ASKED


def check_sentences(means: Mapping[tuple[str, str, str], Mapping[str, Any]], rows: Sequence[Mapping[str, Any]]) -> None:
    """What pages say in words has the figures of the table."""
    collisions = {key: f"{row['collisions']:.3f}" for key, row in means.items() if row["collisions"] is not None}
    aware, alone = (collisions["collision-aware", own, ALL] for own in (TOO, ALONE))
    on_own = [collisions["collision-aware", own, OWN] for own in (TOO, ALONE)]
    bump, shortest = (collisions[agent, TOO, ALL] for agent in ("bump", "shortest"))
    (nearest,) = [row for row in rows if row["learner"] == NEAREST and row["seen on the way"] == ALL]
    close = f"{nearest['collisions']:.3f}"
    told = {
        ASKED: (
            f"`collision-aware` has fewer collisions ({aware}, not {alone})",
            f"on own pictures it has more then ({on_own[0]}, not {on_own[1]})",
            f"it has more collisions than `bump` ({bump}); whether fewer than `shortest` is undecided",
            f"where {str(nearest['agent']).removesuffix(' frames')} actions of random walkers led",
        ),
        RESULTS: (
            f"more collisions than `bump` ({aware} against {bump};",
            f"Not trained on such pictures it has {alone},",
        ),
        LEARNING: (
            f"`bump` has fewer collisions ({bump}) than `collision-aware`; whether `shortest` ({shortest}) has more is",
            f"The nearest-picture agent has {close} (nothing was asked of it)",
        ),
        SEEING: (
            "SPL {:.0f} % then, not {:.0f} %".format(
                *(100 * means["collision-aware", own, ALL]["SPL"] for own in (TOO, ALONE))
            ),
            f"and {float(aware):.2f} collisions, not {float(alone):.2f} ",
            f"has {100 * nearest['SPL']:.0f} % and {nearest['collisions']:.2f}.",
        ),
    }
    for page, sentences in told.items():
        for sentence in sentences:
            assert sentence in page
    trained = [row["collisions"] for row in rows if row["trained on"] and row["seen on the way"] == ALL]
    ends = (nearest["collisions"] / each(trained) for each in (max, min))
    assert "it has {:.2f} to {:.2f} times the trained agents' collisions".format(*ends) in ASKED


def check_times(folder: Path) -> None:
    """How much longer training on perturbed pictures takes."""
    seconds: dict[bool, list[float]] = {True: [], False: []}
    for run in folder.glob("runs/*/run.json"):
        took = json.loads((run.parent / "metrics.jsonl").read_text(encoding="utf-8").splitlines()[-1])["seconds"]
        seconds[json.loads(run.read_text(encoding="utf-8"))["takes"] is not None].append(took)
    assert {f"{took:.0f}" for took in seconds[False]} == {"8"} and "(8 on own pictures alone)" in ASKED
    assert f"takes {np.mean(seconds[True]) / np.mean(seconds[False]):.1f} times as long" in LEARNING


def test_earlier_agents_on_perturbed_pictures_are_what_their_records_come_to() -> None:
    agents, _ = (rows_of(part)[1:] for part in EARLIER.split("\n\n") if part.startswith("| "))
    for row, (record, seeds, kind, seen) in zip(agents, EARLIER_ROWS, strict=True):
        found = recorded(record)
        own = "own pictures alone" if kind == "own" else "perturbed pictures too"
        reward = kind if kind in KINDS else "collision-aware"
        assert row[:4] == [SEEN[seen], reward, own, f"0 to {seeds - 1}"]
        assert {run["reward"]["name"] for name, run in found["runs"].items() if name.startswith(kind)} == {reward}
        for cell, figure in zip(row[4:], FIGURES, strict=True):
            scale = 1 if figure == "collisions" else 100
            values = [scale * found["figures"][f"{kind}-{seed}"][seen][figure] for seed in range(seeds)]
            for number, value in zip(numbers(cell), (np.mean(values), min(values), max(values)), strict=True):
                assert_written(number, float(value), f"{figure} of {kind}, {seen}")
    records = (recorded("reactive"), recorded("reactive-rewards"))
    assert {run["frames"] for record in records for run in record["runs"].values()} == {300_000}
    for kind in ("own", "perturbed"):
        took = [records[0]["runs"][f"{kind}-{seed}"]["seconds"] for seed in range(3)]
        assert f"{min(took)} to {max(took)} s" in EARLIER


def test_earlier_figures_lie_outside_later_intervals_as_often_as_is_said() -> None:
    earlier, _ = (rows_of(part)[1:] for part in EARLIER.split("\n\n") if part.startswith("| "))
    later = {tuple(row[:3]): row[3:] for row in rows_of(ASKED) if len(row) == 6}
    below, above = [0, 0, 0], [0, 0, 0]
    for seen, agent, trained_on, _, *cells in earlier:
        for figure, (cell, other) in enumerate(zip(cells, later[seen, agent, trained_on], strict=True)):
            mean, (_, low, high) = float(numbers(cell)[0]), map(float, numbers(other))
            below[figure] += mean < low
            above[figure] += mean > high
    assert (below[1:], above[1:]) == ([1, 0], [2, 11])
    assert "Of these 14 means of collisions 11 lie above the intervals of ten seeds" in EARLIER
    assert "of SPL one lies below its interval, and two above." in EARLIER


def test_four_rewards_on_perturbed_pictures_are_judged_from_their_record() -> None:
    figures = recorded("reactive-rewards")["figures"]
    collisions = {
        kind: np.array([[figures[f"{kind}-{seed}"]["all"]["collisions"]] for seed in range(5)]) for kind in KINDS
    }
    _, judged = (rows_of(part)[1:] for part in EARLIER.split("\n\n") if part.startswith("| "))
    pairs = [re.fullmatch(r"(\S+) than (\S+)", line[0]).groups() for line in judged]
    assert pairs == [("collision-aware", "shortest"), ("collision-aware", "bump"), ("clearance", "shortest")]
    in_one_room = np.zeros(1, int)
    chances = holm([permutation_p(collisions[one], collisions[other], in_one_room) for one, other in pairs])
    for (one, other), (_, more, p), chance in zip(pairs, judged, chances, strict=True):
        fewer = difference(collisions[other], collisions[one], in_one_room)
        least, most = fewer.interval
        mean, low, high = re.fullmatch(r"(\S+) \((\S+) to (\S+)\)", more).groups()
        for written, value in zip((mean, low, high), (-fewer.value, -most, -least), strict=True):
            assert_written(written, float(value), more)
        assert p == f"{chance:.2g}" and chance > LEVEL


def recorded(name: str) -> dict:
    """A record of `docs/figures`."""
    return json.loads((DOCS / "figures" / f"{name}.json").read_text(encoding="utf-8"))
