"""One episode off the grid, without its pictures: what an action does, what it earns, when it ends.

A step earns what `Reward.table` says of a table of two states, the pose that was left and the pose arrived in. Zones
and clearance are measured in the room (`Walker.zone`, `Body.gap_m`), and a contact is a blocked move.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from clearway.errors import EnvError
from clearway.live.arrangement import Arrangement
from clearway.live.body import Body
from clearway.live.conditions import REARRANGING, Perturbations
from clearway.live.draws import ENDS, Draws
from clearway.live.live_room import LiveRoom, layout_of_episode
from clearway.live.walker import Pose, Walker, near
from clearway.live_envs.arguments import CLEARANCE_REACH_M
from clearway.reward import Moves, Reward
from clearway.rooms.camera import Shot, first_person_shot
from clearway.scenes.actions import ACTION_COUNT, STOP, Action
from clearway.zones import Zone

LEFT, ARRIVED = 0, 1  # states of a step's table
End = int | Pose
"""A start or a target: a state of the scene, or a pose in the coordinates of the scene as it is kept."""


@dataclass(frozen=True)
class Rules:
    """What holds in all episodes of an environment.

    Attributes:
        reward: what is earned.
        step_m, turn_deg: what a move and a turn mean.
        success_m, success_deg: so near the target the agent has arrived.
        stop: an episode ends by the action `STOP`, not by itself.
        perturbations: how strong they are.
    """

    reward: Reward
    step_m: float
    turn_deg: float
    success_m: float
    success_deg: float
    stop: bool
    perturbations: Perturbations


@dataclass(frozen=True)
class LiveStep:
    """What a step did.

    Attributes:
        reward: earned.
        contact: the move ended at an obstacle.
        success: the target was reached; with `Rules.stop`, the agent stopped there.
        ended: the episode is over.
    """

    reward: float
    contact: bool
    success: bool
    ended: bool


class LiveEpisode:
    """The agent on its way to a target.

    Attributes:
        walker: where it is.
        target: the pose to reach, in the room.
        layout: of the room.
        zone: of where it is.
        clearance_m: of its body, to the nearest obstacle, at most CLEARANCE_REACH_M.
    """

    def __init__(self, walker: Walker, target: Pose, layout: Arrangement, rules: Rules) -> None:
        self.walker, self.target, self.layout, self.rules = walker, target, layout, rules
        self._look_around()

    @property
    def draws(self) -> Draws:
        """Its chances."""
        return self.walker.draws

    @property
    def distance_m(self) -> float:
        """To the target, as the crow flies."""
        return float(np.hypot(self.walker.pose[0] - self.target[0], self.walker.pose[1] - self.target[1]))

    def step(self, action: int | np.ndarray) -> LiveStep:
        """Take an action: one of `Action`, `STOP`, or speed and turn rate, (2,)."""
        zone, clearance_m = self.zone, self.clearance_m
        stops = isinstance(action, int) and action == STOP
        if stops:
            contact = False
        elif isinstance(action, int):
            contact = self.walker.act(Action(action)).contact
        else:
            contact = self.walker.drive(float(action[0]), float(action[1])).contact
        self._look_around()
        there = self.walker.is_at(self.target, self.rules.success_m, self.rules.success_deg)
        success = there and (stops or not self.rules.stop)
        moves = Moves(
            next_state=np.full((2, ACTION_COUNT), ARRIVED),
            blocked=np.full((2, ACTION_COUNT), contact),
            zone=np.array([zone, self.zone]),
            clearance_m=np.array([clearance_m, self.clearance_m]),
        )
        column = action if isinstance(action, int) and not stops else Action.MOVE_FORWARD
        earned = self.rules.reward.table(moves)[int(success), LEFT, column]
        return LiveStep(float(earned), contact, success, success or stops)

    def shot(self, camera_m: float, moving: bool) -> Shot:
        """The next picture, from a height; `moving`: the room's pieces may stand elsewhere than they were built."""
        height_m = camera_m + self.draws.height_error_m()
        pitch_deg = self.draws.pitch_error_deg()
        moved_m = self.layout.bodies_m if moving else ()
        return first_person_shot(*self.walker.pose, height_m=height_m, pitch_deg=pitch_deg, moved_m=moved_m)

    def _look_around(self) -> None:
        self.zone: Zone = self.walker.zone()
        self.clearance_m = max(0.0, self.walker.body.gap_m(CLEARANCE_REACH_M))


@dataclass(frozen=True)
class EpisodePlan:
    """An episode that has not begun.

    Attributes:
        draws: its chances.
        start, target: poses in the room.
    """

    draws: Draws
    start: Pose
    target: Pose


class Episodes:
    """New episodes in a room.

    Args:
        live: the room.
        rules: of the episodes.
        targets: states among which targets are drawn; None: all of the scene's largest component.

    Raises:
        EnvError: a target is no state of the component.
        SceneError: the perturbations move what cannot be moved in the room.
    """

    def __init__(self, live: LiveRoom, rules: Rules, targets: np.ndarray | None = None) -> None:
        live.check_can_be_rearranged(rules.perturbations)
        self.live, self.rules = live, rules
        self._states = np.flatnonzero(live.scene.components == 0)
        if targets is not None and not np.isin(targets, self._states).all():
            wrong = targets[~np.isin(targets, self._states)][0]
            raise EnvError(f"targets: {wrong} is not among the {len(self._states)} states of the scene's largest part")
        self._targets = self._states if targets is None else targets
        self.as_built = live.as_built()

    @property
    def moving(self) -> bool:
        """Whether the room's pieces may stand elsewhere than they were built."""
        return any(getattr(self.rules.perturbations, name) for name in REARRANGING)

    @cached_property
    def _poses(self) -> np.ndarray:
        """(S, 3) of all states."""
        return np.column_stack([self.live.scene.locations_m, self.live.scene.headings_deg])

    @cached_property
    def _measuring(self) -> Body:
        """A body in the room as it was built, to try poses."""
        return self._body(self.as_built)

    def planned(self, seed: int, *, target: End | None = None, start: End | None = None) -> EpisodePlan:
        """An episode to begin. No body moves for it.

        Args:
            seed: of all its chances.
            target: None: drawn.
            start: None: drawn from the poses that are not at the target already.

        Raises:
            EnvError: a start or target is unknown or in an obstacle, or they are at each other, whether given or drawn.
        """
        draws = Draws(seed, self.rules.perturbations)
        chances = draws.generator(ENDS).random(2)
        start_pose = None if start is None else self._pose("start", start)
        if target is not None:
            target_pose = self._pose("target", target)
        else:
            target_pose = self._drawn("target", self._targets, start_pose, chances[0])
        if start_pose is None:
            start_pose = self._drawn("start", self._states, target_pose, chances[1])
        elif near(start_pose, target_pose, self.rules.success_m, self.rules.success_deg):
            problem = f"the start is within success_m and success_deg of the target in {self.live.scene.name}"
            raise EnvError(f"options['start']: {problem}. Give ends farther apart")
        return EpisodePlan(draws, start_pose, target_pose)

    def begin(self, plan: EpisodePlan, last: LiveEpisode | None = None) -> LiveEpisode:
        """A new episode.

        Args:
            plan: of it.
            last: an episode that is over, whose body can be taken where the room is the same.
        """
        draws, start_pose, target_pose = plan.draws, plan.start, plan.target
        layout = self._layout(start_pose, target_pose, draws)
        body = last.walker.body if last and last.layout == layout else self._body(layout)
        walker = self._walker(body, start_pose, draws)
        if body.touches or self._blocks(layout, target_pose):  # a piece was moved to where an end between two cells is
            layout = self.as_built
            walker = self._walker(self._body(layout), start_pose, draws)
        return LiveEpisode(walker, target_pose, layout, self.rules)

    def _blocks(self, layout: Arrangement, pose: Pose) -> bool:
        """Whether moved furniture stands where the body would."""
        if layout == self.as_built:
            return False
        body = self._body(layout)
        body.stand_at(np.array(pose[:2]))
        return body.touches

    def _walker(self, body: Body, start: Pose, draws: Draws) -> Walker:
        rules = self.rules
        return Walker(body, start, draws, step_m=rules.step_m, turn_deg=rules.turn_deg, measured=False)

    def _layout(self, start: Pose, target: Pose, draws: Draws) -> Arrangement:
        if not self.moving:
            return self.as_built
        return layout_of_episode(self.live, self._nearest(start), self._nearest(target), draws)

    def _nearest(self, pose: Pose) -> int:
        """The state next to a pose."""
        apart_m = np.linalg.norm(self._poses[self._states, :2] - pose[:2], axis=1)
        return int(self._states[apart_m.argmin()])

    def _body(self, layout: Arrangement) -> Body:
        return self.live.body(layout)

    def _pose(self, name: str, end: End) -> Pose:
        """The pose in the room that an option means."""
        if isinstance(end, int):
            if end not in self._states:
                count = self.live.scene.state_count
                problem = f"state {end} is not in the largest part of {self.live.scene.name}"
                raise EnvError(f"options['{name}']: {problem}. Its states are among 0 to {count - 1}")
            return self.live.pose_of(end)
        pose = (end[0] - self.live.origin_m[0], end[1] - self.live.origin_m[1], end[2])
        self._measuring.stand_at(np.array(pose[:2]))
        if not self.live.is_on_floor(*pose[:2]) or self._measuring.touches:
            place = f"({end[0]:g}, {end[1]:g})"
            problem = f"the body does not fit at {place} in {self.live.scene.name}"
            raise EnvError(f"options['{name}']: {problem}. Give a place that is free, or a state of the scene")
        return pose

    def _drawn(self, name: str, states: np.ndarray, other: Pose | None, chance: float) -> Pose:
        """A state among some that is not at another pose already."""
        if other is not None:
            states = states[~near(self._poses[states], other, self.rules.success_m, self.rules.success_deg)]
        if not len(states):
            problem = f"every {name} in {self.live.scene.name} is within success_m and success_deg of the other end"
            raise EnvError(f"{problem}. Make them smaller, or give others")
        return self.live.pose_of(int(states[int(chance * len(states))]))
