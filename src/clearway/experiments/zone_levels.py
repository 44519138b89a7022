"""Do zones of whole cells do what zones of poses do? The paper's reward with either, beside the shortest-path reward.

A cell lies in a zone when any of its headings does, so more steps are dear, and turning on the spot changes nothing.
"""

from __future__ import annotations

from dataclasses import replace

from clearway.experiments.convergence import ONE_TARGET, frames_until_settled, mark_steps, settling_table
from clearway.experiments.groups import Group, all_jobs, compared
from clearway.experiments.navigation_tables import navigation_tables
from clearway.experiments.paper_numbers import TABLE_1
from clearway.experiments.plan import Job
from clearway.experiments.section import Claim, Section
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import further, judged_less, judged_no_more, with_failures
from clearway.reward import COLLISION_AWARE, SHORTEST

NAME = "zone-levels"
SAME = f"{COLLISION_AWARE.name}, "
POSES, CELLS = (f"{SAME}zones of {what}" for what in ("poses", "cells"))


def jobs(setting: Setting) -> list[Job]:
    """What must be done."""
    return all_jobs(_groups(setting))


def section(setting: Setting) -> Section:
    """What came of it."""
    groups = _groups(setting)
    return Section(
        name=NAME,
        title="Zones of poses, or of cells?",
        text=(
            "The paper's two rewards, with the zones of poses as everywhere else, and the collision-aware one with "
            "zones of cells: a cell lies in a zone when any of its headings does. Exact figures are for zones of poses."
        ),
        tables=(
            *navigation_tables(NAME, "Steps and collisions", setting, setting.targets, groups, TABLE_1),
            settling_table(NAME, setting, groups),
        ),
        claims=further(_claims(setting, groups)),
    )


def _groups(setting: Setting) -> list[Group]:
    """The paper's pair, and its second reward by zones of cells."""
    of_poses = [replace(group, agent=POSES) for group in compared(setting, (COLLISION_AWARE,))]
    of_cells = [
        replace(group, agent=CELLS, runs=tuple(replace(run, zone_level="cell") for run in group.runs))
        for group in of_poses
    ]
    return compared(setting, (SHORTEST,)) + of_poses + of_cells


def _claims(setting: Setting, groups: list[Group]) -> list[Claim]:
    """Zones of cells against the shortest-path reward, as the paper's claims are, and against zones of poses."""
    world, mark, found = setting.world(), mark_steps(setting, setting.targets), []
    scenes = world.target_scene.numpy()
    by_name = {(group.learner, group.agent): group for group in groups}
    for learner in setting.learners:
        cells, poses, shortest = (by_name[learner, agent] for agent in (CELLS, POSES, SHORTEST.name))
        scores = {group.agent: group.scores(setting.out, world.target_count) for group in (cells, poses, shortest)}
        ours = scores[CELLS]
        for judged, text, metric, other in (
            (judged_less, "fewer collisions", "collisions", shortest),
            (judged_no_more, "no more steps", "steps", shortest),
            (judged_less, "fewer collisions", "collisions", poses),
        ):
            theirs = scores[other.agent]
            claim = judged(
                f"{learner}: {text} with zones of cells than {other.agent.removeprefix(SAME)}",
                metric,
                ours.of(metric),
                theirs.of(metric),
                scenes,
            )
            found.append(with_failures(claim, ours.of("success"), theirs.of("success"), scenes))
        for other in (shortest, poses):
            ours_settled, theirs_settled = (frames_until_settled(setting.out, each, mark)[0] for each in (cells, other))
            text = f"{learner}: settles sooner with zones of cells than {other.agent.removeprefix(SAME)}"
            found.append(judged_less(text, "frames until settled", ours_settled, theirs_settled, ONE_TARGET))
    return found
