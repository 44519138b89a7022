"""What the pages say of clipped rewards and of the weight of entropy is what their records come to."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clearway.experiments import clipping
from clearway.experiments.convergence import mark_steps, settled_by_seed
from clearway.experiments.job import run_folder
from clearway.experiments.reproduce import gather
from clearway.experiments.setting import Setting
from clearway.experiments.table1 import UNCLIPPED
from helpers.published import (
    DOCS,
    EVIDENCE,
    RESULTS,
    assert_judged,
    assert_written,
    check_arms,
    check_beside,
    ends_of,
    numbers,
    rows_of,
    seconds_of_runs,
    section_of,
    unpack,
    words_of,
)
from helpers.report_tables import by_heading

LEARNERS = {"as published": "paper", **{name: f"paper, {name}" for name in (UNCLIPPED, clipping.AT_A_TENTH)}}
LEARNERS[clipping.LESS_ENTROPY] = f"paper, {clipping.LESS_ENTROPY}"
PAGE = section_of(EVIDENCE, "Clipped rewards, or the weight of entropy")


def at_half(setting: Setting, kind: tuple[str, str]) -> list[dict[str, float]]:
    """Of each run the last metrics of the first half in which episodes ended."""
    (group,) = (own for own in clipping._groups(setting) if (own.learner, own.agent) == kind)
    rows = [run_folder(setting.out, run).metrics() for run in group.runs]
    half = setting.budget.frames / 2
    return [[row for row in own if row["frames"] <= half and row["episodes"]][-1] for own in rows]


def check_single_runs(setting: Setting) -> None:
    """What the page says of runs one by one."""
    world, mark = setting.world(), mark_steps(setting, setting.targets)
    bumps, settled, to_48 = {}, {}, {}
    for group in clipping._groups(setting):
        kind = group.learner, group.agent
        scores = group.scores(setting.out, world.target_count)
        bumps[kind] = dict(zip(scores.seeds, scores.of("collisions").mean(1), strict=True))
        settled[kind] = settled_by_seed(setting.out, group, mark)
        to_48[kind] = dict(zip(scores.seeds, scores.of("steps")[:, 0], strict=True))
    assert setting.targets[0][0] == 48
    less, tenth = LEARNERS[clipping.LESS_ENTROPY], LEARNERS[clipping.AT_A_TENTH]
    aware, short = (less, "collision-aware"), (less, "shortest")
    assert [(kind, seed) for kind, own in settled.items() for seed, (_, has) in own.items() if not has] == [(aware, 8)]
    others = [value for seed, value in bumps[aware].items() if seed != 8]
    others_of_less = others
    told = (
        f"it goes to pose 48 in {to_48[aware][8]:,.0f} steps, and has {bumps[aware][8]:.2f} collisions; the four "
        f"others have at most {max(others):.3f}, the five of `shortest` {min(bumps[short].values()):.3f} to "
        f"{max(bumps[short].values()):.3f}."
    )
    assert told in PAGE
    late = [frames for kind, own in settled.items() if kind[0] == tenth for frames, _ in own.values()]
    soon = [frames for kind, own in settled.items() if kind[0] != tenth for frames, has in own.values() if has]
    halfway = {kind: [own["steps"] for own in at_half(setting, kind)] for kind in settled}
    at_tenth = [steps for kind, own in halfway.items() if kind[0] == tenth for steps in own]
    others = sorted(steps for kind, own in halfway.items() if kind[0] != tenth for steps in own)
    told = f"Halfway they take {min(at_tenth):.0f} to {max(at_tenth):.0f} steps an episode in training, all others but "
    assert f"{told}one at most {others[-2]:.1f};" in PAGE and others[-1] > 1_000
    apart = [np.mean([*bumps[tenth, reward].values()]) for reward in ("shortest", "collision-aware")]
    assert f"here {apart[0] - apart[1]:.3f}: part of it" in PAGE
    assert f"nine runs of ten\nhave few (at most {max(*others_of_less, *bumps[short].values()):.3f})" in PAGE
    words = rf"settles after {min(late) / 1e6:.2f} M frames or later, .*\nvariants but that one after (\S+) M or sooner"
    assert words_of(words, PAGE)[1] == f"{max(soon) / 1e6:.2f}"


@pytest.mark.slow
def test_clipping_and_less_entropy_are_what_their_records_come_to(tmp_path: Path) -> None:
    unpack("paper-bathroom", tmp_path / "both", "clipping-bathroom")
    found = gather(tmp_path / "both")
    (section,) = found.sections
    assert section.name == clipping.NAME and not section.missing
    lines = rows_of(PAGE)
    table, _, late, rest = section.tables
    own = {(row["figure"], row["learner"], row["agent"]): row for row in by_heading(table)}
    resting = {(row["learner"], row["agent"]): row for row in by_heading(rest)}
    shown = [line for line in lines if line[0] in LEARNERS and line[1] in ("shortest", "collision-aware")]
    assert len(shown) == len(late.rows) == len(resting) == 8
    check_arms(lines, table, late, {learner: name for name, learner in LEARNERS.items()})
    tenth = [resting[LEARNERS[clipping.AT_A_TENTH], agent]["collisions"] for agent in ("shortest", "collision-aware")]
    learning = (DOCS / "learning.md").read_text(encoding="utf-8")
    assert f"those multiplied by a tenth instead {tenth[0]:.3f} and {tenth[1]:.3f}." in learning
    assert f"({tenth[0]:.3f}). There the two rewards lie {tenth[0] - tenth[1]:.3f} collisions apart" in PAGE
    for name, agent, *_, ends in shown:
        learner = LEARNERS[name]
        for figure, written in zip(("steps", "collisions"), numbers(ends), strict=True):
            assert_written(written, resting[learner, agent][figure], f"{name}, {agent}")
            assert written != "0" or resting[learner, agent][figure] < 5e-4
    told = {line[0]: line[1:] for line in lines if len(line) == 7 and line[1] in ("holds", "undecided")}
    assert len(told) == len(section.claims) == 6
    for claim in section.claims:
        verdict, ours, theirs, difference, p, corrected = told[claim.text.removeprefix("paper: ")]
        assert_judged(claim, verdict, p, corrected, ours, theirs, difference)
    beside = check_beside(lines, table.rows, 3, 4)
    assert beside == {"planner on a learnt map", "nearest picture", "shortest path", "random walk"}
    check_single_runs(found.setting)
    unpack("clipping-bathroom", tmp_path / "new")
    seconds = seconds_of_runs(tmp_path / "new")
    assert len(seconds) == 20 and f"{min(seconds):.0f} to {max(seconds):.0f} s a run" in PAGE
    check_results({claim.text: claim.verdict for claim in section.claims}, own)


def check_results(verdicts: Mapping[str, str], own: Mapping[tuple[str, str, str], dict[str, Any]]) -> None:
    """Their sentence, and what carries it."""
    less, tenth = clipping.LESS_ENTROPY, clipping.AT_A_TENTH
    assert [
        verdicts[f"paper: shortest {claim}"]
        for claim in (f"with {less} has fewer collisions than as it is", f"as it is has fewer collisions than {tenth}")
    ] == ["holds"] * 2
    aware = [verdict for claim, verdict in verdicts.items() if "collision-aware has" in claim]
    assert aware == ["holds"] * 2 + ["undecided"] * 2
    words = (
        r"worth beside rewards\*\*: (\S+) \((\S+)\), as published (\S+), with less entropy (\S+) \((\S+)\)\. "
        r"Multiplied \(not converged\) `collision-aware` has fewer, (\S+) \((\S+)\), in no more steps; "
        "with less entropy: undecided"
    )
    cells = words_of(words, RESULTS).groups()
    kinds = [
        LEARNERS[tenth],
        LEARNERS[tenth],
        "paper",
        LEARNERS[less],
        LEARNERS[less],
        LEARNERS[tenth],
        LEARNERS[tenth],
    ]
    for place, (cell, learner) in enumerate(zip(cells, kinds, strict=True)):
        row = own["collisions", learner, "shortest" if place < 5 else "collision-aware"]
        if "-" in cell:
            assert [float(end) for end in numbers(cell)] == pytest.approx(ends_of(row["95 %"]), abs=5.1e-4), cell
        else:
            assert_written(cell, row["average"], cell)
