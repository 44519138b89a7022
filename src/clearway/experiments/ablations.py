"""What single parts bring: a learner with another length of history, with one head for all scenes, with half the zones.

All arms train on the experiment's targets with the collision-aware reward, but for the two that keep one of its
penalties. Five seeds an arm decide at most six claims of a table after Holm's correction, so there are six.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, replace

from clearway.experiments.convergence import settling_table
from clearway.experiments.groups import Group, all_jobs, compared
from clearway.experiments.navigation_tables import navigation_tables
from clearway.experiments.plan import Job
from clearway.experiments.section import Claim, Section
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import further, judged_less, with_failures
from clearway.experiments.zones_or_step import with_zones
from clearway.learn.learner import Learner
from clearway.learn.settings import with_settings
from clearway.reward import COLLISION_AWARE, Reward, Zones

NAME = "ablations"
BETA, GAMMA = "beta-alone", "gamma-alone"
HISTORIES = (1, 2, 8)
"""Poses that an arm's agents know; the published settings and the default know four."""
SHARED = "one head"


def rewards() -> tuple[Reward, ...]:
    """With the penalty of the collision zone alone, and with that of the precollision zone alone."""
    penalties = COLLISION_AWARE.parameters
    return (
        with_zones(BETA, Zones(beta=penalties["beta"])),
        with_zones(GAMMA, Zones(gamma=penalties["gamma"])),
    )


def arms(name: str, learner: Learner, scenes: int) -> dict[str, Learner]:
    """The learner with one setting changed, by its arm's name; none that is the learner as it is.

    Heads differ where there are several scenes.
    """
    settings = asdict(learner)
    changes = {f"history {length}": f"history_length={length}" for length in HISTORIES}
    if scenes > 1:
        changes[SHARED] = "heads=shared"
    known = {arm: word for arm, word in changes.items() if word.partition("=")[0] in settings}
    found = {f"{name}, {arm}": with_settings(learner, [word]) for arm, word in known.items()}
    return {arm: own for arm, own in found.items() if own != learner}


def jobs(setting: Setting) -> list[Job]:
    """What must be done."""
    return all_jobs(_groups(setting))


def section(setting: Setting) -> Section:
    """What came of it."""
    groups = _groups(setting)
    tables = navigation_tables(NAME, "Steps and collisions", setting, setting.targets, groups, {})
    return Section(
        name=NAME,
        title="What single parts bring",
        text=(
            "A learner, and the same with one thing changed: poses that the agent knows (history), one "
            f"head for all scenes in place of one each, and rewards with one of the two penalties: {BETA} keeps the "
            f"collision zone's, {GAMMA} the precollision zone's."
        ),
        tables=(*tables, settling_table(NAME, setting, groups)),
        claims=further(_claims(setting, groups)),
    )


def _groups(setting: Setting) -> list[Group]:
    changed = {
        arm: own
        for name, learner in setting.learners.items()
        for arm, own in arms(name, learner, len(setting.scenes)).items()
    }
    return compared(setting, (*rewards(), COLLISION_AWARE)) + compared(
        replace(setting, learners=changed), (COLLISION_AWARE,)
    )


def _claims(setting: Setting, groups: list[Group]) -> Iterator[Claim]:
    """Each learner takes fewer steps than with a setting changed, and collides less than with one penalty alone."""
    world = setting.world()
    scenes = world.target_scene.numpy()
    found = {(group.learner, group.agent): group.scores(setting.out, world.target_count) for group in groups}
    for name, learner in setting.learners.items():
        ours = found[name, COLLISION_AWARE.name]
        others = {(arm, COLLISION_AWARE.name): "steps" for arm in arms(name, learner, len(setting.scenes))}
        others |= {(name, reward): "collisions" for reward in (BETA, GAMMA)}
        for other, metric in others.items():
            theirs = found[other]
            than = other[1] if other[0] == name else other[0].removeprefix(f"{name}, ")
            text = f"{name}: fewer {metric} than with {than}"
            claim = judged_less(text, metric, ours.of(metric), theirs.of(metric), scenes)
            yield with_failures(claim, ours.of("success"), theirs.of("success"), scenes)
