"""The exact yardsticks of `oracle` for all targets of a world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.evaluation.oracle import DISCOUNT, ENTROPY_WEIGHT, Expected, Task, Yardstick, task_of, yardstick
from clearway.reward import Reward
from clearway.world.world import World

OPTIMUM, SOFT_FIXED_POINT = "optimum", "soft fixed point"  # names of the two policies in tables


@dataclass(frozen=True)
class TargetYardstick:
    """The yardstick of one target of a world; `target` is its state in the scene's own numbering."""

    scene: str
    target: int
    yardstick: Yardstick

    def to_json(self) -> dict[str, object]:
        """Figures as JSON values; a policy that may never arrive has null."""
        found = self.yardstick
        soft = _figures(found.soft)
        optimal = {key: value for key, value in _figures(found.optimal).items() if key != "collisions"}
        return {
            "scene": self.scene,
            "target": self.target,
            "shortest_path_steps": found.shortest_path_steps,
            "optimal": optimal,
            "soft": soft,
        }


def world_yardsticks(
    world: World,
    reward: Reward,
    *,
    discount: float = DISCOUNT,
    entropy_weight: float = ENTROPY_WEIGHT,
    starts: np.ndarray | None = None,
) -> list[TargetYardstick]:
    """Yardsticks of all targets of a world, in its order.

    Args:
        world: see there.
        reward: is earned.
        discount: see `oracle`.
        entropy_weight: see there.
        starts: (M, E) int64 states in the world's numbering, to average over, see `episodes.episode_starts`; None: all.
    """
    found = []
    for target, (scene, task) in enumerate(zip(world.target_scene.tolist(), world_tasks(world, reward), strict=True)):
        own = None if starts is None else starts[target] - int(world.scene_offset[scene])
        exact = yardstick(task, discount, entropy_weight, own)
        found.append(TargetYardstick(world.scene_names[scene], task.target, exact))
    return found


def world_tasks(world: World, reward: Reward) -> list[Task]:
    """The decision problems of all targets of a world, each in its own scene."""
    zone, table = world.zone.cpu().numpy(), reward.table(world.moves())  # of all scenes together, as training pays it
    found = []
    for target, scene in enumerate(world.target_scene.tolist()):
        own = slice(*world.scene_offset[scene : scene + 2].tolist())
        found.append(task_of(world.graph(scene), zone[own], world.scene_state(target), table[:, own]))
    return found


def _figures(expected: Expected) -> dict[str, float | None]:
    return {key: value if np.isfinite(value) else None for key, value in vars(expected).items()}
