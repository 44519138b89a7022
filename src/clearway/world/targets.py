"""Targets of scenes and where episodes to them start; the rule of starts stands here alone.

Axis letters: S states of a scene, A actions, K starts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Integral

import numpy as np

from clearway.errors import SceneError
from clearway.scenes.graph import distances_to

LEAST_SHARE = 0.5  # of the scene's largest component, from which a target must be reached


def is_start(steps: np.ndarray) -> np.ndarray:
    """Whether an episode to a target may start in a state, by the shortest-path steps (...) to it, -1 without a path.

    All states from which it can be reached, itself excluded.
    """
    return steps > 0


@dataclass(frozen=True)
class WalkedScene:
    """A scene that is walked in, as finding starts needs it.

    Attributes:
        index: its place among the scenes.
        name: of the scene, for errors.
        graph: (S, A) int, next state by action; -1 where a move is blocked.
        first: the number of its first state among those of all scenes.
        largest_part: states of its largest strongly connected component.
    """

    index: int
    name: str
    graph: np.ndarray
    first: int
    largest_part: int


NO_TARGETS = {
    name: np.zeros(0, np.int64)
    for name in ("target_state", "target_scene", "start_state", "start_steps", "start_offset", "start_count")
}


def target_tables(scenes: Sequence[WalkedScene], targets: Mapping[str, Sequence[int]]) -> dict[str, np.ndarray]:
    """The tables of targets and starts, named and shaped as in `World`.

    Args:
        scenes: those with targets, ascending.
        targets: state ids by scene name, in the scene's own numbering.

    Raises:
        SceneError: a scene has none, or a target is no state id, out of range, repeated or out of reach.
    """
    state, place = [], []
    starts: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    for scene in scenes:
        own = checked_states(scene.name, targets.get(scene.name, ()), len(scene.graph))
        starts.append(starts_to(scene, own))
        state += [scene.first + one for one in own]
        place += [scene.index] * len(own)
    start_state, start_steps, counts = zip(*starts, strict=True)
    count = np.concatenate(counts)
    return {
        "target_state": np.array(state, np.int64),
        "target_scene": np.array(place, np.int64),
        "start_state": np.concatenate(start_state),
        "start_steps": np.concatenate(start_steps, dtype=np.int64),
        "start_offset": np.cumsum(count) - count,
        "start_count": count,
    }


def starts_to(scene: WalkedScene, targets: Sequence[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where episodes to targets of a scene may start, target after target, see `is_start`.

    Returns:
        state: (K,) int64, in the numbering of all scenes, ascending for each target.
        steps: (K,) int, of the shortest path from each.
        count: (len(targets),) int64, how many of them are of each target.

    Raises:
        SceneError: a target is reached from less than `LEAST_SHARE` of the largest component.
    """
    steps = distances_to(scene.graph, np.asarray(targets))
    starts = is_start(steps)
    count = np.count_nonzero(starts, axis=1)
    for target, found in zip(targets, count.tolist(), strict=True):
        if found < max(1, LEAST_SHARE * (scene.largest_part - 1)):
            problem = f"only {found} of {len(scene.graph)} states lead to target {target}"
            raise SceneError(scene.name, problem, "Choose a target in the scene's largest component", "graph")
    return np.nonzero(starts)[1] + scene.first, steps[starts], count


def checked_states(name: str, targets: Sequence[int], state_count: int) -> list[int]:
    """The targets of a scene as Python's own ints.

    Raises:
        SceneError: there are none, or one is no state id, out of range or repeated.
    """
    chosen = list(targets)
    if not chosen:
        raise SceneError(name, "the scene has no target", "Give at least one state id as its target")
    for target in chosen:
        if not isinstance(target, Integral) or isinstance(target, bool):
            raise SceneError(name, f"target {target!r} is no state id", "Give whole numbers as targets")
        if not 0 <= target < state_count:
            valid = f"states are 0 to {state_count - 1}"
            raise SceneError(name, f"target {target} is out of range ({valid})", "Choose another target")
    if len(set(chosen)) < len(chosen):
        raise SceneError(name, "a target is named twice", "Name every target once")
    return [int(target) for target in chosen]
