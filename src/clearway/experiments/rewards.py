"""Rewards against the first of them, of whoever asks: shipped ones, a package's, or one's own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from clearway.experiments.convergence import ONE_TARGET, frames_until_settled, mark_steps, settling_table
from clearway.experiments.groups import Group, all_jobs, compared
from clearway.experiments.navigation_tables import navigation_tables
from clearway.experiments.plan import Job
from clearway.experiments.section import Claim, Section
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import further, judged_less, judged_no_more, with_failures

NAME = "rewards"


def jobs(setting: Setting) -> list[Job]:
    """What must be done: the main experiment's agents under each reward."""
    return all_jobs(_groups(setting))


def section(setting: Setting) -> Section:
    """What came of it."""
    groups = _groups(setting)
    first, *others = dict.fromkeys(group.agent for group in groups)
    tables = navigation_tables(NAME, "Steps and collisions", setting, setting.targets, groups, {})
    return Section(
        name=NAME,
        title="Rewards",
        text=(
            f"Agents of {len(others) + 1} rewards, trained and tried alike. Each is judged against the first, {first}, "
            f"by three claims; all {3 * len(others)} of a learner are corrected together. Five seeds a reward decide "
            "none where they are more than six."
        ),
        tables=(*tables, settling_table(NAME, setting, groups)),
        claims=further(_claims(setting, groups)),
    )


def _groups(setting: Setting) -> list[Group]:
    return compared(setting, setting.rewards)


def _claims(setting: Setting, groups: Sequence[Group]) -> Iterator[Claim]:
    """Each reward's agents collide less than the first's, take no more steps, and settle sooner."""
    world, mark = setting.world(), mark_steps(setting, setting.targets)
    scenes = world.target_scene.numpy()
    for learner in setting.learners:
        first, *others = [group for group in groups if group.learner == learner]
        base = first.scores(setting.out, world.target_count)
        for group in others:
            own = group.scores(setting.out, world.target_count)
            for judge, words, metric in ((judged_less, "fewer", "collisions"), (judged_no_more, "no more", "steps")):
                text = f"{learner}: {group.agent}, {words} {metric} than {first.agent}"
                claim = judge(text, metric, own.of(metric), base.of(metric), scenes)
                yield with_failures(claim, own.of("success"), base.of("success"), scenes)
            ours, theirs = (frames_until_settled(setting.out, each, mark)[0] for each in (group, first))
            text = f"{learner}: {group.agent}, settles sooner than {first.agent}"
            yield judged_less(text, "frames until settled", ours, theirs, ONE_TARGET)
