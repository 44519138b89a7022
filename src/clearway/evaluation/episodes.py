"""Episodes by the paper's protocol, walked side by side: random starts, a limit of steps.

Axis letters: N episodes, B of them still walking, A actions, M targets, Z zones, T steps.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from clearway.agents.agent import Agent, rows
from clearway.agents.answers import arrivals_of, check_decisions, check_state, tells_arrivals
from clearway.agents.chance import CHANCE
from clearway.agents.selection import ActionSelection, selecting
from clearway.evaluation.loops import LoopSkipper, Tally
from clearway.evaluation.sight import Sight
from clearway.evaluation.takes import Takes
from clearway.reward import COLLISION_AWARE
from clearway.scenes.scene import Scene
from clearway.world.navigation import Navigation, Transition
from clearway.world.randomness import stream_keys
from clearway.world.world import World

EPISODES_PER_TARGET = 100
STEP_LIMIT = 10_000
EPISODES_AT_ONCE = 4096
TARGET_STREAM = 11


@dataclass(frozen=True)
class Trajectory:
    """One walk: states (T + 1,) int64 in the world's numbering, and the actions (T,) int64 between them."""

    states: np.ndarray
    actions: np.ndarray


@dataclass(frozen=True, eq=False)
class EpisodeTable:
    """What happened in N episodes.

    Attributes:
        target: (N,) int64, index of the world's target, ascending.
        start: (N,) int64, first state in the world's numbering.
        steps: (N,) int64, steps taken; the limit where the target was not reached.
        collisions: (N,) int64, blocked moves.
        reached: (N,) bool, the target was reached within the limit.
        shortest_path_steps: (N,) int64, fewest steps from the start to the target.
        zone_steps: (N, Z) int64, steps that arrived in each zone (`zones.Zone`); the target is in none.
        looped: (N,) bool, found before the limit to be in a circle of actions without choice, so never to arrive.
        trajectories: the walks, one an episode; None unless asked for.
        false_arrivals: (N,) int64, steps at which the agent held wrongly that it was at the target, but those in
            rounds of a circle that were not walked; None where it says nothing of it.
        told_arrival: (N,) bool, it held so where it was; None likewise.
    """

    target: np.ndarray
    start: np.ndarray
    steps: np.ndarray
    collisions: np.ndarray
    reached: np.ndarray
    shortest_path_steps: np.ndarray
    zone_steps: np.ndarray
    looped: np.ndarray
    trajectories: tuple[Trajectory, ...] | None = None
    false_arrivals: np.ndarray | None = None
    told_arrival: np.ndarray | None = None

    def __len__(self) -> int:
        """N."""
        return len(self.target)


def run_episodes(
    world: World,
    agent: Agent,
    *,
    scenes: Sequence[Scene] = (),
    takes: Takes | None = None,
    selection: ActionSelection = "sampled",
    episodes_per_target: int = EPISODES_PER_TARGET,
    step_limit: int = STEP_LIMIT,
    seed: int = 0,
    record: bool = False,
    episodes_at_once: int = EPISODES_AT_ONCE,
) -> EpisodeTable:
    """Walk episodes to every target of a world.

    Episode i of a target draws its start and its actions from its own random streams, named by the seed, the
    scene, the target's state and i: it is the same whatever runs beside it, and all agents face the same
    starts.

    Args:
        world: the tables; the walk happens on their device.
        agent: who walks. A walk in a circle of actions that it is certain of is completed by arithmetic instead of
            walked to the limit; the counts are the same, but `false_arrivals`.
        scenes: the world's, in its order, for an agent that sees pictures.
        takes: what it sees on the way instead, one a step, drawn by the episode's seed.
        selection: how actions are chosen by the agent's probabilities.
        episodes_per_target: how many.
        step_limit: steps after which an episode has failed.
        seed: another seed gives other starts and other chances.
        record: keep the trajectories too (then circles are walked to the limit).
        episodes_at_once: most episodes to walk side by side; changes memory and speed, not the result.

    Raises:
        AgentError: the agent sees what is not there, or does what no agent may.
    """
    assert episodes_per_target > 0 and step_limit > 0 and episodes_at_once > 0
    target = torch.arange(world.target_count, device=world.device).repeat_interleave(episodes_per_target)
    seeds = episode_seeds(world, episodes_per_target, seed)
    agent = selecting(agent, selection, world)
    sight = Sight(world, agent, scenes, takes)
    parts = []
    with torch.no_grad():
        for chosen in torch.arange(len(target), device=world.device).split(episodes_at_once):
            walk = _Walk(world, agent, sight, seeds[chosen], target[chosen], step_limit, record)
            parts.append(walk.to_the_end())
    return joined(parts)


def episode_seeds(world: World, episodes_per_target: int, seed: int) -> Tensor:
    """One seed an episode, (M * episodes_per_target,) int64, target after target."""
    names = [world.scene_names[scene] for scene in world.target_scene.tolist()]
    labels = [f"{name}:{world.scene_state(target)}" for target, name in enumerate(names)]
    of_target = torch.tensor([zlib.crc32(label.encode()) for label in labels])
    first = stream_keys(stream_keys(torch.tensor([seed]), TARGET_STREAM) + of_target, TARGET_STREAM)
    return (first[:, None] + torch.arange(episodes_per_target)).reshape(-1).to(world.device)


def episode_starts(world: World, episodes_per_target: int, seed: int) -> np.ndarray:
    """Where the episodes of `run_episodes` begin, (M, episodes_per_target) int64 in the world's numbering."""
    env = Navigation(world, COLLISION_AWARE, episode_seeds(world, episodes_per_target, seed))
    env.reset(target=torch.arange(world.target_count, device=world.device).repeat_interleave(episodes_per_target))
    return env.state.view(world.target_count, episodes_per_target).cpu().numpy()


class _Walk:
    """A batch of episodes on the way. Episodes that end are written down and dropped from the batch."""

    def __init__(
        self, world: World, agent: Agent, sight: Sight, seeds: Tensor, target: Tensor, step_limit: int, record: bool
    ) -> None:
        count = len(seeds)
        self.world, self.agent, self.sight, self.step_limit = world, agent, sight, step_limit
        self.seeds = seeds
        # No number here rests on the reward; the environment wants one.
        self.env = Navigation(world, COLLISION_AWARE, seeds, history_length=1)
        self.env.reset(target=target)
        self.memory = agent.reset(sight(world.target_state[target]), seeds.cpu().numpy())
        check_state(self.memory, count)
        self.target, self.start = target, self.env.state.clone()
        self.walking = torch.arange(count, device=world.device)  # (B,) episode of each row of the batch
        self.tally = Tally.zero(count, world.device)
        self.final = Tally.zero(count, world.device)
        self.reached = torch.zeros(count, dtype=torch.bool, device=world.device)
        self.looped = torch.zeros_like(self.reached)
        self.loops = LoopSkipper(count, self.tally)
        self.diary: list[tuple[Tensor, Tensor, Tensor]] | None = [] if record else None
        self.false_arrivals, self.told_arrival = np.zeros(count, np.int64), np.zeros(count, bool)
        self.tells_arrivals: bool | None = None  # asked at the first step

    def to_the_end(self) -> EpisodeTable:
        """Walk until every episode has ended."""
        while len(self.walking):
            seen = self.sight.on_the_way(self.env.state, self.seeds, self.tally.steps)
            decisions, self.memory = self.agent.act(seen, self.memory)
            check_decisions(decisions, len(self.walking))
            check_state(self.memory, len(self.walking))
            self.tells_arrivals = tells_arrivals(decisions, self.tells_arrivals)
            action = torch.from_numpy(decisions.action.astype(np.int64)).to(self.world.device)
            happened = self.env.step(action)
            self.tally = self.tally.plus_step(happened)
            self._close_circles(decisions.certain)
            if decisions.arrived is not None:
                self._note_arrivals(decisions.arrived, happened.reached.cpu().numpy())
            if self.diary is not None:
                self.diary.append((self.walking, happened.state, action))
            self._drop_ended(happened)
        return self._table()

    def _close_circles(self, certain: np.ndarray | None) -> None:
        """Note who walks in a circle for ever, and add its rounds up to the limit, unless every step is recorded.

        Where what is seen varies, nobody does: the same pose and memory may lead elsewhere.
        """
        if certain is None or self.sight.varies:
            return
        known = {name: values for name, values in self.memory.items() if name != CHANCE}
        where = {**known, "standing in": self.env.state.cpu().numpy()}
        sure = torch.from_numpy(certain).to(self.world.device)
        tally, closed = self.loops.skip(where, self.tally, sure, self.step_limit)
        self.looped[self.walking[closed]] = True
        if self.diary is None:
            self.tally = tally

    def _note_arrivals(self, held: np.ndarray, reached: np.ndarray) -> None:
        """Count what an agent held (B,) bool before the step, nobody being at the target, and ask who is there now."""
        episode = self.walking.cpu().numpy()
        self.false_arrivals[episode] += held
        if reached.any():
            here = torch.from_numpy(np.flatnonzero(reached)).to(self.world.device)
            seen = self.sight.on_the_way(self.env.state[here], self.seeds[here], self.tally.steps[here])
            decisions, _ = self.agent.act(seen, rows(self.memory, reached))
            check_decisions(decisions, len(here))
            self.told_arrival[episode[reached]] = arrivals_of(decisions)

    def _drop_ended(self, happened: Transition) -> None:
        ended = happened.reached | (self.tally.steps >= self.step_limit)
        if not bool(ended.any()):
            return
        episode = self.walking[ended]
        self.reached[episode] = happened.reached[ended]
        self.final.write(episode, self.tally.at(ended))
        still = ~ended
        self.walking, self.tally, self.seeds = self.walking[still], self.tally.at(still), self.seeds[still]
        # There is no reset from here on, so the environment's start and target streams may keep their length.
        self.env.load_tensors({name: value[still] for name, value in self.env.tensors().items()})
        kept = still.cpu().numpy()
        self.memory = rows(self.memory, kept)
        self.loops.keep(kept)

    def _table(self) -> EpisodeTable:
        distance = self.world.distance_table()[self.target, self.start]
        return EpisodeTable(
            target=_array(self.target),
            start=_array(self.start),
            steps=_array(self.final.steps),
            collisions=_array(self.final.collisions),
            reached=_array(self.reached),
            shortest_path_steps=_array(distance),
            zone_steps=_array(self.final.zone_steps),
            looped=_array(self.looped),
            trajectories=None if self.diary is None else _trajectories(self.start, self.final.steps, self.diary),
            false_arrivals=self.false_arrivals if self.tells_arrivals else None,
            told_arrival=self.told_arrival if self.tells_arrivals else None,
        )


def _array(tensor: Tensor) -> np.ndarray:
    return tensor.cpu().numpy()


def _trajectories(start: Tensor, steps: Tensor, diary: list[tuple[Tensor, Tensor, Tensor]]) -> tuple[Trajectory, ...]:
    """Sort the pages of the diary, (episodes, states, actions) of each step, by episode."""
    episode, state, action = (_array(torch.cat(column)) for column in zip(*diary, strict=True))
    order = np.argsort(episode, kind="stable")
    ends = np.cumsum(_array(steps))[:-1]
    walks = zip(_array(start), np.split(state[order], ends), np.split(action[order], ends), strict=True)
    return tuple(Trajectory(np.concatenate([[first], states]), actions) for first, states, actions in walks)


def joined(parts: Sequence[EpisodeTable]) -> EpisodeTable:
    """Tables of one world as one, in their order."""

    def column(name: str) -> np.ndarray:
        return np.concatenate([getattr(part, name) for part in parts])

    walks = [part.trajectories for part in parts if part.trajectories is not None]
    tells = all(part.told_arrival is not None for part in parts)
    return EpisodeTable(
        target=column("target"),
        start=column("start"),
        steps=column("steps"),
        collisions=column("collisions"),
        reached=column("reached"),
        shortest_path_steps=column("shortest_path_steps"),
        zone_steps=column("zone_steps"),
        looped=column("looped"),
        trajectories=tuple(walk for part in walks for walk in part) if walks else None,
        false_arrivals=column("false_arrivals") if tells else None,
        told_arrival=column("told_arrival") if tells else None,
    )
