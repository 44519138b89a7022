"""Table 1: steps and collisions on the paper's targets, with the shortest-path and the collision-aware reward."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from clearway.experiments.groups import PAIR, Group, all_jobs, compared
from clearway.experiments.navigation_tables import navigation_tables
from clearway.experiments.other_learners import other_learners
from clearway.experiments.paper_numbers import TABLE_1
from clearway.experiments.plan import Job
from clearway.experiments.section import Claim, Section
from clearway.experiments.setting import TABLE_1_REWARDS, Setting
from clearway.experiments.trajectories import maps
from clearway.experiments.verdicts import judged_less, judged_no_more, with_failures
from clearway.learn.settings import with_settings
from clearway.reward import BUMP, COLLISION_AWARE, SHORTEST

BASELINES = {SHORTEST.name: "the shortest-path reward", BUMP.name: "a penalty for bumping"}
"""What the collision-aware reward is compared with, by name; the paper compares with the first alone."""
UNCLIPPED = "unclipped"  # ends the name of a learner that the paper does not have


def jobs(setting: Setting) -> list[Job]:
    """What must be done."""
    return all_jobs((*all_groups(setting), *other_learners(setting)))


def section(setting: Setting) -> Section:
    """What came of it."""
    groups = all_groups(setting)
    others = other_learners(setting)
    tables = navigation_tables("table1", "Steps and collisions", setting, setting.targets, groups, TABLE_1, others)
    return Section(
        name="table1",
        title="Navigation (the paper's table 1)",
        text=(
            "Agents trained on the paper's targets, one network for all scenes, walk from random starts. Published "
            "learners clip rewards to [-1, 1], as the paper's code base does; unclipped, the target is worth 10. "
            "Beside them stand agents on learnt maps, and learners that are told more than pictures. The paper says of "
            "this table that collisions fall by an order of magnitude, which its printed figures do not show."
        ),
        tables=tables,
        maps=maps(setting, groups),
        claims=(*claims(setting, groups), *_tenth(setting, groups)),
    )


def all_groups(setting: Setting) -> list[Group]:
    """All rewards; and the two that the paper compares once more without clipping, where a learner clips."""
    unclipped = {
        f"{name}, {UNCLIPPED}": with_settings(learner, ["clip_rewards=false"])
        for name, learner in setting.learners.items()
        if learner.clip_rewards
    }
    return compared(setting, TABLE_1_REWARDS) + compared(replace(setting, learners=unclipped), PAIR)


def _tenth(setting: Setting, groups: Sequence[Group]) -> Iterator[Claim]:
    """Collisions fall by an order of magnitude."""
    world = setting.world()
    found = {(group.learner, group.agent): group.scores(setting.out, world.target_count) for group in groups}
    for learner in setting.learners:
        ours, theirs = (found[learner, reward.name] for reward in (COLLISION_AWARE, SHORTEST))
        text = f"{learner}: less than a tenth of the collisions with the shortest-path reward"
        pair = ours.of("collisions"), theirs.of("collisions") / 10
        target_scene = world.target_scene.numpy()
        claim = judged_less(text, "collisions and a tenth of theirs", *pair, target_scene)
        yield with_failures(claim, ours.of("success"), theirs.of("success"), target_scene)


def claims(setting: Setting, groups: Sequence[Group], where: str = "") -> list[Claim]:
    """Fewer collisions, and no more steps, than with each baseline that a learner was trained with.

    Args:
        setting: see there.
        groups: of any learners and rewards, all tried on the same targets.
        where: behind each claim, for example " on hard targets".
    """
    world = setting.world(groups[0].trial.targets)
    target_scene = world.target_scene.numpy()
    scores = {(group.learner, group.agent): group.scores(setting.out, world.target_count) for group in groups}
    found = []
    for learner in dict.fromkeys(group.learner for group in groups):
        ours = scores[learner, COLLISION_AWARE.name]
        for baseline, called in BASELINES.items():
            theirs = scores.get((learner, baseline))
            if theirs is None:
                continue
            for text, what, judged in (
                (f"fewer collisions than with {called}{where}", "collisions", judged_less),
                (f"no more steps than with {called}{where}", "steps", judged_no_more),
            ):
                claim = judged(f"{learner}: {text}", what, ours.of(what), theirs.of(what), target_scene)
                further = baseline != SHORTEST.name or learner.endswith(UNCLIPPED)
                claim = with_failures(claim, ours.of("success"), theirs.of("success"), target_scene)
                found.append(replace(claim, further=further))
    return found
