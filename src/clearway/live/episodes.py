"""Episodes in the live room, walked side by side: picture, agent, body, step by step.

Starts, targets and the chances of sampled actions are those of the evaluation on the grid (`evaluation.episodes`):
without perturbations an episode is the same here and there up to its first contact.

Axis letters: N episodes, B of them still walking.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from torch import Tensor

from clearway.agents.agent import FEATURES, Agent, Observation, State, rows
from clearway.agents.answers import arrivals_of, check_decisions, check_state, tells_arrivals
from clearway.agents.selection import Argmax
from clearway.errors import AgentError
from clearway.evaluation.episodes import episode_seeds
from clearway.live.arrangement import Arrangement
from clearway.live.body import SAMPLES, Motion
from clearway.live.conditions import Perturbations
from clearway.live.draws import Draws
from clearway.live.live_room import LiveRoom, layout_of_episode
from clearway.live.walker import Walker, success_radius_m
from clearway.reward import COLLISION_AWARE
from clearway.rooms.camera import Shot, first_person_shot
from clearway.rooms.render import Camera
from clearway.scenes.actions import Action
from clearway.scenes.sensors import RGB
from clearway.world.navigation import Navigation
from clearway.world.world import World

LiveSelection = Literal["sampled", "argmax"]
SUCCESS_DEG = 45.0
"""A target is reached when the body looks its way within so much, and stands within `walker.success_radius_m` of it."""
NEAR_M, CLOSE_M = 0.3, 0.1
STEP_S = 1.0  # a step takes so long, move or turn


@dataclass(frozen=True, eq=False)
class LiveTable:
    """What happened in N episodes in a room.

    Attributes:
        target: (N,) int64, index of the world's target, ascending.
        start: (N,) int64, first state in the scene's numbering.
        seed: (N,) int64, of the episode's `Draws`.
        steps: (N,) int64, steps taken; the limit where the target was not reached.
        contacts: (N,) int64, moves that ended at an obstacle.
        reached: (N,) bool, the target was reached before the limit.
        shortest_path_steps: (N,) int64, fewest steps on the grid as it was built.
        least_gap_m: (N,) float64, smallest distance between the body and an obstacle.
        mean_gap_m: (N,) float64, its mean over time, every distance counted up to `body.REACH_M`.
        close_s, near_s: (N,) float64, time within CLOSE_M and within NEAR_M of an obstacle, seconds.
        changed: (N,) bool, the room was arranged otherwise than it was built.
        layouts: of every episode.
        walks: of every episode, (T + 1, 3): x, z, heading in degrees.
        false_arrivals: (N,) int64, steps at which the agent held wrongly that it was at the target; None where it says
            nothing of it.
        told_arrival: (N,) bool, it held so where it was; None likewise.
    """

    target: np.ndarray
    start: np.ndarray
    seed: np.ndarray
    steps: np.ndarray
    contacts: np.ndarray
    reached: np.ndarray
    shortest_path_steps: np.ndarray
    least_gap_m: np.ndarray
    mean_gap_m: np.ndarray
    close_s: np.ndarray
    near_s: np.ndarray
    changed: np.ndarray
    layouts: tuple[Arrangement, ...]
    walks: tuple[np.ndarray, ...]
    false_arrivals: np.ndarray | None = None
    told_arrival: np.ndarray | None = None

    def __len__(self) -> int:
        """N."""
        return len(self.target)


@dataclass(frozen=True)
class LiveProtocol:
    """How episodes are walked.

    Attributes:
        episodes_per_target: how many.
        step_limit: steps after which an episode has failed.
        seed: of starts, actions and perturbations.
        selection: how actions are chosen by the agent's probabilities.
    """

    episodes_per_target: int
    step_limit: int
    seed: int
    selection: LiveSelection


def run_live_episodes(
    live: LiveRoom,
    world: World,
    agent: Agent,
    camera: Camera,
    perturbations: Perturbations,
    protocol: LiveProtocol,
    show_steps: Callable[[int], None] | None = None,
) -> LiveTable:
    """Walk episodes to every target of one scene.

    Args:
        live: the room.
        world: of the room's scene alone.
        agent: who walks, by colour pictures.
        camera: takes pictures of `live.model`.
        perturbations: what is different from the grid.
        protocol: how many episodes, how long, and so on.
        show_steps: called after every step with the number of episodes still walking.

    Raises:
        AgentError: the agent sees something else than colour pictures, or answers what no agent may.
        SceneError: perturbations move what cannot be moved in the room.
    """
    check_sight(agent)
    live.check_can_be_rearranged(perturbations)
    target = torch.arange(world.target_count).repeat_interleave(protocol.episodes_per_target)
    seeds = episode_seeds(world, protocol.episodes_per_target, protocol.seed)
    env = Navigation(world, COLLISION_AWARE, seeds, history_length=1)
    env.reset(target=target)
    walkers = [
        Walking(live, int(start), int(world.target_state[goal]), Draws(int(seed), perturbations))
        for start, goal, seed in zip(env.state, target, seeds, strict=True)
    ]
    agent = Argmax(agent) if protocol.selection == "argmax" else agent
    walking = np.arange(len(walkers))
    memory = agent.reset(_wanted(live, world, target), seeds.numpy())
    check_state(memory, len(walkers))
    tells: bool | None = None
    for _ in range(protocol.step_limit):
        decisions, memory = agent.act(shown(agent, [walkers[episode] for episode in walking], camera), memory)
        check_decisions(decisions, len(walking))
        check_state(memory, len(walking))
        tells = tells_arrivals(decisions, tells)
        for episode, action in zip(walking, decisions.action.tolist(), strict=True):
            walkers[episode].act(Action(action))
        still = np.array([not walkers[episode].reached for episode in walking])
        if decisions.arrived is not None:
            _note_arrivals(agent, [walkers[episode] for episode in walking], camera, memory, decisions.arrived)
        walking, memory = walking[still], rows(memory, still)
        if show_steps is not None:
            show_steps(len(walking))
        if not len(walking):
            break
    distance = world.distance_table()[target, env.state].numpy()
    return _table(walkers, target.numpy(), distance, tells_arrivals=bool(tells))


class Walking:
    """One episode: the body in its layout of the room, and what has happened so far.

    Args:
        live: the room.
        start, target: states of its scene.
        draws: the chances of the episode.
    """

    def __init__(self, live: LiveRoom, start: int, target: int, draws: Draws) -> None:
        scene = live.scene
        self.live, self.start, self.draws = live, start, draws
        self.layout = layout_of_episode(live, start, target, draws)
        body = live.body(self.layout)
        self.walker = Walker(body, live.pose_of(start), draws, step_m=scene.cell_size_m, turn_deg=scene.turn_deg)
        self.target, self._within_m = live.pose_of(target), success_radius_m(scene.cell_size_m)
        self.changed = self.layout != live.as_built()
        self.steps: list[Motion] = []
        self.walk = [self.walker.pose]
        self.false_arrivals, self.told_arrival = 0, False

    def act(self, action: Action) -> None:
        """Take a step."""
        self.steps.append(self.walker.act(action))
        self.walk.append(self.walker.pose)

    @property
    def reached(self) -> bool:
        """The body is at the target and looks its way."""
        return self.walker.is_at(self.target, self._within_m, SUCCESS_DEG)

    def shot(self) -> Shot:
        """The next picture."""
        height_m, pitch_deg = self.live.camera_m + self.draws.height_error_m(), self.draws.pitch_error_deg()
        moved_m = self.live.bodies_m(self.layout)
        return first_person_shot(*self.walker.pose, height_m=height_m, pitch_deg=pitch_deg, moved_m=moved_m)


def check_sight(agent: Agent) -> None:
    """Raise AgentError where an agent sees something else than colour pictures."""
    if others := set(agent.sees) - {RGB}:
        problem = f"the agent sees {', '.join(sorted(others))}, and live walks take colour pictures"
        raise AgentError(f"{problem}. Evaluate on the grid: clearway evaluate")


def _wanted(live: LiveRoom, world: World, target: Tensor) -> Observation:
    """What is seen at the targets (N,): the scene's pictures and features, as far as it has them."""
    state = world.target_state[target]
    found: dict[str, np.ndarray] = {}
    if live.scene.observations is not None:
        pictures, place = np.unique(state.numpy(), return_inverse=True)
        found[RGB] = np.stack([live.scene.observations[pose] for pose in pictures.tolist()])[place]
    if world.features is not None:
        found[FEATURES] = world.features[state].numpy()
    return found


def shown(agent: Agent, walkers: Sequence[Walking], camera: Camera) -> Observation:
    """What an agent is given to see of its episodes (B)."""
    return {RGB: _seen(walkers, camera)} if RGB in agent.sees else {}


def _note_arrivals(agent: Agent, walkers: Sequence[Walking], camera: Camera, memory: State, held: np.ndarray) -> None:
    """Count what an agent held (B,) bool before the step, nobody being at the target, and ask who is there now."""
    for walker, wrongly in zip(walkers, held.tolist(), strict=True):
        walker.false_arrivals += wrongly
    there = np.flatnonzero([walker.reached for walker in walkers])
    if len(there):
        arrived = [walkers[index] for index in there.tolist()]
        decisions, _ = agent.act(shown(agent, arrived, camera), rows(memory, there))
        check_decisions(decisions, len(there))
        for walker, told in zip(arrived, arrivals_of(decisions).tolist(), strict=True):
            walker.told_arrival = told


def _seen(walkers: Sequence[Walking], camera: Camera) -> np.ndarray:
    """Pictures (B, height, width, 3) uint8 of what each sees."""
    pictures = camera([walker.shot() for walker in walkers])
    return np.stack([walker.draws.seen(picture) for walker, picture in zip(walkers, pictures, strict=True)])


def _table(walkers: list[Walking], target: np.ndarray, distance: np.ndarray, *, tells_arrivals: bool) -> LiveTable:
    gaps_m = [np.concatenate([step.gaps_m for step in walker.steps]) for walker in walkers]
    sample_s = STEP_S / SAMPLES
    return LiveTable(
        target=target,
        start=np.array([walker.start for walker in walkers]),
        seed=np.array([walker.draws.seed for walker in walkers]),
        steps=np.array([len(walker.steps) for walker in walkers]),
        contacts=np.array([sum(step.contact for step in walker.steps) for walker in walkers]),
        reached=np.array([walker.reached for walker in walkers]),
        shortest_path_steps=distance,
        least_gap_m=np.array([gaps.min() for gaps in gaps_m]),
        mean_gap_m=np.array([gaps.mean() for gaps in gaps_m]),
        close_s=np.array([sample_s * (gaps < CLOSE_M).sum() for gaps in gaps_m]),
        near_s=np.array([sample_s * (gaps < NEAR_M).sum() for gaps in gaps_m]),
        changed=np.array([walker.changed for walker in walkers]),
        layouts=tuple(walker.layout for walker in walkers),
        walks=tuple(np.array(walker.walk) for walker in walkers),
        false_arrivals=np.array([walker.false_arrivals for walker in walkers]) if tells_arrivals else None,
        told_arrival=np.array([walker.told_arrival for walker in walkers]) if tells_arrivals else None,
    )
