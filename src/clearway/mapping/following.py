"""`Follower`: keeps track of where an agent is and of the room around it, by what it sees and does.

Axis letters: B episodes, F features, G cells along a side of the lattice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from clearway.mapping.again import Repeats, marks_of
from clearway.mapping.beliefs import NEVER, LatticePose, add_sighting, add_standing, likeliest
from clearway.mapping.lattice import AHEAD, HEADINGS, nearest_bins
from clearway.mapping.room_map import RoomMap
from clearway.mapping.routes import shifted
from clearway.mapping.settings import MappingSettings
from clearway.mapping.sight import Sight
from clearway.perception.whereabouts import ELSEWHERE
from clearway.scenes.actions import Action

SURE = 12.0  # log-odds of what was tried
SURE_OF_MOVES = 1.5  # log-odds of a move, at most, before its outcome is seen
SAME, IF_SAME = 0.985, -7.0
"""Cosine of descriptions above which two pictures are the same, and evidence for a move where they are."""
IF_NOT_SAME = {Repeats.UNKNOWN: 3.0, Repeats.NEVER: 2.0, Repeats.ALWAYS: 16.0}
"""Evidence for a move where they are not: where pictures repeat, a blocked move shows the same one again."""
RECOGNISED = 20.0
"""Evidence for a pose whose picture was seen before, to the bit."""
STEPS = {Action.MOVE_FORWARD: 1, Action.MOVE_BACKWARD: -1}
QUARTERS = {Action.TURN_RIGHT: 1, Action.TURN_LEFT: -1}


def _bins_ahead(ahead_m: float) -> np.ndarray:
    return nearest_bins(np.array(ahead_m), np.zeros(()), np.zeros(()))


(STAYED,) = _bins_ahead(0.0).tolist()


class Follower:
    """Keeps track of B episodes, whose beliefs are arrays by name, see `begin`.

    Args:
        sight: compares features.
        settings: how things are weighed.
        known: what a tour of this room has found; None: the room is unknown.
    """

    def __init__(self, sight: Sight, settings: MappingSettings, known: RoomMap | None = None) -> None:
        self._sight, self._settings, self._known = sight, settings, known
        self._moved_bins = {action: _bins_ahead(steps * settings.step_m) for action, steps in STEPS.items()}
        if known is not None:
            self._described = sight.description(known.features.astype(np.float32))
            self._marks = marks_of(known.features)

    def begin(self, count: int) -> dict[str, np.ndarray]:
        """The beliefs of B episodes before anything was seen.

        `here` (B, 4, G, G) log of the probability of the own pose, but for a constant; `room` (B, G, G) log-odds that a
        body can stand in a cell; `shut` (B, 4, G, G) bool, a move out of a cell along a direction was blocked; `been`
        (B, 4, G, G) bool; `mark` (B, 4, G, G) uint32 of the picture seen in each pose, and `repeats` (B,) int8, see
        `again`; and of the last step `begun` (B,) bool, `seen` (B, F), `action` (B,) int64.
        """
        known, side = self._known, self._settings.side if self._known is None else len(self._known.room)
        here = np.full((count, HEADINGS, side, side), NEVER, np.float32)
        shut, been = np.zeros(here.shape, bool), np.zeros(here.shape, bool)
        room = np.full((count, side, side), self._settings.usual_room, np.float32)
        mark = np.zeros(here.shape, np.uint32)
        if known is None:
            here[:, 0, side // 2, side // 2] = 0
        else:
            room[:], shut[:] = known.room, known.shut
            here[np.broadcast_to(room[:, None] > 0, here.shape)] = 0
            mark[:, *known.taken.T] = self._marks
        return {
            "here": here,
            "room": room,
            "shut": shut,
            "been": been,
            "mark": mark,
            "repeats": np.full(count, Repeats.UNKNOWN, np.int8),
            "begun": np.zeros(count, bool),
            "seen": np.zeros((count, self._sight.feature_count), np.float32),
            "action": np.zeros(count, np.int64),
        }

    def follow(
        self, seen: np.ndarray, state: Mapping[str, np.ndarray]
    ) -> tuple[list[LatticePose], dict[str, np.ndarray]]:
        """Where B agents most likely stand, by features (B, F), and the beliefs now; `been` is as it was."""
        after = {name: state[name].copy() for name in ("here", "room", "shut", "been", "mark", "repeats")}
        here, room, mark, repeats = after["here"], after["room"], after["mark"], after["repeats"]
        marks = marks_of(seen)
        again = mark == marks[:, None, None, None]
        repeats[again.any(axis=(1, 2, 3))] = Repeats.ALWAYS
        self._walked(seen, state, after)
        here[again] += RECOGNISED
        if self._known is not None:
            self.sight_in_map(here, seen, self._settings.place_weight)
        here -= here.max(axis=(1, 2, 3), keepdims=True)
        np.maximum(here, NEVER, out=here)
        poses = [likeliest(belief) for belief in here]
        for row, (pose, stands) in enumerate(zip(poses, self._sight.stands(seen), strict=True)):
            if not after["been"][row][pose.index]:
                add_standing(room[row], pose, stands, self._settings.standing_weight, self._settings.lattice)
            room[row][pose.cell] = SURE
            if mark[row][pose.index] not in (0, marks[row]) and repeats[row] == Repeats.UNKNOWN:
                repeats[row] = Repeats.NEVER
            mark[row][pose.index] = marks[row]
        np.clip(room, -SURE, SURE, out=room)
        return poses, {**after, "begun": np.ones_like(state["begun"]), "seen": seen}

    def sight_in_map(self, belief: np.ndarray, seen: np.ndarray, weight: float) -> None:
        """Add to beliefs (B, 4, G, G) where pictures with features (B, F) were taken, by those of the tour."""
        known = self._known
        assert known is not None, "there was a tour"
        count = min(self._settings.compared, len(known.features))
        alike = self._sight.description(seen) @ self._described.T
        nearest = np.argsort(-alike, axis=1, kind="stable")[:, :count]
        kept = known.features[nearest.ravel()].astype(np.float32)
        told = self._sight.whereabouts(kept, np.repeat(seen, count, axis=0)).reshape(len(seen), count, ELSEWHERE)
        for row, numbers in enumerate(nearest):
            for place, number in enumerate(numbers):
                add_sighting(belief[row], known.pose(int(number)), told[row, place], weight, self._settings.lattice)

    def _walked(self, seen: np.ndarray, state: Mapping[str, np.ndarray], after: Mapping[str, np.ndarray]) -> None:
        """Move the beliefs of the own poses by the last actions; moves may have been blocked."""
        action = np.where(state["begun"], state["action"], -1)
        moving = np.flatnonzero(np.isin(action, list(STEPS)))
        before, now = state["seen"][moving], seen[moving]
        alike = (self._sight.description(before) * self._sight.description(now)).sum(axis=1) > SAME
        repeats = after["repeats"][moving] == Repeats.ALWAYS
        same = np.where(repeats, marks_of(before) == marks_of(now), alike)
        for row, evidence, stayed in zip(
            moving.tolist(), self._sight.whereabouts(before, now), same.tolist(), strict=True
        ):
            done, otherwise = Action(int(action[row])), IF_NOT_SAME[Repeats(int(after["repeats"][row]))]
            moved = float(evidence[self._moved_bins[done]].mean() - evidence[STAYED])
            moved += IF_SAME if stayed else otherwise
            self._moved(done, moved, {name: values[row] for name, values in after.items()})
        for row in np.flatnonzero(np.isin(action, list(QUARTERS))).tolist():
            after["here"][row] = np.roll(after["here"][row], QUARTERS[Action(int(action[row]))], axis=0)

    def _moved(self, action: Action, moved: float, belief: Mapping[str, np.ndarray]) -> None:
        """Change the beliefs of an episode by a move; `moved`: evidence that it was not blocked."""
        here, room, steps = belief["here"], belief["room"], STEPS[action]
        before = likeliest(here)
        beyond = before.moved(steps)
        usual = float(np.clip(room[beyond.cell], -SURE_OF_MOVES, SURE_OF_MOVES))
        moved += usual
        gone = np.stack([shifted(here[h], AHEAD[h] * steps, NEVER) for h in range(HEADINGS)])
        here[:] = np.logaddexp(gone - np.logaddexp(0, -moved), here - np.logaddexp(0, moved))
        if moved < 0:
            direction = before.heading if steps > 0 else before.turned(2).heading
            belief["shut"][direction, before.row, before.column] = True
            if room[beyond.cell] < SURE:
                room[beyond.cell] -= SURE / 2


def been_now(been: np.ndarray, poses: Sequence[LatticePose]) -> np.ndarray:
    """`been` (B, 4, G, G) with the poses that B agents stand in."""
    after = been.copy()
    for row, pose in enumerate(poses):
        after[row][pose.index] = True
    return after
