"""`Navigator`: a trained agent behind a camera. Pictures in, actions out."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from pathlib import Path
from threading import Lock
from typing import Literal, NamedTuple, get_args

import numpy as np

from clearway.agents.agent import Agent, Decisions, State
from clearway.agents.selection import Argmax
from clearway.deploy.agent import DeployedAgent, as_observation
from clearway.errors import DeployError
from clearway.scenes.actions import Action

Selection = Literal["sampled", "argmax"]


class Decision(NamedTuple):
    """What an agent does.

    Attributes:
        action: the action chosen.
        probabilities: (A,) float32, of all actions.
        value: the discounted return that the agent expects, in units of the reward.
    """

    action: Action
    probabilities: np.ndarray
    value: float


def open_agent(source: str | Path, scene: str | None = None) -> DeployedAgent:
    """A trained agent from an ONNX file or a run folder.

    Args:
        source: the file, or the folder.
        scene: which of a run's scenes the agent is in; None for the first. A file holds one scene.

    Raises:
        ClearwayError: it cannot be read, was changed, is for another scene, or its encoder cannot be had.
    """
    path = Path(source)
    if path.is_dir():
        from clearway.deploy.from_run import RunAgent, load_run_in_scene

        return RunAgent(load_run_in_scene(path, scene))
    from clearway.deploy.onnx_file import OnnxAgent

    agent = OnnxAgent(path)
    if scene not in (None, agent.card.scene):
        raise DeployError(f"{path}: is for scene {agent.card.scene}, not {scene}. Export the run with --scene {scene}")
    return agent


class Navigator:
    """Walks to where a picture was taken. Threads may share it; calls are answered one after the other.

    Args:
        source: an ONNX file, a run folder, or an agent opened with `open_agent`, which several navigators may share.
        scene: which of a run's scenes; None for the first. A file and an opened agent hold one, which it must be.
        selection: "sampled" draws actions by their probabilities, as in training and in the published protocol;
            "argmax" takes the most probable one, and can walk in circles.
        seed: of the draws; None for one that differs every time.

    Raises:
        ClearwayError: there is no such selection or seed, or the agent is for another scene; see `open_agent`.
    """

    def __init__(
        self,
        source: str | Path | DeployedAgent,
        *,
        scene: str | None = None,
        selection: Selection = "sampled",
        seed: int | None = None,
    ) -> None:
        if selection not in get_args(Selection):
            raise DeployError(f"selection is {selection!r}. Choose one of {', '.join(get_args(Selection))}")
        if not isinstance(source, str | Path) and not (isinstance(source, Agent) and hasattr(source, "card")):
            problem = f"source is {source!r:.60}, expected an ONNX file, a run folder or an opened agent"
            raise DeployError(f"{problem}. Give one of these")
        agent = open_agent(source, scene) if isinstance(source, str | Path) else source
        self.card = agent.card
        if scene not in (None, self.card.scene):
            raise DeployError(f"the agent is for scene {self.card.scene}, not {scene}. Open the agent for {scene}")
        self._agent: Agent = Argmax(agent) if selection == "argmax" else agent
        self._episode_seeds, self._lock = episode_seeds(seed), Lock()
        self._state: State | None = None

    def set_target(self, picture: object) -> None:
        """Begin an episode: from the next picture on, walk to where this one was taken.

        Args:
            picture: (height, width, 3) uint8 RGB, or what `numpy.asarray` makes that of, for example a Pillow image.
                Features (F,) float32 where the agent was exported without its encoder (`card.takes_pictures`).

        Raises:
            DeployError: it is no such picture, or too large.
        """
        target = as_observation(picture, self.card)
        with self._lock:
            self._state = self._agent.reset(target, next(self._episode_seeds))

    def act(self, picture: object) -> Decision:
        """What to do, seeing a picture; the same kinds as in `set_target`.

        Raises:
            DeployError: it is no such picture, too large, or there is no target yet.
        """
        seen = as_observation(picture, self.card)
        with self._lock:
            if self._state is None:
                raise DeployError("there is no target yet. Call set_target first")
            decisions, self._state = self._agent.act(seen, self._state)
        return decision_of(decisions)


def decision_of(decisions: Decisions) -> Decision:
    """The decision of a batch of one, by an agent that tells probabilities and value."""
    assert decisions.probabilities is not None and decisions.value is not None
    return Decision(Action(int(decisions.action[0])), decisions.probabilities[0], float(decisions.value[0]))


def episode_seeds(seed: int | None) -> Iterator[np.ndarray]:
    """Seeds (1,) int64 of one episode after the other, which differ every time without a seed. Raises DeployError."""
    rng = np.random.default_rng(checked_seed(seed))
    return (rng.integers(1 << 62, size=1) for _ in count())


def checked_seed(seed: object) -> int | None:
    """The seed of draws, or None where there is none. Raises DeployError where it is no whole number from 0."""
    if seed is None:
        return None
    if not isinstance(seed, int | np.integer) or isinstance(seed, bool) or seed < 0:
        raise DeployError(f"seed is {seed!r:.40}, expected a whole number from 0. Leave it out for a random one")
    return int(seed)
