"""`Sight`: what an agent is given to see in the poses of a world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from torch import Tensor

from clearway.agents.agent import FEATURES, POSE, Agent, Observation
from clearway.errors import AgentError
from clearway.evaluation.takes import Takes, never_again, take_at
from clearway.scenes.scene import Observations, Scene
from clearway.scenes.sensors import RGB
from clearway.world.world import World

MOST_KEPT_BYTES = 512 * 2**20  # pictures of all scenes; where they are more, files are read at every step


class Sight:
    """What an agent sees, and nothing else.

    Args:
        world: the poses.
        agent: says what it needs.
        scenes: the world's, in its order, for agents that see pictures.
        takes: seen on the way instead of the scenes' own pictures and features; targets are seen as they are.

    Raises:
        AgentError, SceneError: the world, a scene or the takes have nothing of the kind.
    """

    def __init__(self, world: World, agent: Agent, scenes: Sequence[Scene] = (), takes: Takes | None = None) -> None:
        self._world, self._names = world, agent.sees
        self._pictures = {name: _pictures(name, scenes) for name in agent.sees if name not in (POSE, FEATURES)}
        if FEATURES in agent.sees and world.features is None:
            problem = "the agent sees features, and the scenes have none"
            raise AgentError(f"{problem}. Encode them: clearway scenes encode FILES --out FOLDER")
        self._first = world.scene_offset.cpu().numpy()
        self._takes = None if takes is None else _those_seen(takes, agent)

    @property
    def varies(self) -> bool:
        """Whether what is seen in a pose differs from step to step."""
        return self._takes is not None

    def __call__(self, state: Tensor) -> Observation:
        """What the scenes show in states (B,) int64 of the world's numbering."""
        return {name: self._seen(name, state) for name in self._names}

    def on_the_way(self, state: Tensor, seed: Tensor, step: Tensor) -> Observation:
        """What is seen in states (B,) at steps (B,) of the episodes with these seeds (B,), int64 all."""
        if (takes := self._takes) is None:
            return self(state)
        pose = state.cpu().numpy()
        own = seed.cpu().numpy(), step.cpu().numpy()
        take = take_at(*own, takes.count)
        seen = {
            name: never_again(self._gathered(takes.seen[name], pose, takes.count, take), *own) for name in takes.seen
        }
        return {name: pose if name == POSE else seen[name] for name in self._names}

    def _seen(self, name: str, state: Tensor) -> np.ndarray:
        pose = state.cpu().numpy()
        if name == POSE:
            return pose
        if name == FEATURES:
            assert self._world.features is not None
            return self._world.features[state].float().cpu().numpy()
        return self._gathered(self._pictures[name], pose)

    def _gathered(
        self, kept: Sequence[Observations], pose: np.ndarray, often: int = 1, take: np.ndarray | int = 0
    ) -> np.ndarray:
        """Rows (B, ...) of each scene's array, in which every pose has as many rows as there are takes of it."""
        scene = np.searchsorted(self._first, pose, side="right") - 1
        row = (pose - self._first[scene]) * often + take
        seen = np.empty((len(pose), *kept[0].shape[1:]), kept[0][0].dtype)
        for own in np.unique(scene):
            here = scene == own
            seen[here] = kept[own][row[here]]
        return seen


def _those_seen(takes: Takes, agent: Agent) -> Takes | None:
    """The takes of what an agent sees, each scene's as (S * K, ...); None where it sees no pictures.

    Raises:
        AgentError: it sees what there are no takes of.
    """
    seen = [name for name in agent.sees if name != POSE]
    if missing := [name for name in seen if name not in takes.seen]:
        told = ", ".join(takes.seen) or f"{RGB} and {FEATURES}"
        problem = f"the agent sees {missing[0]}, and there are perturbed takes of {told} alone"
        raise AgentError(f"{problem}. Leave the perturbation out")
    flat = {name: [taken.reshape(-1, *taken.shape[2:]) for taken in takes.seen[name]] for name in seen}
    return replace(takes, seen=flat) if seen else None


def _pictures(name: str, scenes: Sequence[Scene]) -> list[Observations]:
    """Each scene's pictures of a sensor, (S, ...)."""
    if not scenes:
        raise AgentError(f"the agent sees {name}, and poses and features alone are known here. Give the scenes too")
    found = [scene.seen_by(name) for scene in scenes]
    for scene, pictures in zip(scenes, found, strict=True):
        if pictures.shape[1:] != found[0].shape[1:]:
            sizes = f"{pictures.shape[1:]}, those of {scenes[0].name} {found[0].shape[1:]}"
            raise AgentError(f"scene {scene.name}: its pictures have the size {sizes}. Evaluate in one scene at a time")
    picture_bytes = found[0][0].nbytes
    if sum(len(scene.graph) for scene in scenes) * picture_bytes > MOST_KEPT_BYTES:
        return found
    return [_ReadOnce(pictures) for pictures in found]


class _ReadOnce:
    """Pictures (S, ...) of which each is read and unpacked when it is first looked at."""

    def __init__(self, pictures: Observations) -> None:
        self._file, self.shape = pictures, pictures.shape
        self._values = np.empty(pictures.shape, pictures[0].dtype)  # takes memory where it is written alone
        self._read = np.zeros(len(self._values), bool)

    def __getitem__(self, index: int | slice | np.ndarray) -> np.ndarray:
        wanted = np.unique(np.arange(len(self._read))[index])
        if len(missing := wanted[~self._read[wanted]]):
            self._values[missing] = self._file[missing]
            self._read[missing] = True
        return self._values[index]
