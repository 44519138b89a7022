"""`Sight`: what an agent is given to see in the poses of a world."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from torch import Tensor

from clearway.agents.agent import FEATURES, POSE, Agent, Observation
from clearway.errors import AgentError
from clearway.scenes.scene import Observations, Scene
from clearway.world.world import World


class Sight:
    """What an agent sees, and nothing else.

    Args:
        world: the poses.
        agent: says what it needs.
        scenes: the world's, in its order, for agents that see pictures.

    Raises:
        AgentError, SceneError: the world or a scene has nothing of the kind.
    """

    def __init__(self, world: World, agent: Agent, scenes: Sequence[Scene] = ()) -> None:
        self._world, self._names = world, agent.sees
        self._pictures = {name: _pictures(name, scenes) for name in agent.sees if name not in (POSE, FEATURES)}
        if FEATURES in agent.sees and world.features is None:
            raise AgentError("the agent sees features, and the scenes have none. Encode them: clearway scenes encode")
        self._first = world.scene_offset.cpu().numpy()

    def __call__(self, state: Tensor) -> Observation:
        """The observation in states (B,) int64 of the world's numbering."""
        return {name: self._seen(name, state) for name in self._names}

    def _seen(self, name: str, state: Tensor) -> np.ndarray:
        pose = state.cpu().numpy()
        if name == POSE:
            return pose
        if name == FEATURES:
            assert self._world.features is not None
            return self._world.features[state].float().cpu().numpy()
        scene = np.searchsorted(self._first, pose, side="right") - 1
        kept = self._pictures[name]
        seen = np.empty((len(pose), *kept[0].shape[1:]), kept[0][0].dtype)
        for own in np.unique(scene):
            here = scene == own
            seen[here] = kept[own][pose[here] - self._first[own]]
        return seen


def _pictures(name: str, scenes: Sequence[Scene]) -> list[Observations]:
    """Each scene's pictures of a sensor, (S, ...)."""
    if not scenes:
        raise AgentError(f"the agent sees {name}, and poses and features alone are known here. Give the scenes too")
    found = [scene.seen_by(name) for scene in scenes]
    for scene, pictures in zip(scenes, found, strict=True):
        if pictures.shape[1:] != found[0].shape[1:]:
            sizes = f"{pictures.shape[1:]}, those of {scenes[0].name} {found[0].shape[1:]}"
            raise AgentError(f"scene {scene.name}: its pictures have the size {sizes}. Evaluate in one scene at a time")
    return found
