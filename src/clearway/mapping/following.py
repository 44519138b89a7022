"""`Follower`: keeps track of where an agent is and of the room around it, by what it sees and does.

Axis letters: B episodes, F features, G cells along a side of the lattice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from clearway.mapping import beliefs
from clearway.mapping.again import ALWAYS, NEVER, UNKNOWN, marks_of
from clearway.mapping.beliefs import LatticePose, add_standing, likeliest
from clearway.mapping.lattice import AHEAD, HEADINGS
from clearway.mapping.moves import SAME, SURE_OF_MOVES, evidence_for_move, moved_bins
from clearway.mapping.pictures import Pictures, add_places
from clearway.mapping.room_map import RoomMap
from clearway.mapping.routes import shifted
from clearway.mapping.settings import MappingSettings
from clearway.mapping.sight import Sight
from clearway.mapping.walk import QUARTERS, STEPS
from clearway.scenes.actions import Action

SURE = 12.0  # log-odds of what was tried
BUMPED = SURE / 2  # log-odds that a blocked move takes from the cell before it
KEPT, LATEST = 64, 2
"""Pictures that are kept of a walk, and how many of the last ones say nothing of the pose: they share its errors."""
RECOGNISED = 20.0
"""Evidence for a pose whose picture was seen before, to the bit."""
CERTAIN = 100.0
"""Evidence for a pose of which a tour has taken the very picture: more than eyes could bring together."""
CHANGED = ("here", "room", "shut", "been", "mark", "repeats", "count", "taken", "features")
KEPT_AT = ("mark", "taken", "count")


class Follower:
    """Keeps track of B episodes, whose beliefs are arrays by name, see `begin`.

    Args:
        sight: compares features.
        settings: how things are weighed.
        known: what a tour of this room has found; None: the room is unknown.
        pictures: N, that are kept of a walk in an unknown room, one of each of the first poses; else none are.
        last_look: of the cell ahead the last look tells all, see `add_standing`.
    """

    def __init__(
        self,
        sight: Sight,
        settings: MappingSettings,
        known: RoomMap | None = None,
        pictures: int = KEPT,
        *,
        last_look: bool = False,
    ) -> None:
        self._sight, self._settings, self._known = sight, settings, known
        self._last_look = last_look and bool(settings.lattice.next_ahead.any())
        self._moved_bins = moved_bins(settings)
        self._pictures = pictures if known is None else 0
        if known is not None:
            self._toured = Pictures.of(known.taken, known.features, sight)
            self._marks = marks_of(known.features)

    def begin(self, count: int) -> dict[str, np.ndarray]:
        """The beliefs of B episodes before anything was seen.

        `here` (B, 4, G, G) log of the probability of the own pose, but for a constant; `room` (B, G, G) log-odds that a
        body can stand in a cell; `shut` (B, 4, G, G) bool, a move out of a cell along a direction was blocked; `been`
        (B, 4, G, G) bool; `mark` (B, 4, G, G) uint32 of the picture seen in each pose, and `repeats` (B,) int8, see
        `again`; `count` (B,) int64 pictures that were kept, `taken` (B, N, 3) int64 their poses and `features`
        (B, N, F) float16; and of the last step `begun` (B,) bool, `seen` (B, F), `action` (B,) int64.
        """
        known, side = self._known, self._settings.side if self._known is None else len(self._known.room)
        here = np.full((count, HEADINGS, side, side), beliefs.IMPOSSIBLE, np.float32)
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
            "repeats": np.full(count, UNKNOWN, np.int8),
            "count": np.zeros(count, np.int64),
            "taken": np.zeros((count, self._pictures, 3), np.int64),
            "features": np.zeros((count, self._pictures, self._sight.feature_count), np.float16),
            "begun": np.zeros(count, bool),
            "seen": np.zeros((count, self._sight.feature_count), np.float32),
            "action": np.zeros(count, np.int64),
        }

    def follow(
        self, seen: np.ndarray, state: Mapping[str, np.ndarray]
    ) -> tuple[list[LatticePose], dict[str, np.ndarray]]:
        """Where B agents most likely stand, by features (B, F), and the beliefs now; `been` is as it was."""
        after = {name: state[name].copy() for name in CHANGED}
        here, room, mark, repeats = after["here"], after["room"], after["mark"], after["repeats"]
        marks = marks_of(seen)
        again = mark == marks[:, None, None, None]
        before = [likeliest(belief) for belief in here]
        repeats[:] = np.minimum(repeats + again.any(axis=(1, 2, 3)), ALWAYS)
        self._walked(seen, state, after)
        here[again] += RECOGNISED
        if self._known is not None:
            self.sight_in_map(here, seen, self._settings.place_weight)
        else:
            self._sight_again(here, seen, after)
        here -= here.max(axis=(1, 2, 3), keepdims=True)
        np.maximum(here, beliefs.IMPOSSIBLE, out=here)
        poses = [likeliest(belief) for belief in here]
        for row in np.flatnonzero(state["begun"]).tolist():
            kept = {name: after[name][row] for name in KEPT_AT}
            put_right(before[row], poses[row], Action(int(state["action"][row])), kept)
        for row, (pose, stands) in enumerate(zip(poses, self._sight.stands(seen), strict=True)):
            weight = 0.0 if after["been"][row][pose.index] else self._settings.standing_weight  # the same look again
            add_standing(room[row], pose, stands, weight, self._settings.lattice, last_look=self._last_look)
            room[row][pose.cell] = SURE
            if mark[row][pose.index] not in (0, marks[row]):
                repeats[row] = NEVER
            mark[row][pose.index] = marks[row]
            number = int(after["count"][row])
            if number < self._pictures and not after["been"][row][pose.index]:
                after["taken"][row, number], after["features"][row, number] = pose.index, seen[row]
                after["count"][row] += 1
        np.clip(room, -SURE, SURE, out=room)
        return poses, {**after, "begun": np.ones_like(state["begun"]), "seen": seen}

    def go_by(self, known: RoomMap, after: dict[str, np.ndarray], row: int) -> LatticePose:
        """Change the beliefs of an episode to what a map of its walk tells, whose last picture is the one seen now.

        Returns:
            The pose of that picture.
        """
        taken, here = known.taken, after["here"][row]
        after["room"][row], after["shut"][row] = known.room, known.shut
        now = LatticePose(*taken[-1].tolist())
        here[:] = beliefs.IMPOSSIBLE
        here[now.index] = 0
        been, mark = after["been"][row], after["mark"][row]
        been[:], mark[:] = False, 0
        been[*taken.T], mark[*taken.T] = True, marks_of(known.features)
        _, first = np.unique(taken, axis=0, return_index=True)
        kept = np.sort(first)[: self._pictures]
        after["count"][row] = len(kept)
        after["taken"][row, : len(kept)], after["features"][row, : len(kept)] = taken[kept], known.features[kept]
        return now

    def sight_in_map(self, belief: np.ndarray, seen: np.ndarray, weight: float) -> None:
        """Add to beliefs (B, 4, G, G) where pictures with features (B, F) were taken, by those of the tour."""
        assert self._known is not None, "there was a tour"
        add_places(list(belief), seen, [self._toured] * len(seen), self._sight, self._settings, weight)

    def recognise(self, belief: np.ndarray, seen: np.ndarray) -> None:
        """Add to beliefs (B, 4, G, G) where pictures with features (B, F) were taken, if a tour took the very same."""
        known = self._known
        assert known is not None, "there was a tour"
        rows, numbers = np.nonzero(marks_of(seen)[:, None] == self._marks)
        belief[rows, *known.taken[numbers].T] += CERTAIN

    def _sight_again(self, belief: np.ndarray, seen: np.ndarray, after: Mapping[str, np.ndarray]) -> None:
        """Add to beliefs (B, 4, G, G) where pictures (B, F) were taken, by those kept, where pictures do not repeat."""
        count = after["count"] - LATEST
        asked = np.flatnonzero((count > 0) & (after["repeats"] < UNKNOWN)).tolist()
        if asked:
            kept = []
            for row in asked:
                taken, features = (after[name][row, : count[row]] for name in ("taken", "features"))
                kept.append(Pictures.of(taken, features, self._sight))
            own, settings = [belief[row] for row in asked], self._settings
            add_places(own, seen[asked], kept, self._sight, settings, settings.place_weight)

    def _walked(self, seen: np.ndarray, state: Mapping[str, np.ndarray], after: Mapping[str, np.ndarray]) -> None:
        """Move the beliefs of the own poses by the last actions; moves may have been blocked."""
        action = np.where(state["begun"], state["action"], -1)
        moving = np.flatnonzero(np.isin(action, list(STEPS)))
        before, now = state["seen"][moving], seen[moving]
        alike = (self._sight.description(before) * self._sight.description(now)).sum(axis=1) > SAME
        repeats = after["repeats"][moving] == ALWAYS
        same = np.where(repeats, marks_of(before) == marks_of(now), alike)
        for row, evidence, stayed in zip(
            moving.tolist(), self._sight.whereabouts(before, now), same.tolist(), strict=True
        ):
            done = Action(int(action[row]))
            moved = evidence_for_move(evidence, self._moved_bins[done], stayed, int(after["repeats"][row]))
            self._moved(done, moved, {name: values[row] for name, values in after.items()})
        for row in np.flatnonzero(np.isin(action, list(QUARTERS))).tolist():
            after["here"][row] = np.roll(after["here"][row], QUARTERS[Action(int(action[row]))], axis=0)

    def _moved(self, action: Action, moved: float, belief: Mapping[str, np.ndarray]) -> None:
        """Change the beliefs of an episode by a move; `moved`: evidence that it was not blocked."""
        here, room, steps = belief["here"], belief["room"], STEPS[action]
        before = likeliest(here)
        beyond = before.moved(steps)
        inside = max(beyond.cell) < len(room) and min(beyond.cell) >= 0  # else others have led it to the lattice's edge
        room_there = room[beyond.cell] if inside else self._settings.usual_room
        usual = float(np.clip(room_there, -SURE_OF_MOVES, SURE_OF_MOVES))
        moved += usual
        gone = np.stack([shifted(here[h], AHEAD[h] * steps, beliefs.IMPOSSIBLE) for h in range(HEADINGS)])
        here[:] = np.logaddexp(gone - np.logaddexp(0, -moved), here - np.logaddexp(0, moved))
        if moved < 0:
            direction = before.heading if steps > 0 else before.turned(2).heading
            belief["shut"][direction, before.row, before.column] = True
            if inside and room[beyond.cell] < SURE:
                room[beyond.cell] -= BUMPED
                if self._last_look:  # else the same look would make good again what was bumped into
                    room[beyond.cell] = min(room[beyond.cell], beliefs.NO_ROOM)


def put_right(before: LatticePose, now: LatticePose, action: Action, kept: Mapping[str, np.ndarray]) -> None:
    """Put the last picture where it was taken, where the pose held `now` is none to which the one `before` leads.

    Else it would lead back to the wrong pose whenever it comes again, and this one's picture away from there, for good.

    Args:
        before, now: likeliest poses before and after the action.
        action: of the last step.
        kept: `mark`, `taken` and `count` of the episode, see `Follower.begin`; changed.
    """
    mark, count = kept["mark"], int(kept["count"])
    turned = action in QUARTERS
    origins = [now.turned(-QUARTERS[action])] if turned else [now.moved(-STEPS[action]), now]
    origin, side = origins[0], mark.shape[-1]
    if before in origins or not (0 <= origin.row < side and 0 <= origin.column < side):
        return
    mark[origin.index], mark[before.index] = mark[before.index], 0
    if count and tuple(kept["taken"][count - 1]) == before.index:
        kept["taken"][count - 1] = origin.index


def been_now(been: np.ndarray, poses: Sequence[LatticePose]) -> np.ndarray:
    """`been` (B, 4, G, G) with the poses that B agents stand in."""
    after = been.copy()
    for row, pose in enumerate(poses):
        after[row][pose.index] = True
    return after
