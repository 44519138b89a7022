"""`Navigator`: a trained agent behind a camera. Pictures in, actions out."""

from __future__ import annotations

from pathlib import Path
from threading import Lock
from typing import Literal, NamedTuple, get_args

import numpy as np

from clearway.deploy.model import AgentModel, checked_seen, features_of
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


def open_model(source: str | Path, scene: str | None = None) -> AgentModel:
    """A trained agent from an ONNX file or a run folder.

    Args:
        source: the file, or the folder.
        scene: which of a run's scenes the agent is in; None for the first. A file holds one scene.

    Raises:
        ClearwayError: it cannot be read, was changed, is for another scene, or its encoder cannot be had.
    """
    path = Path(source)
    if path.is_dir():
        from clearway.deploy.from_run import RunModel, load_scene_agent

        return RunModel(load_scene_agent(path, scene))
    from clearway.deploy.onnx_file import OnnxModel

    model = OnnxModel(path)
    if scene not in (None, model.card.scene):
        raise DeployError(f"{path}: is for scene {model.card.scene}, not {scene}. Export the run with --scene {scene}")
    return model


class Navigator:
    """Walks to where a picture was taken. Threads may share it; calls are answered one after the other.

    Args:
        source: an ONNX file, a run folder, or an agent opened with `open_model`, which several navigators may share.
        scene: which of a run's scenes; None for the first. A file and an opened agent hold one, which it must be.
        selection: "sampled" draws actions by their probabilities, as in training and in the published protocol;
            "argmax" takes the most probable one, and can walk in circles.
        seed: of the draws; None for one that differs every time.

    Raises:
        ClearwayError: there is no such selection or seed, or the agent is for another scene; see `open_model`.
    """

    def __init__(
        self,
        source: str | Path | AgentModel,
        *,
        scene: str | None = None,
        selection: Selection = "sampled",
        seed: int | None = None,
    ) -> None:
        if selection not in get_args(Selection):
            raise DeployError(f"selection is {selection!r}. Choose one of {', '.join(get_args(Selection))}")
        if not isinstance(source, str | Path) and not (hasattr(source, "card") and hasattr(source, "step")):
            problem = f"source is {source!r:.60}, expected an ONNX file, a run folder or an opened agent"
            raise DeployError(f"{problem}. Give one of these")
        self._model = open_model(source, scene) if isinstance(source, str | Path) else source
        self.card = self._model.card
        if scene not in (None, self.card.scene):
            raise DeployError(f"the agent is for scene {self.card.scene}, not {scene}. Open the agent for {scene}")
        self._selection, self._rng, self._lock = selection, np.random.default_rng(checked_seed(seed)), Lock()
        self._target: np.ndarray | None = None
        self._history: np.ndarray | None = None

    def set_target(self, picture: object) -> None:
        """Begin an episode: from the next picture on, walk to where this one was taken.

        Args:
            picture: (height, width, 3) uint8 RGB, or what `numpy.asarray` makes that of, for example a Pillow image.
                Features (F,) float32 where the agent was exported without its encoder (`card.takes_pictures`).

        Raises:
            DeployError: it is no such picture, or too large.
        """
        seen = checked_seen(picture, self.card)
        with self._lock:
            self._target = features_of(self._model, seen[None])
            self._history = None

    def act(self, picture: object) -> Decision:
        """What to do, seeing a picture; the same kinds as in `set_target`.

        Raises:
            DeployError: it is no such picture, too large, or there is no target yet.
        """
        seen = checked_seen(picture, self.card)
        with self._lock:
            if self._target is None:
                raise DeployError("there is no target yet. Call set_target first")
            start = self._history is None
            before = np.zeros((1, self.card.history_length, self.card.feature_count), np.float32)
            history = before if self._history is None else self._history
            step = self._model.step(seen[None], np.array([start]), history, self._target)
            self._history = step.history
            action = choose(step.probabilities[0], None if self._selection == "argmax" else self._rng.random())
        return Decision(action, step.probabilities[0], float(step.value[0, 0]))


def checked_seed(seed: object) -> int | None:
    """The seed of draws, or None where there is none. Raises DeployError where it is no whole number from 0."""
    if seed is None:
        return None
    if not isinstance(seed, int | np.integer) or isinstance(seed, bool) or seed < 0:
        raise DeployError(f"seed is {seed!r:.40}, expected a whole number from 0. Leave it out for a random one")
    return int(seed)


def choose(probabilities: np.ndarray, uniform: float | None) -> Action:
    """The action that a uniform number in [0, 1) draws by probabilities (A,); None: the most probable one."""
    if uniform is None:
        return Action(int(probabilities.argmax()))
    bounds = probabilities.astype(np.float64).cumsum()
    return Action(min(int((uniform * bounds[-1] >= bounds).sum()), len(bounds) - 1))
