from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.mapping.beliefs import IMPOSSIBLE, SEEN, LatticePose
from clearway.mapping.following import SURE, Follower, been_now, put_right
from clearway.mapping.lattice import AHEAD, HEADINGS, RIGHT
from clearway.mapping.routes import shifted
from clearway.mapping.settings import MappingSettings
from clearway.perception.around import PLACES_M
from clearway.scenes.actions import BLOCKED, Action
from helpers.made import corridor_scene, grid_scene
from helpers.perfect_sight import PerfectSight, seen_perfectly

SETTINGS = MappingSettings(side_m=15.0)


@pytest.mark.parametrize("seed", range(3))
def test_it_knows_where_it_is_and_which_moves_were_blocked(seed):
    scene = seen_perfectly(grid_scene(seed, width=7, depth=6, obstacle_share=0.3))
    follower = Follower(PerfectSight(scene), SETTINGS)
    rng = np.random.default_rng(seed)
    state = {**follower.begin(2)}
    here = rng.integers(scene.state_count, size=2)
    start, blocked = here.copy(), set()
    for _ in range(60):
        poses, after = follower.follow(scene.features[here], state)
        for row, pose in enumerate(poses):
            assert pose.index == lattice_index(scene, start[row], here[row]), "it lost itself"
        action = rng.integers(4, size=2)
        following = scene.graph[here, action]
        if following[0] == BLOCKED:
            away = action[0] if action[0] == 0 else 2
            blocked.add(((poses[0].heading + away) % HEADINGS, *poses[0].cell))
        here = np.where(following == BLOCKED, here, following)
        state = {**state, **after, "action": action}
    _, after = follower.follow(scene.features[here], state)
    assert blocked and {tuple(edge) for edge in np.argwhere(after["shut"][0]).tolist()} == blocked
    assert (after["room"][0] == SURE).sum() == len(visited(after["room"][0]))


@pytest.mark.parametrize("action", [Action.MOVE_FORWARD, Action.MOVE_BACKWARD])
def test_who_is_led_to_the_edge_of_its_lattice_changes_nothing_on_the_other_side(action):
    scene, settings = seen_perfectly(corridor_scene(9)), replace(SETTINGS, side_m=3.0)
    follower, here = Follower(PerfectSight(scene), settings), np.array([16])  # the middle, along the corridor
    state = {**follower.begin(1)}
    edge = settings.side // 2
    for _ in range(edge + 3):
        _, after = follower.follow(scene.features[here], state)
        state = {**state, **after, "action": np.array([int(action)])}
        following = scene.graph[here, action]
        here = np.where(following == BLOCKED, here, following)
    other_side = 0 if action == Action.MOVE_FORWARD else -1
    assert edge < 4 and state["room"][0][other_side, edge] >= settings.usual_room


class Hopeful(PerfectSight):
    """Whatever is ahead, it takes for free."""

    def stands(self, features):
        return np.full((len(features), len(PLACES_M)), 4.0, np.float32)


@pytest.mark.parametrize("last_look", [True, False])
def test_the_look_that_was_wrong_does_not_make_good_what_was_bumped_into(last_look):
    scene = seen_perfectly(grid_scene(0, width=5, depth=5))
    state = np.flatnonzero(scene.graph[:, Action.MOVE_FORWARD] == BLOCKED)[:1]
    follower = Follower(Hopeful(scene), SETTINGS, last_look=last_look)
    (pose,), after = follower.follow(scene.features[state], begun := follower.begin(1))
    ahead = pose.moved(1).cell
    assert after["room"][0][ahead] > 0
    told = {**begun, **after, "been": been_now(after["been"], [pose]), "action": np.array([int(Action.MOVE_FORWARD)])}
    _, after = follower.follow(scene.features[state], told)
    assert after["shut"][0][pose.index] and after["room"][0][ahead] < -SEEN
    beside = scene.graph[state, Action.TURN_LEFT]
    _, after = follower.follow(scene.features[beside], {**told, **after, "action": np.array([int(Action.TURN_LEFT)])})
    assert after["room"][0][ahead] < -SEEN


def errs_and_goes_on(seed: int, *, pictures: int) -> tuple[list[bool], dict[str, np.ndarray]]:
    """Whether a follower's pose is right at each step of a walk, in the middle of which its belief slips by a cell."""
    scene = seen_perfectly(grid_scene(seed, width=7, depth=6, obstacle_share=0.2))
    follower = Follower(PerfectSight(scene), SETTINGS, pictures=pictures)
    rng = np.random.default_rng(seed)
    state, here = follower.begin(1), rng.integers(scene.state_count, size=1)
    start, right = int(here[0]), []
    for step in range(90):
        seen = scene.features[here].copy()
        seen[:, 3] += 0.01 * step
        poses, after = follower.follow(seen, state)
        right.append(poses[0].index == lattice_index(scene, start, int(here[0])))
        action = rng.integers(4, size=1)
        following = scene.graph[here, action]
        here = np.where(following == BLOCKED, here, following)
        state = {**state, **after, "been": been_now(state["been"], poses), "action": action}
        if step == 60:
            slipped = shifted(state["here"], AHEAD[0], IMPOSSIBLE)
            state["here"] = np.logaddexp(slipped, state["here"] - 8)
    return right, state


@pytest.mark.parametrize("seed", range(3))
def test_it_finds_itself_again_by_pictures_that_it_has_taken(seed):
    right, _ = errs_and_goes_on(seed, pictures=64)
    assert all(right[:61]) and all(right[-15:])


@pytest.mark.parametrize("seed", range(3))
def test_without_pictures_taken_an_error_stays(seed):
    right, _ = errs_and_goes_on(seed, pictures=0)
    assert all(right[:61]) and not any(right[-15:])


def test_it_keeps_one_picture_a_pose_and_so_many_at_most():
    _, state = errs_and_goes_on(0, pictures=12)
    taken, features = state["taken"][0], state["features"][0]
    assert state["count"][0] == 12 == len({tuple(pose) for pose in taken.tolist()}) and features.all(axis=1).any()
    assert tuple(taken[0]) == (0, 15, 15)


def kept_at(pose: LatticePose, mark: int) -> dict[str, np.ndarray]:
    """One picture, held to be taken in a pose."""
    kept = {"mark": np.zeros((4, 9, 9), np.uint32), "taken": np.zeros((3, 3), np.int64), "count": np.array(1)}
    kept["mark"][pose.index], kept["taken"][0] = mark, pose.index
    return kept


@pytest.mark.parametrize(
    ("now", "action", "origin"),
    [
        (LatticePose(2, 4, 5), Action.TURN_RIGHT, LatticePose(1, 4, 5)),
        (LatticePose(1, 2, 2), Action.MOVE_FORWARD, LatticePose(1, 2, 2).moved(-1)),
    ],
)
def test_a_picture_held_to_be_elsewhere_is_put_where_the_next_pose_says_that_it_was_taken(now, action, origin):
    wrong = LatticePose(1, 4, 4)
    kept = kept_at(wrong, 7)
    put_right(wrong, now, action, kept)
    assert kept["mark"][origin.index] == 7 and kept["mark"][wrong.index] == 0
    assert tuple(kept["taken"][0]) == origin.index


@pytest.mark.parametrize(
    ("now", "action"),
    [
        (LatticePose(2, 4, 4), Action.TURN_RIGHT),
        (LatticePose(1, 4, 4), Action.MOVE_FORWARD),
        (LatticePose(1, 4, 4).moved(1), Action.MOVE_FORWARD),
        (LatticePose(1, 4, 4).moved(-1), Action.MOVE_BACKWARD),
    ],
)
def test_a_picture_stays_where_the_next_pose_follows_from_its_own(now, action):
    before = LatticePose(1, 4, 4)
    kept = kept_at(before, 7)
    put_right(before, now, action, kept)
    assert kept["mark"][before.index] == 7 and tuple(kept["taken"][0]) == before.index


def test_a_picture_that_would_lie_outside_stays_where_it_is():
    before, now = LatticePose(0, 4, 4), LatticePose(0, 0, 4)
    kept = kept_at(before, 7)
    assert not 0 <= now.moved(-1).row < 9
    put_right(before, now, Action.MOVE_FORWARD, kept)
    assert kept["mark"][before.index] == 7


def visited(room: np.ndarray) -> np.ndarray:
    return np.argwhere(room >= SURE)


def lattice_index(scene, start: int, here: int) -> tuple[int, int, int]:
    """The pose on the lattice of a state, of a walk that began in another."""
    turns = (np.array([scene.headings_deg[start], scene.headings_deg[here]]) // 90).astype(int)
    cells = np.rint((scene.locations_m[here] - scene.locations_m[start]) / 0.5).astype(int)
    steps = np.array([[0, 1], [1, 0], [0, -1], [-1, 0]])  # x and z of a step ahead, by heading
    ahead, right = cells @ steps[turns[0]], cells @ steps[(turns[0] + 1) % 4]
    row, column = np.array([15, 15]) + ahead * AHEAD[0] + right * RIGHT[0]
    return (turns[1] - turns[0]) % 4, row, column
