"""Where does the difference in collisions come from: clipped rewards, or how much entropy is worth beside them?

Unclipped, the target is worth ten times as much beside the step size and the entropy bonus. So rewards are paid
unclipped at a tenth, too, where the target is worth 1 again and steps a tenth of what they cost; and clipped with a
tenth of the entropy weight. Five seeds decide at most six claims of a table after Holm's correction, so there are six.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from clearway.evaluation.episodes import episode_starts
from clearway.evaluation.metrics import average, by_scene
from clearway.evaluation.optimum import world_yardsticks
from clearway.experiments.convergence import settling_table
from clearway.experiments.groups import EXACT, PAIR, Group, all_jobs, compared
from clearway.experiments.navigation_tables import METRICS, navigation_tables
from clearway.experiments.plan import Job
from clearway.experiments.section import Claim, ReportTable, Section, Value
from clearway.experiments.setting import Setting
from clearway.experiments.table1 import UNCLIPPED
from clearway.experiments.verdicts import further, judged_less, judged_no_more, with_failures
from clearway.learn.learner import Learner
from clearway.learn.on_policy import OnPolicy
from clearway.learn.settings import with_settings
from clearway.reward import COLLISION_AWARE, SHORTEST

NAME = "clipping"
AT_A_TENTH, LESS_ENTROPY = f"{UNCLIPPED} at a tenth", "a tenth of the entropy weight"


def jobs(setting: Setting) -> list[Job]:
    """What must be done."""
    return all_jobs(_groups(setting))


def section(setting: Setting) -> Section:
    """What came of it."""
    groups = _groups(setting)
    tables = navigation_tables(NAME, "Steps and collisions", setting, setting.targets, groups, {}) if groups else ()
    return Section(
        name=NAME,
        title="Clipped rewards, or the weight of entropy?",
        text=(
            "The paper's two rewards: clipped, as published; unclipped, where the target is worth 10; unclipped at a "
            "tenth, where it is worth 1, as clipped, and a step costs a tenth; clipped with a tenth of the entropy "
            "weight. Where each comes to rest is told exactly, at its own entropy weight."
        ),
        tables=(*tables, settling_table(NAME, setting, groups), _resting(setting)) if groups else (),
        claims=further(_claims(setting, groups)),
    )


def variants(learner: Learner) -> dict[str, OnPolicy]:
    """The learner by what is changed of it, itself first; none where it does not clip, or scales no rewards."""
    if not isinstance(learner, OnPolicy) or not learner.clip_rewards:
        return {}
    tenth = [f"{name}={getattr(learner, name) / 10!r}" for name in ("entropy_start", "entropy_end")]
    return {
        "": learner,
        UNCLIPPED: with_settings(learner, ["clip_rewards=false"]),
        AT_A_TENTH: with_settings(learner, ["clip_rewards=false", f"reward_scale={learner.reward_scale / 10!r}"]),
        LESS_ENTROPY: with_settings(learner, tenth),
    }


def _called(learner: str, variant: str) -> str:
    return ", ".join(filter(None, (learner, variant)))


def _learners(setting: Setting) -> dict[str, OnPolicy]:
    """All variants of all learners, as tables call them."""
    return {
        _called(name, variant): own
        for name, learner in setting.learners.items()
        for variant, own in variants(learner).items()
    }


def _groups(setting: Setting) -> list[Group]:
    return compared(replace(setting, learners=_learners(setting)), PAIR)


def _resting(setting: Setting) -> ReportTable:
    """The soft fixed point of each variant and reward, exactly, from the starts of the agents."""
    trial, world = setting.trial(), setting.world()
    starts = episode_starts(world, trial.episodes_per_target, trial.seed)
    rows: list[tuple[Value, ...]] = []
    for name, learner in _learners(setting).items():
        entropy = learner.entropy_end / learner.reward_scale
        for reward in PAIR:
            found = world_yardsticks(world, learner.paid(reward), entropy_weight=entropy, starts=starts)
            policies = [each.yardstick.soft for each in found]
            values = np.array([[getattr(policy, metric) for metric in METRICS] for policy in policies])
            means = average(by_scene(values, world.target_scene.numpy()))
            rows.append((EXACT, name, reward.name, entropy, *means.tolist()))
    headings = ("figure", "learner", "agent", "entropy weight beside rewards unscaled", *METRICS)
    return ReportTable(f"{NAME}_rest", "Where each comes to rest, exactly", headings, tuple(rows))


def _claims(setting: Setting, groups: Sequence[Group]) -> Iterator[Claim]:
    """What the rewards differ in where either is changed; what the change alone does to the shortest-path reward."""
    world = setting.world()
    arms = {(group.learner, group.agent): group.scores(setting.out, world.target_count) for group in groups}
    scenes, zones, none = world.target_scene.numpy(), COLLISION_AWARE.name, SHORTEST.name
    for name in (name for name, learner in setting.learners.items() if variants(learner)):
        tenth, less = (_called(name, variant) for variant in (AT_A_TENTH, LESS_ENTROPY))
        compared_by = [
            (f"{variant}, {zones} has {words} {metric} than {none}", metric, judged, (arm, zones), (arm, none))
            for variant, arm in ((AT_A_TENTH, tenth), (LESS_ENTROPY, less))
            for words, metric, judged in (("fewer", "collisions", judged_less), ("no more", "steps", judged_no_more))
        ]
        for text, first, second in (
            (f"{none} with {LESS_ENTROPY} has fewer collisions than as it is", (less, none), (name, none)),
            (f"{none} as it is has fewer collisions than {AT_A_TENTH}", (name, none), (tenth, none)),
        ):
            compared_by.append((text, "collisions", judged_less, first, second))
        for text, metric, judged, first, second in compared_by:
            ours, theirs = arms[first], arms[second]
            claim = judged(f"{name}: {text}", metric, ours.of(metric), theirs.of(metric), scenes)
            yield with_failures(claim, ours.of("success"), theirs.of("success"), scenes)
