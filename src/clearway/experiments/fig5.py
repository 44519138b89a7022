"""Figure 5: agents trained on the paper's targets, tried on unseen ones 1, 2, 4 and 8 steps away from these."""

from __future__ import annotations

import numpy as np

from clearway.experiments import generalisation
from clearway.experiments.groups import PAIR, RANDOM_WALK, Group, all_jobs, all_missing, compared, random_walk
from clearway.experiments.paper_numbers import FIGURE_5_AVERAGE_SC
from clearway.experiments.plan import Job, TargetSets
from clearway.experiments.section import ReportFigure, ReportTable, Section, Series, Value
from clearway.experiments.setting import Setting
from clearway.scenes.scene import Scene

DISTANCES = (1, 2, 4, 8)


def jobs(setting: Setting) -> list[Job]:
    """What must be done: the main experiment's agents, tried on other targets."""
    return [job for steps in DISTANCES for job in all_jobs(_groups(setting, steps))]


def section(setting: Setting) -> Section:
    """What came of it."""
    rows: list[tuple[Value, ...]] = []
    points: dict[str, list] = {}
    missing: dict[str, None] = {}
    for steps in DISTANCES:
        groups = _groups(setting, steps)
        world = setting.world(groups[0].trial.targets)
        walked = random_walk(world, groups[0].trial)
        found = [(f"{g.learner}, {g.agent}", g, g.scores(setting.out, world.target_count)) for g in groups]
        for label, group, values in found:
            rows.append((steps, group.learner, group.agent, len(values), *generalisation.cells(values, world)))
            points.setdefault(label, []).append((steps, values, world))
        rows.append((steps, None, RANDOM_WALK, None, *generalisation.cells(walked, world)))
        points.setdefault(RANDOM_WALK, []).append((steps, walked, world))
        missing.update(dict.fromkeys(all_missing(groups, setting.out)))
    lines = [generalisation.line(label, own) for label, own in points.items()]
    headings = ("steps away", "learner", "agent", "seeds", *generalisation.HEADINGS)
    of_paper = ", ".join(f"{name} {100 * value:.1f} %" for name, value in FIGURE_5_AVERAGE_SC.items())
    notes = (
        generalisation.NOTE,
        f"The paper's averages over all four distances, other scenes and features: {of_paper}.",
    )
    return Section(
        name="fig5",
        title="Unseen targets near the trained ones (the paper's figure 5)",
        text="For every trained target an unseen one at exactly so many steps, drawn with a fixed seed.",
        tables=(ReportTable("fig5", "Success on unseen targets", headings, tuple(rows), notes),),
        figures=(
            ReportFigure("fig5", "Unseen targets", "steps from the trained target", "success score", _known(lines)),
        ),
        missing=tuple(missing),
    )


def _known(lines: list[Series | None]) -> tuple[Series, ...]:
    return tuple(line for line in lines if line is not None)


def _groups(setting: Setting, steps: int) -> list[Group]:
    return compared(setting, PAIR, tried_on=unseen_targets(setting, steps))


def unseen_targets(setting: Setting, steps: int) -> TargetSets:
    """For each trained target one that is not, so many steps away."""
    return tuple(_unseen(scene, own, steps) for scene, own in zip(setting.scenes, setting.targets, strict=True))


def _unseen(scene: Scene, trained: tuple[int, ...], steps: int) -> tuple[int, ...]:
    rng = np.random.default_rng([steps, scene.state_count])
    chosen: list[int] = []
    for distance in scene.distances_to(np.array(trained)):
        free = np.setdiff1d(np.flatnonzero(distance == steps), [*trained, *chosen])
        if len(free):
            chosen.append(int(rng.choice(free)))
    return tuple(sorted(chosen))
