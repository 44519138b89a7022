"""Which states of a scene are targets: those that Zhu et al. published, else a seeded choice."""

from __future__ import annotations

import numpy as np

from clearway.errors import SceneError
from clearway.scenes.scene import Scene

ZHU_TARGETS: dict[str, tuple[int, ...]] = {
    "bathroom_02": (26, 37, 43, 53, 69),
    "bedroom_04": (134, 264, 320, 384, 387),
    "kitchen_02": (90, 136, 157, 207, 329),
    "living_room_08": (92, 135, 193, 228, 254),
}
"""State ids of the five targets a scene of the published dumps of those names (the paper's, too)."""

ZHU_STATES = {"bathroom_02": 180, "bedroom_04": 408, "kitchen_02": 676, "living_room_08": 468}
"""States of those dumps."""

TARGETS_PER_SCENE = 5


def seeded_targets(scene: Scene, count: int = TARGETS_PER_SCENE, seed: int = 0) -> tuple[int, ...]:
    """`count` distinct states of the scene's largest component, ascending, the same for the same seed.

    They lie in distinct cells as long as there are cells enough.

    Raises:
        SceneError: the component has fewer than `count` states.
    """
    order = target_order(scene, seed)
    if count < 1 or count > len(order) - 1:
        raise SceneError(
            scene.name,
            f"{count} targets asked for, the largest component has {len(order)} states",
            f"Ask for 1 to {len(order) - 1} targets",
        )
    return tuple(sorted(order[:count]))


def target_order(scene: Scene, seed: int = 0) -> tuple[int, ...]:
    """All states of the scene's largest component in a random order, the same for the same seed.

    One state of every cell comes before the others.
    """
    states = np.flatnonzero(scene.components == 0)
    order = np.random.default_rng([seed, scene.state_count]).permutation(states)
    _, first_of_cell = np.unique(scene.cells[order], return_index=True)
    one_a_cell = order[np.sort(first_of_cell)]
    others = np.delete(order, np.sort(first_of_cell))
    return tuple(int(state) for state in np.concatenate([one_a_cell, others]))


def default_targets(scene: Scene, seed: int = 0) -> tuple[int, ...]:
    """Zhu's targets for a scene of one of the four published names and sizes, else five seeded ones.

    Fewer than five where the scene's largest component has no more states.
    """
    if is_published(scene):
        return ZHU_TARGETS[scene.name]
    most = int((scene.components == 0).sum()) - 1
    return seeded_targets(scene, min(TARGETS_PER_SCENE, most), seed)


def is_published(scene: Scene) -> bool:
    """Whether a scene has the name and the size of one of the four published dumps."""
    return ZHU_STATES.get(scene.name) == scene.state_count
