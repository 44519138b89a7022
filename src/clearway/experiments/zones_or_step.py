"""Is "learns faster" the zones, or that steps cost more? The paper's two rewards beside two controls.

- `dearer`: every step costs the same, as much as a step under the collision-aware reward costs a random walk.
- `shuffled`: the collision-aware reward with the zones of all poses shuffled: as many dear poses, in places that mean
  nothing. Those of several scenes are shuffled together, so that their shares of dear poses even out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.experiments.convergence import ONE_TARGET, frames_until_settled, mark_steps, settling
from clearway.experiments.groups import Group, all_jobs, compared
from clearway.experiments.navigation_tables import navigation_tables
from clearway.experiments.paper_numbers import TABLE_1
from clearway.experiments.plan import Job
from clearway.experiments.section import Claim, Section
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import further, judged_less
from clearway.reward import COLLISION_AWARE, SHORTEST, Moves, Reward, Zones

NAME = "zones-or-step"
DEARER, SHUFFLED = "dearer", "shuffled"
SHUFFLE_SEED = 0


@dataclass(frozen=True)
class ShuffledZones(Zones):
    """What a step earns by the zone of another pose, of which each pose has its own."""

    def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
        """In place of what was earned."""
        return super().__call__(earned, with_shuffled(moves, SHUFFLE_SEED))


def with_shuffled(moves: Moves, seed: int) -> Moves:
    """The same moves, zones dealt out to other poses."""
    zone = np.random.default_rng(seed).permutation(moves.zone)
    return Moves(moves.next_state, moves.blocked, zone, moves.clearance_m)


def rewards(setting: Setting) -> tuple[Reward, ...]:
    """The two of the paper and their two controls."""
    penalties = COLLISION_AWARE.parameters
    zones = ShuffledZones(beta=penalties["beta"], gamma=penalties["gamma"])
    dearer = Reward(DEARER, SHORTEST.with_changes(alpha=mean_cost(setting)).terms)
    return (SHORTEST, COLLISION_AWARE, dearer, with_zones(SHUFFLED, zones))


def with_zones(name: str, zones: Zones) -> Reward:
    """The collision-aware reward with other zones, or other prices of them."""
    time, _, arrival = COLLISION_AWARE.terms
    return Reward(name, (time, zones, arrival))


def mean_cost(setting: Setting) -> float:
    """What a step of a random walk earns under the collision-aware reward, mean over scenes, to six digits.

    Moves lead back the way they came, so that a random walk is in all poses of a room alike often.
    """
    world = setting.world()
    earned = COLLISION_AWARE.table(world.moves())[0].mean(axis=1)
    starts, scene = np.unique(world.start_state.cpu().numpy()), world.scene_offset.cpu().numpy()
    of_scene = np.searchsorted(scene, starts, side="right") - 1
    return round(float(np.mean([earned[starts[of_scene == each]].mean() for each in np.unique(of_scene)])), 6)


def jobs(setting: Setting) -> list[Job]:
    """What must be done."""
    return all_jobs(_groups(setting))


def section(setting: Setting) -> Section:
    """What came of it."""
    groups = _groups(setting)
    tables = navigation_tables(NAME, "Steps and collisions", setting, setting.targets, groups, TABLE_1)
    settled, sooner = settling(NAME, setting, groups)
    return Section(
        name=NAME,
        title="Zones, or a larger step?",
        text=(
            f"Two controls beside the paper's rewards. {DEARER}: every step costs what it costs a random walk under "
            f"the collision-aware reward ({mean_cost(setting):g}). {SHUFFLED}: the collision-aware reward with the "
            "zones of the poses shuffled. If zones are what makes learning faster, the collision-aware agents settle "
            "sooner than both; if dear steps are, the controls settle as soon."
        ),
        tables=(*tables, settled),
        claims=further((*sooner, *_claims(setting, groups))),
    )


def _groups(setting: Setting) -> list[Group]:
    return compared(setting, rewards(setting))


def _claims(setting: Setting, groups: list[Group]) -> list[Claim]:
    """The collision-aware agents settle sooner than the controls, and these sooner than the shortest-path ones."""
    mark, found = mark_steps(setting, setting.targets), []
    frames = {(group.learner, group.agent): frames_until_settled(setting.out, group, mark)[0] for group in groups}
    for learner in setting.learners:
        for first, second in (
            (COLLISION_AWARE.name, DEARER),
            (COLLISION_AWARE.name, SHUFFLED),
            (DEARER, SHORTEST.name),
            (SHUFFLED, SHORTEST.name),
        ):
            text = f"{learner}: {first} settles sooner than {second}"
            pair = frames[learner, first], frames[learner, second]
            found.append(judged_less(text, "frames until settled", *pair, ONE_TARGET))
    return found
