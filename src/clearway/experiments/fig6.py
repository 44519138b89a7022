"""Figure 6: success on 5 held-out targets a scene, against the number of targets trained on."""

from __future__ import annotations

import numpy as np

from clearway.agents.on_learnt_map import MOST_A_POSE
from clearway.errors import SceneError
from clearway.evaluation.across_seeds import mean_estimate
from clearway.experiments.generalisation import (
    BAND,
    HEADINGS,
    NOTE,
    TARGET_HEADINGS,
    Tried,
    lines,
    told_of_own_goals,
    tried,
)
from clearway.experiments.groups import WALKED, Group, all_jobs, random_walk
from clearway.experiments.learnt_maps import ABOUT_MAPS, on_maps
from clearway.experiments.plan import RANDOM_WALK, Job, TargetSets
from clearway.experiments.section import Claim, ReportFigure, ReportTable, Section, Value
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import judged_more
from clearway.reward import COLLISION_AWARE
from clearway.scenes.targets import TARGETS_PER_SCENE, target_order

TRAINED = (5, 15, 25, 35, 45)
HELD_OUT = TARGETS_PER_SCENE
FEW_A_POSE = 8  # frames of random walkers: such maps lead everywhere, not always by a shortest way
ORDER_SEED = 6  # of the order in which states become held-out, then training targets


def jobs(setting: Setting) -> list[Job]:
    """What must be done: the collision-aware agent on growing sets of targets, tried on them and held-out ones."""
    return [
        job
        for count in TRAINED
        for groups in (_groups(setting, count), _on_trained(setting, count))
        for job in all_jobs(groups)
    ]


def section(setting: Setting) -> Section:
    """What came of it."""
    held_out = held_out_targets(setting)
    world = setting.world(held_out)
    target_scene = world.target_scene.numpy()
    trial = _groups(setting, TRAINED[0])[0].trial
    walked = Tried(random_walk(world, trial), target_scene)
    mapped = on_maps(setting, trial, (FEW_A_POSE, MOST_A_POSE))
    on_map = {own.called: Tried(own.scores, target_scene) for own in mapped}
    rows: list[tuple[Value, ...]] = []
    by_target: list[tuple[Value, ...]] = []
    points: dict[str, list[tuple[float, Tried]]] = {}
    for count in TRAINED:
        for group, own in zip(_groups(setting, count), _on_trained(setting, count), strict=True):
            figures = Tried(group.scores(setting.out, world.target_count), target_scene)
            agents = group.learner, group.agent
            rows.append((count, *agents, len(figures.scores), _learnt(setting, own), *figures.cells()))
            by_target += [(count, *row) for row in figures.by_target(world, *agents)]
            points.setdefault(group.learner, []).append((count, figures))
    for kind, figures in on_map.items():
        rows.append((None, *kind, len(figures.scores), None, *figures.cells()))
        by_target += [(None, *row) for row in figures.by_target(world, *kind)]
        points[", ".join(kind)] = [(count, figures) for count in TRAINED]
    points[RANDOM_WALK] = [(count, walked) for count in TRAINED]
    rows.append((None, WALKED, RANDOM_WALK, None, None, *walked.cells()))
    headings = ("targets a scene", "learner", "agent", "seeds", "sc on trained targets", *HEADINGS)
    title = "Success on held-out targets"
    return Section(
        name="fig6",
        title="Held-out targets against the number of trained ones (the paper's figure 6)",
        text=(
            "Collision-aware agents trained on growing sets of targets, which never contain the 5 held-out ones of a "
            "scene; every set contains the smaller ones. All train for as many frames, so many targets may not have "
            "been learnt: see the success on the trained ones. The paper prints its figures as a picture alone."
        ),
        tables=(
            ReportTable(
                "fig6", title, headings, tuple(rows), (NOTE, ABOUT_MAPS, *told_of_own_goals(setting), *_fewer(setting))
            ),
            ReportTable(
                "fig6_targets",
                f"{title}: every target",
                ("targets a scene", *TARGET_HEADINGS),
                tuple(by_target),
                folded=True,
            ),
        ),
        figures=(ReportFigure("fig6", title, "training targets a scene", "success score", lines(points), band=BAND),),
        claims=tuple(_claims(setting, points, target_scene)),
    )


def _claims(setting: Setting, points: dict[str, list[tuple[float, Tried]]], target_scene: np.ndarray) -> list[Claim]:
    """The most targets give more success than the fewest."""
    found = []
    for learner in setting.learners:
        (_, fewest), *_, (_, most) = points[learner]
        for metric, what in (("sc", "sc"), ("spl", "SPL")):
            text = (
                f"{learner}: {TRAINED[-1]} training targets a scene generalise better than {TRAINED[0]} (higher {what})"
            )
            found.append(judged_more(text, what, most.scores.of(metric), fewest.scores.of(metric), target_scene))
    return found


def _learnt(setting: Setting, group: Group) -> float | None:
    """The group's success score on the targets that it was trained on."""
    world = setting.world(group.trial.targets)
    values = group.scores(setting.out, world.target_count)
    return mean_estimate(values.of("sc"), world.target_scene.numpy()).value if len(values) else None


def _groups(setting: Setting, count: int) -> list[Group]:
    return tried(setting, (COLLISION_AWARE,), held_out_targets(setting), trained=training_targets(setting, count))


def _on_trained(setting: Setting, count: int) -> list[Group]:
    trained = training_targets(setting, count)
    return tried(setting, (COLLISION_AWARE,), trained, trained=trained)


def training_targets(setting: Setting, count: int) -> TargetSets:
    """So many targets of each scene, or all that there are.

    Raises:
        SceneError: a scene has none beside the held-out ones.
    """
    for scene, there in zip(setting.scenes, _there(setting), strict=True):
        if not there:
            problem = f"has no targets beside the {HELD_OUT} that figure 6 holds out"
            raise SceneError(scene.name, problem, "Leave figure 6 out, or this scene")
    return tuple(
        tuple(sorted(target_order(scene, ORDER_SEED)[HELD_OUT : HELD_OUT + count])) for scene in setting.scenes
    )


def _there(setting: Setting) -> list[int]:
    """How many targets each scene has to be trained on."""
    return [max(0, len(target_order(scene, ORDER_SEED)) - HELD_OUT) for scene in setting.scenes]


def _fewer(setting: Setting) -> list[str]:
    """What is to be told of scenes that have fewer targets than are asked for."""
    return [
        f"{scene.name} has {there} targets beside the held-out ones; where more are asked for, these stand in."
        for scene, there in zip(setting.scenes, _there(setting), strict=True)
        if there < TRAINED[-1]
    ]


def held_out_targets(setting: Setting) -> TargetSets:
    """The targets that no agent of this experiment is trained on."""
    return tuple(tuple(sorted(target_order(scene, ORDER_SEED)[:HELD_OUT])) for scene in setting.scenes)
