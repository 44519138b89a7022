"""Figure 5: agents trained on the paper's targets, tried on unseen ones 1, 2, 4 and 8 steps away from these."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from clearway.experiments.generalisation import HEADINGS, NOTE, Tried, line, together, tried
from clearway.experiments.groups import PAIR, RANDOM_WALK, Group, Scores, all_jobs, all_missing, random_walk
from clearway.experiments.paper_numbers import FIGURE_5_AVERAGE_SC
from clearway.experiments.plan import Job, TargetSets
from clearway.experiments.section import Claim, ReportFigure, ReportTable, Section, Series, Value
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import judged_more
from clearway.reward import COLLISION_AWARE, SHORTEST
from clearway.scenes.scene import Scene

DISTANCES = (1, 2, 4, 8)
AVERAGE = "average"


def jobs(setting: Setting) -> list[Job]:
    """What must be done: the main experiment's agents, tried on other targets."""
    return [job for steps in DISTANCES for job in all_jobs(_groups(setting, steps))]


def section(setting: Setting) -> Section:
    """What came of it."""
    rows: list[tuple[Value, ...]] = []
    kinds: dict[tuple[str | None, str], list[Tried]] = {}
    missing: dict[str, None] = {}
    for steps in DISTANCES:
        groups = _groups(setting, steps)
        world = setting.world(groups[0].trial.targets)
        target_scene = world.target_scene.numpy()
        found: dict[tuple[str | None, str], Scores] = {
            (group.learner, group.agent): group.scores(setting.out, world.target_count) for group in groups
        }
        found[None, RANDOM_WALK] = random_walk(world, groups[0].trial)
        for kind, values in found.items():
            figures = Tried(values, target_scene)
            kinds.setdefault(kind, []).append(figures)
            rows.append(_row(steps, kind, figures))
        missing.update(dict.fromkeys(all_missing(groups, setting.out)))
    averages = {kind: together(parts) for kind, parts in kinds.items()}
    rows += [_row(AVERAGE, kind, figures) for kind, figures in averages.items()]
    lines = [
        line(", ".join(filter(None, kind)), list(zip(DISTANCES, parts, strict=True))) for kind, parts in kinds.items()
    ]
    headings = ("steps away", "learner", "agent", "seeds", *HEADINGS)
    of_paper = ", ".join(f"{name} {100 * value:.1f} %" for name, value in FIGURE_5_AVERAGE_SC.items())
    notes = (NOTE, f"The paper's averages over all four distances, other scenes and features: {of_paper}.")
    return Section(
        name="fig5",
        title="Unseen targets near the trained ones (the paper's figure 5)",
        text="For every trained target an unseen one at exactly so many steps, drawn with a fixed seed.",
        tables=(ReportTable("fig5", "Success on unseen targets", headings, tuple(rows), notes),),
        figures=(
            ReportFigure("fig5", "Unseen targets", "steps from the trained target", "success score", _known(lines)),
        ),
        claims=tuple(_claims(setting, averages)),
        missing=tuple(missing),
    )


def _row(steps: Value, kind: tuple[str | None, str], figures: Tried) -> tuple[Value, ...]:
    learner, agent = kind
    return (steps, learner, agent, None if learner is None else len(figures.scores), *figures.cells())


def _claims(setting: Setting, averages: Mapping[tuple[str | None, str], Tried]) -> list[Claim]:
    """The collision-aware agent reaches more of the unseen targets."""
    found = []
    for learner in setting.learners:
        ours, baseline = (averages[learner, reward.name] for reward in (COLLISION_AWARE, SHORTEST))
        for metric, what in (("sc", "sc"), ("spl", "SPL")):
            text = f"{learner}: generalises better (higher {what} on unseen targets)"
            scores = ours.scores.of(metric), baseline.scores.of(metric)
            found.append(judged_more(text, what, *scores, ours.target_scene))
    return found


def _known(lines: list[Series | None]) -> tuple[Series, ...]:
    return tuple(line for line in lines if line is not None)


def _groups(setting: Setting, steps: int) -> list[Group]:
    return tried(setting, PAIR, unseen_targets(setting, steps))


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
