"""Figure 6: success on 5 held-out targets a scene, against the number of targets trained on."""

from __future__ import annotations

from clearway.experiments.generalisation import HEADINGS, NOTE, Tried, line, tried
from clearway.experiments.groups import RANDOM_WALK, Group, all_jobs, random_walk
from clearway.experiments.plan import Job, TargetSets
from clearway.experiments.section import ReportFigure, ReportTable, Section, Value
from clearway.experiments.setting import Setting
from clearway.reward import COLLISION_AWARE
from clearway.scenes.targets import TARGETS_PER_SCENE, target_order

TRAINED = (5, 15, 25, 35, 45)
HELD_OUT = TARGETS_PER_SCENE
ORDER_SEED = 6  # of the order in which states become held-out, then training targets


def jobs(setting: Setting) -> list[Job]:
    """What must be done: the collision-aware agent on growing sets of targets."""
    return [job for count in TRAINED for job in all_jobs(_groups(setting, count))]


def section(setting: Setting) -> Section:
    """What came of it."""
    held_out = held_out_targets(setting)
    world = setting.world(held_out)
    target_scene = world.target_scene.numpy()
    walked = Tried(random_walk(world, _groups(setting, TRAINED[0])[0].trial), target_scene)
    rows: list[tuple[Value, ...]] = []
    points: dict[str, list[tuple[float, Tried]]] = {RANDOM_WALK: []}
    missing: dict[str, None] = {}
    for count in TRAINED:
        for group in _groups(setting, count):
            values = group.scores(setting.out, world.target_count)
            figures = Tried(values, target_scene)
            rows.append((count, group.learner, len(values), *figures.cells()))
            points.setdefault(group.learner, []).append((count, figures))
            missing.update(dict.fromkeys(group.missing(setting.out)))
        points[RANDOM_WALK].append((count, walked))
    rows.append((None, RANDOM_WALK, None, *walked.cells()))
    lines = [line(label, own) for label, own in points.items()]
    headings = ("targets a scene", "learner", "seeds", *HEADINGS)
    return Section(
        name="fig6",
        title="Held-out targets against the number of trained ones (the paper's figure 6)",
        text=(
            "Collision-aware agents trained on growing sets of targets, which never contain the 5 held-out ones of a "
            "scene; every set contains the smaller ones."
        ),
        tables=(ReportTable("fig6", "Held-out targets", headings, tuple(rows), (NOTE,)),),
        figures=(
            ReportFigure(
                "fig6",
                "Held-out targets",
                "training targets a scene",
                "success score",
                tuple(each for each in lines if each is not None),
            ),
        ),
        missing=tuple(missing),
    )


def _groups(setting: Setting, count: int) -> list[Group]:
    trained: TargetSets = tuple(
        tuple(sorted(target_order(scene, ORDER_SEED)[HELD_OUT : HELD_OUT + count])) for scene in setting.scenes
    )
    return tried(setting, (COLLISION_AWARE,), held_out_targets(setting), trained=trained)


def held_out_targets(setting: Setting) -> TargetSets:
    """The targets that no agent of this experiment is trained on."""
    return tuple(tuple(sorted(target_order(scene, ORDER_SEED)[:HELD_OUT])) for scene in setting.scenes)
