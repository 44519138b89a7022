"""`Navigator`: a trained agent behind a camera. Pictures in, actions out."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Literal, NamedTuple, get_args

import numpy as np

from clearway.agents.agent import Agent, Decisions, State
from clearway.agents.selection import Argmax
from clearway.choices import GENERALIST, is_generalist
from clearway.deploy.agent import DeployedAgent, KeepsMaps, as_observation
from clearway.deploy.card import ANY_ROOM, Card
from clearway.errors import DeployError
from clearway.scenes.actions import Action

if TYPE_CHECKING:
    from clearway.mapping.room_map import RoomMap

Selection = Literal["sampled", "argmax"]


class Decision(NamedTuple):
    """What an agent does.

    Attributes:
        action: the action chosen.
        probabilities: (A,) float32, of all actions; None where the agent tells none.
        value: the discounted return that the agent expects, in units of the reward; None likewise.
    """

    action: Action
    probabilities: np.ndarray | None
    value: float | None


def open_agent(source: str | Path, scene: str | None = None, threads: int | None = None) -> DeployedAgent:
    """A trained agent from an ONNX file or a run folder, or "generalist", which comes with clearway.

    Args:
        source: the file, the folder, or the name.
        scene: which of a run's scenes the agent is in; None for the first. A file holds one scene.
        threads: of the processor, for an agent in a file; None: one a core.

    Raises:
        ClearwayError: it cannot be read, was changed, is for another scene, or its encoder cannot be had.
    """
    path = Path(source)
    if is_generalist(source):
        from clearway.agents.generalist import Generalist
        from clearway.deploy.generalist import GeneralistAgent

        agent: DeployedAgent = GeneralistAgent(Generalist.shipped())
    elif path.is_dir():
        from clearway.deploy.from_run import RunAgent, load_run_in_scene

        return RunAgent(load_run_in_scene(path, scene))
    else:
        agent = _of_file(path, threads)
    if scene not in (None, agent.card.scene):
        remedy = "Leave the scene out" if agent.card.scene == ANY_ROOM else f"Export the run with --scene {scene}"
        raise DeployError(f"{path}: is for scene {agent.card.scene}, not {scene}. {remedy}")
    return agent


def _of_file(path: Path, threads: int | None) -> DeployedAgent:
    from clearway.deploy.onnx_file import OnnxAgent, read_onnx

    file = read_onnx(path, threads)
    if file.card.kind == GENERALIST:
        from clearway.deploy.generalist import exported_generalist

        return exported_generalist(file)
    return OnnxAgent(file)


def check_selection(selection: str, card: Card) -> None:
    """Raise DeployError where there is no such selection, or the agent has nothing to choose among."""
    if selection not in get_args(Selection):
        raise DeployError(f"selection is {selection!r}. Choose one of {', '.join(get_args(Selection))}")
    if selection != get_args(Selection)[0] and not card.draws:
        raise DeployError(f"selection is {selection!r}, and the agent draws nothing that it could choose. Leave it out")


class Navigator:
    """Walks to where a picture was taken. Threads may share it; calls are answered one after the other.

    With an agent that keeps maps, the generalist, it may tour a room first (`explore`), and then go to any target in it
    by the map that the tour has made.

    Args:
        source: an ONNX file, a run folder, "generalist", or an agent opened with `open_agent`, which several navigators
            may share.
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
        if not isinstance(source, str | Path) and not (isinstance(source, Agent) and hasattr(source, "card")):
            problem = f"source is {source!r:.60}, expected an ONNX file, a run folder or an opened agent"
            raise DeployError(f"{problem}. Give one of these")
        agent = open_agent(source, scene) if isinstance(source, str | Path) else source
        self.card = agent.card
        if scene not in (None, self.card.scene):
            raise DeployError(f"the agent is for scene {self.card.scene}, not {scene}. Open the agent for {scene}")
        check_selection(selection, self.card)
        self._deployed = agent
        self._agent: Agent = Argmax(agent) if selection == "argmax" else agent
        self._episode_seeds, self._lock = episode_seeds(seed), Lock()
        self._state: State | None = None
        self._arrived: bool | None = None
        self._tour: tuple[Agent, State] | None = None
        self._known: RoomMap | None = None

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
            if self._tour is not None:
                maker = self._keeps_maps()
                self._known, self._tour = maker.map_of(self._tour[1]), None
                self._agent = maker.knowing(self._known)
            self._state, self._arrived = self._agent.reset(target, next(self._episode_seeds)), None

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
            self._arrived = arrival_of(decisions)
        return decision_of(decisions)

    @property
    def arrived(self) -> bool | None:
        """Whether the agent held at its last act that it is at the target; None where it cannot tell, or none was.

        `card.tells_arrival` says whether it can: files that an earlier clearway exported cannot.
        """
        return self._arrived

    def explore(self, picture: object) -> Decision:
        """What to do, seeing a picture, to get to know the room; the same kinds as in `act`.

        The first call begins a tour, anew where there was one. The next target ends it: from then on the navigator goes
        by the map that it has made, and the robot may stand anywhere in the room.

        Raises:
            DeployError: as of `act`, or the agent keeps no map.
        """
        seen = as_observation(picture, self.card)
        with self._lock:
            if self._tour is None:
                explorer = self._keeps_maps().explorer()
                self._tour = explorer, explorer.reset({}, next(self._episode_seeds))
                self._state = self._arrived = None
            explorer, state = self._tour
            decisions, state = explorer.act(seen, state)
            self._tour = explorer, state
        return decision_of(decisions)

    def save_map(self, path: str | Path) -> None:
        """Write the map of the room to a file, a safetensors file that says which eyes made it.

        Raises:
            DeployError: there is no map yet, the agent keeps none, or it cannot be written.
        """
        with self._lock:
            maker = self._keeps_maps()
            known = self._known if self._tour is None else maker.map_of(self._tour[1])
        if known is None:
            raise DeployError("there is no map yet. Call explore first, picture after picture")
        try:
            maker.write_map(Path(path), known)
        except OSError as fault:
            raise DeployError(f"{path}: cannot be written ({fault.strerror}). Choose another file") from fault

    def load_map(self, path: str | Path) -> None:
        """Go by the map in a file from the next target on.

        Raises:
            DeployError: it cannot be read, was altered, other eyes made it, or the agent keeps no maps.
        """
        with self._lock:
            maker = self._keeps_maps()
            self._known = maker.read_map(Path(path))
            self._agent, self._tour = maker.knowing(self._known), None
            self._state = self._arrived = None

    def _keeps_maps(self) -> KeepsMaps:
        if not isinstance(self._deployed, KeepsMaps):
            problem = f"the agent for scene {self.card.scene} keeps no map, and would have nothing of a tour"
            raise DeployError(f"{problem}. Open {GENERALIST}")
        return self._deployed


def decision_of(decisions: Decisions) -> Decision:
    """The decision of a batch of one."""
    told, value = decisions.probabilities, decisions.value
    return Decision(
        Action(int(decisions.action[0])), None if told is None else told[0], None if value is None else float(value[0])
    )


def arrival_of(decisions: Decisions) -> bool | None:
    """Whether the agent of a batch of one holds that it is at the target; None where it cannot tell."""
    return None if decisions.arrived is None else bool(decisions.arrived[0])


def episode_seeds(seed: int | None) -> Iterator[np.ndarray]:
    """Seeds (1,) int64 of one episode after the other, which differ every time without a seed. Raises DeployError."""
    rng = np.random.default_rng(checked_seed(seed))
    return (rng.integers(1 << 62, size=1) for _ in count())


def episode_seed(seed: int, number: int) -> np.ndarray:
    """The seed (1,) int64 of one of `episode_seeds`, by its number from 0, without drawing those before it."""
    jumped = np.random.PCG64(seed).advance(number)  # one word each: a power of two of them is never drawn again
    return np.random.Generator(jumped).integers(1 << 62, size=1)


def checked_seed(seed: object) -> int | None:
    """The seed of draws, or None where there is none. Raises DeployError where it is no whole number from 0."""
    if seed is None:
        return None
    if not isinstance(seed, int | np.integer) or isinstance(seed, bool) or seed < 0:
        raise DeployError(f"seed is {seed!r:.40}, expected a whole number from 0. Leave it out for a random one")
    return int(seed)
