"""`Viewing`: the episode that one open page shows. No sockets and no page here: messages in, messages out.

Messages are JSON objects. The page says what to `do`:

    {"do": "begin", "episode": "scene=...&target=..."}    a new episode, see `episode`
    {"do": "step"}                                        every agent takes a step
    {"do": "drive", "action": 0, "along": true}           the user takes a step, and the agents too with `along`
    {"do": "map", "walker": 0}                            values and probabilities of every pose

and gets one answer to each, told apart by its `kind`: "episode", "steps", "map" or "refused" (with a `text`). A refused
message changes nothing, but that an episode ends where an agent fails at a step.
"""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.scenes.actions import ACTION_COUNT
from clearway.view.episode import MOST_WALKERS, Episode, actions_of, letters, read_episode
from clearway.view.stage import Stage
from clearway.view.walker import Standing, Walker
from clearway.world.world import World

Message = dict[str, Any]
YOU = "you"
DIGITS = 4  # of probabilities and values that are sent


class Viewing:
    """One page's episode.

    Args:
        stage: scenes and agents, shared between pages and never changed.
    """

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.episode = Episode()
        self.walkers: list[Walker] = []

    def answer(self, message: object) -> Message:
        """What to answer to a message."""
        try:
            return self.ask(message)
        except ClearwayError as error:
            return {"kind": "refused", "text": str(error)}

    def ask(self, message: object) -> Message:
        """What to answer to a message that is not refused.

        Raises:
            ClearwayError: it is.
        """
        match message:
            case {"do": "begin", "episode": str(query)}:
                return self.tell(read_episode(query))
            case {"do": "step"} if self.walkers:
                return self._step([None] * len(self.walkers), set(range(len(self.walkers))))
            case {"do": "drive", "action": int(action), "along": bool(along)} if 0 <= action < ACTION_COUNT:
                return self._drive(action, along)
            case {"do": "map", "walker": int(index)} if 0 <= index < self._agents_walking:
                return self._map(index)
        raise ClearwayError("the page sent a message that the viewer does not know. Load the page again")

    @property
    def _agents_walking(self) -> int:
        return len(self.stage.agents) if self.walkers else 0

    def begin(self, wanted: Episode) -> None:
        """Begin an episode; what it leaves open is chosen.

        Raises:
            ClearwayError: the scene, start or target does not exist or leads nowhere; the old episode stays.
        """
        scene = self.stage.scenes[self.stage.index(wanted.scene) if wanted.scene is not None else 0]
        target = self.stage.first_target(scene.name) if wanted.target is None else wanted.target
        drive = wanted.drive or not self.stage.agents
        worlds = [shown.place(scene.name, target) for shown in self.stage.agents]
        worlds += [self.stage.user_world(scene, target)] if drive else []
        start = _drawn_start(worlds[0], wanted.seed) if wanted.start is None else wanted.start
        if not 0 <= start < scene.state_count:
            raise ClearwayError(f"start {start}: {scene.name} has states 0 to {scene.state_count - 1}. Choose another")
        episode = replace(wanted, scene=scene.name, start=start, target=target, drive=drive)
        recorded = [actions_of(walk) for walk in episode.walks] + [[]] * MOST_WALKERS
        walkers = []
        for shown, placed, actions in zip(self.stage.agents, worlds, recorded, strict=False):
            walk = Walker(
                placed,
                0,
                start,
                shown.reward,
                seed=episode.seed,
                agent=shown.on_poses(placed),
                holds=shown.holds(placed, start),
                selection=episode.selection,
                recorded=actions,
            )
            walkers.append(walk)
        if episode.drive:
            walk = Walker(
                worlds[-1], 0, start, self.stage.reward, seed=episode.seed, agent=None, recorded=recorded[len(walkers)]
            )
            walkers.append(walk)
        self.episode, self.walkers = episode, walkers

    def tell(self, wanted: Episode) -> Message:
        """Begin an episode; what the page is told of it. Raises ClearwayError as `begin` does."""
        self.begin(wanted)
        return self._whole_episode()

    def names(self, episode: Episode) -> list[str]:
        """Of an episode's walkers, in their order."""
        return [shown.name for shown in self.stage.agents] + [YOU] * episode.drive

    def walked(self) -> Episode:
        """The episode with all steps taken so far."""
        return replace(self.episode, walks=tuple(letters(walker.actions) for walker in self.walkers))

    def _step(self, actions: list[int | None], moving: set[int]) -> Message:
        before = [len(walker.steps) for walker in self.walkers]
        try:
            steps = [
                walker.step(action) if index in moving else None
                for index, (walker, action) in enumerate(zip(self.walkers, actions, strict=True))
            ]
        except ClearwayError:
            for walker, count in zip(self.walkers, before, strict=True):
                walker.stop(count)
            raise
        sent = [_sent(step) if step else None for step in steps]
        return {"kind": "steps", "steps": sent, "ended": self._ended(), "link": self.walked().query()}

    def _drive(self, action: int, along: bool) -> Message:
        if not self.walkers or not self.episode.drive:
            raise ClearwayError("nobody drives in this episode. Choose Race first")
        you = len(self.walkers) - 1
        actions: list[int | None] = [None] * you + [action]
        return self._step(actions, set(range(len(self.walkers))) if along else {you})

    def _ended(self) -> list[bool]:
        return [walker.ended for walker in self.walkers]

    def _whole_episode(self) -> Message:
        episode = self.episode
        scene = self.stage.scenes[self.stage.index(str(episode.scene))]
        rewards = [shown.reward.name for shown in self.stage.agents] + [self.stage.reward.name]
        return {
            "kind": "episode",
            "scene": self.stage.index(scene.name),
            "start": episode.start,
            "target": episode.target,
            "selection": episode.selection,
            "seed": episode.seed,
            "drive": episode.drive,
            "recorded": max((len(walker.recorded) for walker in self.walkers), default=0),
            "walkers": [
                {
                    "name": name,
                    "agent": walker.agent is not None,
                    "reward": reward,
                    "steps": list(map(_sent, walker.steps)),
                }
                for name, walker, reward in zip(self.names(episode), self.walkers, rewards, strict=False)
            ],
            "ended": self._ended(),
            "link": self.walked().query(),
        }

    def _map(self, index: int) -> Message:
        if not self.stage.agents[index].tells_values:
            name = self.stage.agents[index].name
            raise ClearwayError(f"{name} tells no values of poses where it is not. Choose another map")
        held = self.walkers[index].map_of_mind()
        assert held.probabilities is not None and held.value is not None, "a network tells both"
        return {
            "kind": "map",
            "walker": index,
            "values": np.round(held.value.astype(np.float64), DIGITS).tolist(),
            "probabilities": np.round(held.probabilities.astype(np.float64), DIGITS).tolist(),
        }


def _sent(step: Standing) -> Message:
    """A step as the page gets it."""
    return {**asdict(replace(step, held=None)), "held": step.held and step.held.to_json()}


def _drawn_start(world: World, seed: int) -> int:
    """A start to the world's only target, drawn uniformly, in the scene's own numbering; the same for the same seed."""
    first = world.scene_offset[world.target_scene[0]]
    return int(np.random.default_rng([seed, world.scene_state(0)]).choice((world.start_state - first).numpy()))
