"""Must zones lie where they do? The collision-aware reward beside zones of shuffled poses, each seed's in its own way.

`zones_or_step` has one shuffle for all seeds, so that what it finds may be that shuffle's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from clearway.experiments.convergence import ONE_TARGET, frames_until_settled, mark_steps, settling_table
from clearway.experiments.groups import PAIR, Group, all_jobs, compared
from clearway.experiments.navigation_tables import navigation_tables
from clearway.experiments.paper_numbers import TABLE_1
from clearway.experiments.plan import Job
from clearway.experiments.section import Claim, Section
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import further, judged_less, with_failures
from clearway.experiments.zones_or_step import with_shuffled, with_zones
from clearway.reward import COLLISION_AWARE, SHORTEST, Moves, Reward, Zones

NAME = "shuffles"
OWN = "own shuffle"


@dataclass(frozen=True)
class OwnShuffle(Zones):
    """What a step earns by the zone of another pose.

    Attributes:
        shuffle: a seed, of which pose that is.
    """

    shuffle: int = 0

    def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
        """In place of what was earned."""
        return super().__call__(earned, with_shuffled(moves, self.shuffle))


def reward(shuffle: int) -> Reward:
    """The collision-aware reward with the zones of poses shuffled."""
    penalties = COLLISION_AWARE.parameters
    zones = OwnShuffle(beta=penalties["beta"], gamma=penalties["gamma"], shuffle=shuffle)
    return with_zones(f"shuffle-{shuffle}", zones)


def jobs(setting: Setting) -> list[Job]:
    """What must be done."""
    return all_jobs(_groups(setting))


def section(setting: Setting) -> Section:
    """What came of it."""
    groups = _groups(setting)
    return Section(
        name=NAME,
        title="Zones where they are, or anywhere?",
        text=(
            "The paper's two rewards, and the collision-aware one with the zones of the poses shuffled, for each seed "
            "in another way. Exact figures of shuffled zones are for the first seed's shuffle."
        ),
        tables=(
            *navigation_tables(NAME, "Steps and collisions", setting, setting.targets, groups, TABLE_1),
            settling_table(NAME, setting, groups),
        ),
        claims=further(_claims(setting, groups)),
    )


def _groups(setting: Setting) -> list[Group]:
    shuffled = [
        replace(group, agent=OWN, runs=tuple(replace(run, reward=reward(run.seed)) for run in group.runs))
        for group in compared(setting, (COLLISION_AWARE,))
    ]
    return compared(setting, PAIR) + shuffled


def _claims(setting: Setting, groups: list[Group]) -> list[Claim]:
    """Zones where they are settle sooner and collide less than shuffled ones; these settle sooner than none."""
    world, mark, found = setting.world(), mark_steps(setting, setting.targets), []
    by_name = {(group.learner, group.agent): group for group in groups}
    for learner in setting.learners:
        ours, theirs, none = (by_name[learner, agent] for agent in (COLLISION_AWARE.name, OWN, SHORTEST.name))
        for first, second in ((ours, theirs), (theirs, none)):
            sooner, later = (frames_until_settled(setting.out, group, mark)[0] for group in (first, second))
            text = f"{learner}: {first.agent} settles sooner than {second.agent}"
            found.append(judged_less(text, "frames until settled", sooner, later, ONE_TARGET))
        own, other = (group.scores(setting.out, world.target_count) for group in (ours, theirs))
        text = f"{learner}: {ours.agent}, fewer collisions than {theirs.agent}"
        scenes = world.target_scene.numpy()
        claim = judged_less(text, "collisions", own.of("collisions"), other.of("collisions"), scenes)
        found.append(with_failures(claim, own.of("success"), other.of("success"), scenes))
    return found
