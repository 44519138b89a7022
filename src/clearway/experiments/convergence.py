"""When training has settled: from then on nearly all episodes arrive, and take at most twice the shortest path.

A curve says it better than a figure, but curves have no interval. The mark is twice the mean shortest path of the
targets from all starts, so it depends on scenes and targets alone. Steps alone would not do: a learner that cuts
episodes after 40 steps lies near the mark from the start. A run that has not settled by its end counts with
all its frames; so does one whose agent then misses a target, since training's means are over episodes that ended, of
which a lost target has few: A3C, whose workers keep theirs, looks settled with one of five lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from clearway.evaluation.across_seeds import mean_estimate
from clearway.experiments.groups import Group
from clearway.experiments.job import episodes_of, run_folder
from clearway.experiments.plan import TargetSets
from clearway.experiments.section import Claim, ReportTable, Value
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import judged_less
from clearway.reward import COLLISION_AWARE, SHORTEST

DETOUR = 2.0
ARRIVING = 0.95
"""Least share of the episodes that ended at their target; the others were cut."""
ONE_TARGET = np.zeros(1, dtype=np.int64)  # a run has one figure, as if of one target

Row = dict[str, float]


def mark_steps(setting: Setting, targets: TargetSets) -> float:
    """Twice the mean steps of the shortest paths, over scenes, their targets and all starts."""
    means = []
    for scene, own in zip(setting.scenes, targets, strict=True):
        steps = scene.distances_to(np.array(own)).astype(np.float64)
        means.append(np.nanmean(np.where(steps > 0, steps, np.nan), axis=1).mean())
    return DETOUR * float(np.mean(means))


def settled_row(rows: Sequence[Row], mark: float) -> Row | None:
    """The first row of a training's metrics from which on steps stay at the mark or below, and `ARRIVING` arrive.

    None: there is none, or only the last, which a few lucky episodes may make.
    """
    known = [row for row in rows if row["episodes"]]
    before = [number for number, row in enumerate(known) if row["steps"] > mark or row["success"] < ARRIVING]
    first = before[-1] + 1 if before else 0
    return known[first] if first < len(known) - 1 else None


def settling(name: str, setting: Setting, groups: Sequence[Group], where: str = "") -> tuple[ReportTable, list[Claim]]:
    """How long each group trains until it has settled, and whether the collision-aware reward settles sooner.

    Args:
        name: of the experiment.
        setting: see there.
        groups: of any learners and rewards, all trained on the same targets.
        where: behind each claim, for example " on hard targets".
    """
    found = _until_settled(setting, groups)
    claims = []
    for learner in dict.fromkeys(group.learner for group in groups):
        ours, baseline = (found[learner, reward.name][0] for reward in (COLLISION_AWARE, SHORTEST))
        text = f"{learner}: learns faster (fewer frames until training has settled){where}"
        claims.append(judged_less(text, "frames until settled", ours, baseline, ONE_TARGET))
    return settling_table(name, setting, groups), claims


def settling_table(name: str, setting: Setting, groups: Sequence[Group]) -> ReportTable:
    """How long each group trains until it has settled; arguments as of `settling`."""
    rows: list[tuple[Value, ...]] = []
    for (learner, agent), (frames, settled) in _until_settled(setting, groups).items():
        estimate = mean_estimate(frames, ONE_TARGET) if len(frames) else None
        values = (None, None) if estimate is None else (estimate.value, estimate.ends)
        rows.append((learner, agent, len(frames), settled, *values))
    headings = ("learner", "agent", "seeds", "settled", "frames", "95 %")
    mark = mark_steps(setting, groups[0].trial.targets)
    note = (
        f"Frames from which on {ARRIVING:.0%} of training episodes reach their target, and all take at most {mark:.3g} "
        f"steps on average, {DETOUR:g} times the shortest paths'. A run that never gets there, or fails a target in "
        "the end, counts with all its frames; one whose metrics.jsonl was removed does not count."
    )
    return ReportTable(f"{name}_settled", "Frames until training has settled", headings, tuple(rows), (note,))


def frames_until_settled(out: Path, group: Group, mark: float) -> tuple[np.ndarray, int]:
    """Frames until each complete run of a group whose metrics are there had settled (R, 1), and how many have."""
    found = settled_by_seed(out, group, mark).values()
    frames = np.array([frames for frames, _ in found], dtype=np.float64)
    return frames.reshape(-1, 1), sum(settled for _, settled in found)


def settled_by_seed(out: Path, group: Group, mark: float) -> dict[int, tuple[float, bool]]:
    """Frames until each such run had settled, by its seed, and whether it has: one that has not counts with all."""
    found: dict[int, tuple[float, bool]] = {}
    for run in group.runs:
        table, metrics = episodes_of(out, run, group.trial), run_folder(out, run).metrics()
        if table is None or not metrics:
            continue
        row = settled_row(metrics, mark) if table.reached.all() else None
        found[run.seed] = (float(run.learner.frames), False) if row is None else (row["frames"], True)
    return found


def _until_settled(setting: Setting, groups: Sequence[Group]) -> dict[tuple[str, str], tuple[np.ndarray, int]]:
    """`frames_until_settled` by learner and agent."""
    mark = mark_steps(setting, groups[0].trial.targets)
    return {(group.learner, group.agent): frames_until_settled(setting.out, group, mark) for group in groups}
