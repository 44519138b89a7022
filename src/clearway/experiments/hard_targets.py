"""Hard targets by a stated rule, since the paper does not publish its own.

A state's hardness is the expected number of steps that a random walk needs to reach it, mean over all starts, times the
share of collision poses among those that the shortest paths to it arrive at (the optimal policy of the shortest-path
reward, ties taken alike, mean over all starts). Targets are taken from the hardest down, of equal ones the smaller
state first, each at least 4 cells from those already taken (Chebyshev distance on the grid); where fewer than 5 fit,
the distance is lowered cell by cell. Of generated scenes poses that are held out are none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.errors import SceneError
from clearway.evaluation.oracle import expected, make_task, optimal_policy
from clearway.reward import SHORTEST
from clearway.scenes.actions import ACTION_COUNT
from clearway.scenes.scene import Scene
from clearway.scenes.targets import TARGETS_PER_SCENE, possible_targets
from clearway.zones import scene_zones

APART_CELLS = 4


@dataclass(frozen=True)
class HardTargets:
    """The hardest states of a scene that lie apart.

    Attributes:
        targets: states, ascending.
        hardness: of each.
        rank: of each among the states that may be targets, 1 for the hardest.
        apart_cells: by which all of them lie apart.
    """

    targets: tuple[int, ...]
    hardness: tuple[float, ...]
    rank: tuple[int, ...]
    apart_cells: int


def hardness(scene: Scene) -> np.ndarray:
    """Hardness of every state of the scene, (S,) float64; 0 outside the largest component.

    Raises:
        SceneError: a random walk may never come to some state of that component.
    """
    zone = scene_zones(scene)
    found = np.zeros(scene.state_count)
    for state in np.flatnonzero(scene.components == 0).tolist():
        task = make_task(scene.graph, zone, state, SHORTEST)
        walk = np.full((scene.state_count, ACTION_COUNT), 1 / ACTION_COUNT)
        shortest = expected(task, optimal_policy(task))
        steps = expected(task, walk).steps
        if not np.isfinite(steps):
            raise SceneError(
                scene.name,
                "a random walk may never come to a target, as some way out of its largest part leads nowhere back",
                "Leave tables 2 and 3 out, or this scene",
            )
        found[state] = steps * shortest.collision_visits / max(shortest.steps, 1e-12)
    return found


def hard_targets(scene: Scene, count: int = TARGETS_PER_SCENE, apart_cells: int = APART_CELLS) -> HardTargets:
    """The hardest states of a scene by the rule above."""
    values = hardness(scene)
    order = np.argsort(-values, kind="stable")
    order = order[np.isin(order, possible_targets(scene))]  # from elsewhere no way leads there; others are held out
    cells = np.rint((scene.locations_m - scene.locations_m[0]) / scene.cell_size_m).astype(np.int64)  # from any of them
    taken: list[int] = []
    apart = apart_cells
    for apart in range(apart_cells, -1, -1):
        for state in order.tolist():
            far = all(np.abs(cells[state] - cells[other]).max() >= apart for other in taken)
            if len(taken) < count and state not in taken and far:
                taken.append(state)
        if len(taken) == count:
            break
    targets = tuple(sorted(taken))
    ranks = {state: rank for rank, state in enumerate(order.tolist(), start=1)}
    return HardTargets(
        targets, tuple(float(values[s]) for s in targets), tuple(ranks[s] for s in targets), apart_cells=apart
    )
