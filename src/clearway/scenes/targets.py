"""Which states of a scene are targets: those that Zhu et al. published, else a seeded choice.

In generated rooms and flats the choice leaves out the poses that are held out (`held_out`), or is among them alone.
"""

from __future__ import annotations

import numpy as np

from clearway.errors import SceneError
from clearway.scenes.floor_plans import GENERATED
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
HELD = " that are held out"


def held_out_targets(scene: Scene) -> np.ndarray:
    """Which states are held out as targets, (S,) bool: in generated rooms and flats a tenth, elsewhere none."""
    if scene.made_by.source != GENERATED:
        return np.zeros(scene.state_count, bool)
    return scene.held_out


def possible_targets(scene: Scene, held_out: bool = False) -> np.ndarray:
    """States of the scene's largest component that may be drawn as targets, (N,) int, ascending.

    Args:
        scene: any.
        held_out: those that are held out, in place of those that are not.

    Raises:
        SceneError: nothing is held out in the scene.
    """
    held = held_out_targets(scene)
    found = np.flatnonzero((scene.components == 0) & (held == held_out))
    if held_out and not len(found):
        kind = "no generated room or flat" if scene.made_by.source != GENERATED else "too small"
        problem = f"nothing is held out in it: it is {kind}"
        raise SceneError(scene.name, problem, "Name targets, or give scenes that clearway scenes generate made")
    return found


def seeded_targets(
    scene: Scene, count: int = TARGETS_PER_SCENE, seed: int = 0, held_out: bool = False
) -> tuple[int, ...]:
    """`count` distinct states of `possible_targets`, ascending, the same for the same seed.

    They lie in distinct cells as long as there are cells enough.

    Raises:
        SceneError: there are fewer, or nothing is held out in the scene.
    """
    order = _ordered(scene, seed, held_out)
    most = _most_targets(scene, len(order))
    if count < 1 or count > most:
        raise SceneError(
            scene.name,
            f"{count} targets asked for, the largest component has {len(order)} states{HELD if held_out else ''}",
            f"Ask for 1 to {most} targets",
        )
    return tuple(sorted(order[:count].tolist()))


def _few_targets(scene: Scene, seed: int, held_out: bool) -> tuple[int, ...]:
    """Five seeded targets, fewer where there are no more to draw; one at least, or SceneError."""
    order = _ordered(scene, seed, held_out)
    most = _most_targets(scene, len(order))
    few = order[: min(TARGETS_PER_SCENE, most)].tolist()
    return tuple(sorted(few)) or seeded_targets(scene, most, seed, held_out)


def _most_targets(scene: Scene, possible: int) -> int:
    """Of so many possible ones of a scene: a target needs a start beside it."""
    return min(possible, int(np.count_nonzero(scene.components == 0)) - 1)


def target_order(scene: Scene, seed: int = 0, held_out: bool = False) -> tuple[int, ...]:
    """All `possible_targets` of the scene in a random order, the same for the same seed.

    One state of every cell comes before the others.
    """
    return tuple(_ordered(scene, seed, held_out).tolist())


def _ordered(scene: Scene, seed: int, held_out: bool) -> np.ndarray:
    """As `target_order`, (N,) int64."""
    states = possible_targets(scene, held_out)
    order = np.random.default_rng([seed, scene.state_count]).permutation(states)
    _, first_of_cell = np.unique(scene.cells[order], return_index=True)
    comes_first = np.zeros(len(order), bool)
    comes_first[first_of_cell] = True
    return np.concatenate([order[comes_first], order[~comes_first]])


def default_targets(scene: Scene, seed: int = 0) -> tuple[int, ...]:
    """Zhu's targets for a scene of one of the four published names and sizes, else five seeded ones.

    Fewer than five where there are no more to draw. None of them is held out (`held_out_targets`).
    """
    if is_published(scene):
        return ZHU_TARGETS[scene.name]
    return _few_targets(scene, seed, held_out=False)


def default_held_out_targets(scene: Scene, seed: int = 0) -> tuple[int, ...]:
    """Five seeded targets among those that are held out, fewer where there are no more.

    Raises:
        SceneError: nothing is held out in the scene.
    """
    return _few_targets(scene, seed, held_out=True)


def is_published(scene: Scene) -> bool:
    """Whether a scene has the name and the size of one of the four published dumps."""
    return ZHU_STATES.get(scene.name) == scene.state_count
