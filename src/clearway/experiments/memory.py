"""What memory alone solves: a planner on steps that random walkers have seen, beside agents that learn to walk."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from clearway.experiments.groups import Group, Scores, all_jobs, compared, random_walk
from clearway.experiments.learnt_maps import (
    ABOUT_MAPS,
    FRAMES_A_POSE,
    PLANNER,
    Mapped,
    on_maps,
)
from clearway.experiments.other_learners import other_learners
from clearway.experiments.plan import RANDOM_WALK, Job
from clearway.experiments.section import Claim, ReportFigure, ReportTable, Section, Series
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import judged_less, with_failures
from clearway.reward import COLLISION_AWARE

METRICS = ("success", "steps", "collisions", "spl")


def jobs(setting: Setting) -> list[Job]:
    """What must be done: the main experiment's agents, and the yardsticks that are trained."""
    return all_jobs(_groups(setting))


def section(setting: Setting) -> Section:
    """What came of it."""
    groups, mapped = _groups(setting), list(on_maps(setting, setting.trial(), FRAMES_A_POSE))
    return Section(
        name="memory",
        title="What memory alone solves",
        text=(
            f"{ABOUT_MAPS} Beside them: tabular Q-learning, behaviour cloning from shortest paths, and agents that "
            "learn to walk."
        ),
        tables=(_table(setting, groups, mapped),),
        figures=(_curve(mapped),),
        claims=tuple(_claims(setting, groups, mapped)),
    )


def _groups(setting: Setting) -> list[Group]:
    return compared(setting, (COLLISION_AWARE,)) + other_learners(setting)


def _table(setting: Setting, groups: Sequence[Group], mapped: Sequence[Mapped]) -> ReportTable:
    world = setting.world()
    scenes = world.target_scene.numpy()
    found: list[tuple[str, str | None, int, Scores, str | None]] = []
    for own in mapped:
        exact = f"{min(own.exact):.1%} to {max(own.exact):.1%}" if own.agent == PLANNER else None
        found.append((own.agent, "map", own.frames, own.scores, exact))
    for group in groups:
        values = group.scores(setting.out, world.target_count)
        found.append((group.learner, group.agent, group.runs[0].learner.frames, values, None))
    found.append((RANDOM_WALK, None, 0, random_walk(world, setting.trial()), None))
    rows = tuple(
        (agent, reward, frames, len(own), own.failed(), *own.estimates(METRICS, scenes), exact)
        for agent, reward, frames, own, exact in found
    )
    headings = ("agent", "reward", "frames", "seeds", "failed targets")
    estimates = (heading for metric in METRICS for heading in (metric, f"95 % of {metric}"))
    notes = (
        "Shortest ways: share of starts from which the map's way to a target is a shortest path, least to most of the "
        "seeds; who is not told poses may take others.",
    )
    return ReportTable("memory", "Memory alone", (*headings, *estimates, "shortest ways"), rows, notes)


def _curve(mapped: Sequence[Mapped]) -> ReportFigure:
    """Share of shortest ways over frames."""
    own = [each for each in mapped if each.agent == PLANNER]
    low, high = ([end(each.exact) for each in own] for end in (min, max))
    line = Series(PLANNER, [each.frames for each in own], [float(np.mean(each.exact)) for each in own], low, high)
    labels = "frames of random walkers", "share of shortest ways"
    return ReportFigure("memory", "What a map holds", *labels, (line,), band="Band: smallest to largest of the seeds")


def _claims(setting: Setting, groups: Sequence[Group], mapped: Sequence[Mapped]) -> Iterator[Claim]:
    """Agents that learn to walk are better than the planner on the largest map: the paper does not ask."""
    world = setting.world()
    scenes = world.target_scene.numpy()
    planner = [each for each in mapped if each.agent == PLANNER][-1]
    theirs = planner.scores
    for group in groups:
        ours = group.scores(setting.out, world.target_count)
        text = f"{group.learner}: fewer steps than a {PLANNER} of {planner.frames:,} frames"
        claim = judged_less(text, "steps", ours.of("steps"), theirs.of("steps"), scenes)
        yield replace(with_failures(claim, ours.of("success"), theirs.of("success"), scenes), further=True)
