"""Figure 5: agents trained on the paper's targets, tried on unseen ones 1, 2, 4 and 8 steps away from these."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from clearway.experiments.generalisation import (
    BAND,
    HEADINGS,
    NOTE,
    TARGET_HEADINGS,
    Tried,
    lines,
    together,
    told_of_own_goals,
    tried,
)
from clearway.experiments.groups import PAIR, WALKED, Group, Scores, all_jobs, of_same_seeds, random_walk
from clearway.experiments.learnt_maps import ABOUT_MAPS, on_maps
from clearway.experiments.paper_numbers import FIGURE_5_AVERAGE_SC, reminder
from clearway.experiments.plan import RANDOM_WALK, Job, TargetSets
from clearway.experiments.section import Claim, ReportFigure, ReportTable, Section, Value
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import judged_more
from clearway.reward import COLLISION_AWARE, SHORTEST
from clearway.scenes.scene import Scene

DISTANCES = (1, 2, 4, 8)
AVERAGE = "average"
Kind = tuple[str, str]
"""A learner and what tells its agents from others; `WALKED` for the random walk."""


def jobs(setting: Setting) -> list[Job]:
    """What must be done: the main experiment's agents, tried on other targets."""
    return [job for steps in DISTANCES for job in all_jobs(_groups(setting, steps))]


def section(setting: Setting) -> Section:
    """What came of it."""
    rows: list[tuple[Value, ...]] = []
    by_target: list[tuple[Value, ...]] = []
    kinds: dict[Kind, list[Tried]] = {}
    for steps in DISTANCES:
        groups = _groups(setting, steps)
        world = setting.world(groups[0].trial.targets)
        target_scene = world.target_scene.numpy()
        found: dict[Kind, Scores] = {
            (group.learner, group.agent): group.scores(setting.out, world.target_count) for group in groups
        }
        found |= {mapped.called: mapped.scores for mapped in on_maps(setting, groups[0].trial)}
        found[WALKED, RANDOM_WALK] = random_walk(world, groups[0].trial)
        for kind, values in found.items():
            figures = Tried(values, target_scene)
            kinds.setdefault(kind, []).append(figures)
            rows.append(_row(steps, kind, figures))
            by_target += [(steps, *row) for row in figures.by_target(world, *kind)]
    averages = {kind: together(parts) for kind, parts in kinds.items()}
    rows += [_row(AVERAGE, kind, figures) for kind, figures in averages.items()]
    points = {
        kind[1] if kind[0] == WALKED else ", ".join(kind): [
            (float(steps), part) for steps, part in zip(DISTANCES, parts, strict=True)
        ]
        for kind, parts in kinds.items()
    }
    headings = ("steps away", "learner", "agent", "seeds", "targets", *HEADINGS, "the paper's sc")
    notes = (
        NOTE,
        ABOUT_MAPS,
        *told_of_own_goals(setting),
        reminder(setting.original, original_targets=False),
        *_replaced(setting),
    )
    title = "Success on unseen targets"
    return Section(
        name="fig5",
        title="Unseen targets near the trained ones (the paper's figure 5)",
        text=(
            "Poses whose nearest trained target is exactly so many steps away, all of them or, where a scene has more "
            f"than {setting.budget.unseen_targets}, so many drawn with a fixed seed. The paper says in words the "
            "averages alone; the rest of its figures is a picture."
        ),
        tables=(
            ReportTable("fig5", title, headings, tuple(rows), notes),
            ReportTable(
                "fig5_targets",
                f"{title}: every target",
                ("steps away", *TARGET_HEADINGS),
                tuple(by_target),
                folded=True,
            ),
        ),
        figures=(
            ReportFigure(
                "fig5", title, "steps to the nearest trained target", "success score", lines(points), band=BAND
            ),
        ),
        claims=(*_claims(setting, averages), *_falls(setting, kinds)),
    )


def _row(steps: Value, kind: Kind, figures: Tried) -> tuple[Value, ...]:
    learner, agent = kind
    of_paper = FIGURE_5_AVERAGE_SC.get(agent) if steps == AVERAGE else None
    seeds = None if learner == WALKED else len(figures.scores)
    return (steps, learner, agent, seeds, len(figures.target_scene), *figures.cells(), of_paper)


def _claims(setting: Setting, averages: Mapping[Kind, Tried]) -> list[Claim]:
    """The collision-aware agent reaches more of the unseen targets."""
    found = []
    for learner in setting.learners:
        ours, baseline = (averages[learner, reward.name] for reward in (COLLISION_AWARE, SHORTEST))
        for metric, what in (("sc", "sc"), ("spl", "SPL")):
            text = f"{learner}: generalises better (higher {what} on unseen targets)"
            scores = ours.scores.of(metric), baseline.scores.of(metric)
            found.append(judged_more(text, what, *scores, ours.target_scene))
    return found


def _falls(setting: Setting, kinds: Mapping[Kind, list[Tried]]) -> Iterator[Claim]:
    """Success falls with the distance, under both rewards together."""
    for learner in setting.learners:
        ends = []
        for place in (0, -1):
            own = [kinds[learner, reward.name][place] for reward in PAIR]
            found = of_same_seeds([each.scores for each in own])
            scenes = [each.target_scene for each in own]
            ends.append(np.concatenate([each.in_scenes("sc", of) for each, of in zip(found, scenes, strict=True)]))
        text = f"{learner}: success falls with distance (higher sc {DISTANCES[0]} step away than {DISTANCES[-1]})"
        near, far = ends
        yield judged_more(text, "sc", near, far, np.arange(len(setting.scenes)), rewards=len(PAIR))


def _groups(setting: Setting, steps: int) -> list[Group]:
    return tried(setting, PAIR, unseen_targets(setting, steps))


def unseen_targets(setting: Setting, steps: int) -> TargetSets:
    """In each scene poses so many steps from the nearest trained target; the farthest where none lie so far."""
    most = setting.budget.unseen_targets
    return tuple(_unseen(scene, own, steps, most) for scene, own in zip(setting.scenes, setting.targets, strict=True))


def _unseen(scene: Scene, trained: tuple[int, ...], steps: int, most: int) -> tuple[int, ...]:
    away = steps_to_nearest(scene, trained)
    chosen = np.flatnonzero(away == min(steps, away.max()))
    rng = np.random.default_rng([steps, scene.state_count])
    return tuple(sorted(rng.permutation(chosen)[:most].tolist()))


def steps_to_nearest(scene: Scene, trained: tuple[int, ...]) -> np.ndarray:
    """Steps from each pose of the scene's largest part to the nearest trained target, (S,) int; else -1."""
    steps = scene.distances_to(np.array(trained)).astype(np.int64)
    far = np.iinfo(np.int64).max
    nearest = np.where(steps < 0, far, steps).min(0)
    return np.where((nearest == far) | (scene.components != 0), -1, nearest)


def _replaced(setting: Setting) -> list[str]:
    """Where a scene has no pose so far away."""
    farthest = {
        scene.name: int(steps_to_nearest(scene, own).max())
        for scene, own in zip(setting.scenes, setting.targets, strict=True)
    }
    return [
        f"{name} has no pose {steps} steps from every trained target; its farthest, {most} steps away, stand in."
        for name, most in farthest.items()
        for steps in DISTANCES
        if most < steps
    ]
