from __future__ import annotations

import numpy as np

from clearway.mapping.again import ALWAYS, NEVER, marks_of
from clearway.mapping.following import Follower
from clearway.mapping.moves import STAYED
from clearway.mapping.settings import MappingSettings
from clearway.scenes.actions import Action
from helpers.made import corridor_scene
from helpers.perfect_sight import PerfectSight, seen_perfectly

SETTINGS = MappingSettings(side_m=15.0)


class Undecided(PerfectSight):
    """Eyes that hold every move for blocked."""

    def whereabouts(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        found = super().whereabouts(first, second)
        found[:, STAYED] = found.max(axis=1, initial=0) + 5
        return found


class Telling(Undecided):
    """Such eyes, which at least tell pictures of neighbouring cells apart."""

    def description(self, features: np.ndarray) -> np.ndarray:
        return super().description(features * np.array([6, 6, 1, 1], np.float32))


def walked(actions: list[Action], *, noise: bool, eyes: type[PerfectSight] = Undecided) -> list[tuple[np.ndarray, int]]:
    """What a follower holds of itself after each step in a corridor: its cell, and whether pictures repeat."""
    scene = seen_perfectly(corridor_scene(6))
    follower = Follower(eyes(scene), SETTINGS)
    state, here, found = follower.begin(1), 0, []
    for step, action in enumerate([*actions, Action.TURN_RIGHT]):
        seen = scene.features[[here]] + (0.001 * step if noise else 0.0)
        poses, after = follower.follow(seen.astype(np.float32), state)
        found.append((np.array(poses[0].cell), int(after["repeats"][0])))
        state = {**state, **after, "action": np.array([int(action)])}
        here = here if scene.graph[here, action] < 0 else int(scene.graph[here, action])
    return found


def test_marks_tell_pictures_apart_and_know_them_again():
    features = np.random.default_rng(0).normal(size=(50, 8)).astype(np.float32)
    marks = marks_of(features)
    assert marks.dtype == np.uint32 and marks.all() and len(set(marks.tolist())) == 50
    assert marks_of(features.astype(np.float16)).tolist() == marks.tolist()


def test_pictures_that_came_again_say_that_they_repeat_and_then_another_one_is_a_move():
    about = [Action.TURN_RIGHT] * 6 + [Action.TURN_LEFT] * 2
    found = walked([*about, *[Action.MOVE_FORWARD] * 2], noise=False)
    assert [repeats for _, repeats in found] == [0, 0, 0, 0, 1, 2] + [ALWAYS] * 5
    assert np.abs(found[-1][0] - found[0][0]).sum() == 2


def test_where_a_pose_shows_another_picture_they_never_repeat_and_eyes_decide():
    found = walked([Action.TURN_RIGHT] * 4 + [Action.MOVE_FORWARD] * 2, noise=True)
    assert [repeats for _, repeats in found] == [0] * 4 + [NEVER] * 3
    assert np.abs(found[-1][0] - found[0][0]).sum() == 0, "these eyes hold every move for blocked"


def test_as_long_as_nothing_is_known_of_pictures_another_one_outweighs_eyes_that_hold_a_move_for_blocked():
    found = walked([Action.MOVE_FORWARD], noise=False, eyes=Telling)
    assert np.abs(found[-1][0] - found[0][0]).sum() == 1


def test_a_pose_that_shows_another_picture_says_so_even_where_they_came_again_before():
    scene = seen_perfectly(corridor_scene(6))
    follower = Follower(PerfectSight(scene), SETTINGS)
    state, found, here = follower.begin(1), [], 0
    for step in range(9):
        noise = 0.001 if step == 8 else 0.0
        _, after = follower.follow(scene.features[[here]] + np.float32(noise), state)
        found.append(int(after["repeats"][0]))
        state = {**state, **after, "action": np.array([int(Action.TURN_RIGHT)])}
        here = int(scene.graph[here, Action.TURN_RIGHT])
    assert found[:7] == [0, 0, 0, 0, 1, 2, ALWAYS] and found[-1] == NEVER
