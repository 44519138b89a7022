"""Poses of a whole walk: later pictures put right what earlier ones left in doubt."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.mapping.beliefs import LatticePose
from clearway.mapping.charting import charted
from clearway.mapping.following import BUMPED
from clearway.mapping.moves import STAYED, evidence_for_moves
from clearway.mapping.settings import MappingSettings
from clearway.mapping.smoothing import LEAST, _clearly_more, _compared, _pairs, smoothed
from clearway.mapping.walk import QUARTERS, STEPS, Walk
from clearway.perception.whereabouts import bin_of
from clearway.scenes.actions import BLOCKED, Action
from helpers.made import grid_scene
from helpers.perfect_sight import PerfectSight, seen_perfectly

SETTINGS = MappingSettings(side_m=15.0)
AHEAD_BIN = int(bin_of(np.array([0.5]), np.zeros(1), np.zeros(1))[0])


class Deceived(PerfectSight):
    """Takes some moves for blocked, and some blocked ones for moves: those after pictures that are marked."""

    def whereabouts(self, first, second):
        found = super().whereabouts(np.abs(first), np.abs(second))
        for row in np.flatnonzero((first < 0).any(axis=1)):
            if np.abs(first[row, :2] - np.abs(second[row, :2])).sum() <= 1:
                went = not np.array_equal(np.abs(first[row, :2]), np.abs(second[row, :2]))
                found[row] = 0
                found[row, STAYED if went else AHEAD_BIN] = 2.0
        return found

    def description(self, features):
        return super().description(np.abs(features))


def walked(scene, steps, seed=0):
    """A random walk: features, actions and true poses on the lattice."""
    rng = np.random.default_rng(seed)
    state = int(np.flatnonzero(scene.components == 0)[0])
    pose = LatticePose(0, SETTINGS.side // 2, SETTINGS.side // 2)
    features, actions, poses = [], [], []
    for _ in range(steps):
        action = Action(int(rng.choice([0, 0, 0, 1, 2, 3])))
        features.append(scene.features[state])
        actions.append(int(action))
        poses.append(pose.index)
        following = int(scene.graph[state, action])
        if following != BLOCKED:
            state = following
            pose = pose.moved(STEPS[action]) if action in STEPS else pose.turned(QUARTERS[action])
    return np.array(features, np.float16), np.array(actions), np.array(poses)


def nowhere(features):
    """Poses held on the way that no picture speaks for: all the same."""
    return np.full((len(features), 3), SETTINGS.side // 2) * (0, 1, 1)


@pytest.fixture(scope="module")
def scene():
    return seen_perfectly(grid_scene(1, width=8, depth=7, obstacle_share=0.25))


@pytest.mark.slow
def test_walks_are_put_right_where_single_moves_deceive(scene):
    alone, together = 0, 0
    for seed in range(8):
        features, actions, poses = walked(scene, 250, seed)
        moving = np.flatnonzero(np.isin(actions[:-1], list(STEPS)))
        lies = np.random.default_rng(seed).choice(moving, len(moving) // 10, replace=False)
        features[lies, 3] *= -1  # marks them
        walk, sight = Walk(features, actions, nowhere(features)), Deceived(scene)
        went = (np.diff(poses[:, 1:], axis=0) != 0).any(axis=1)
        alone += int(((evidence_for_moves(walk, sight, SETTINGS)[1:] > 0) != went)[moving].sum())
        found = smoothed(walk, sight, SETTINGS)
        assert np.array_equal(found[:, 0], poses[:, 0])
        together += int((np.diff(found[:, 1:], axis=0) != np.diff(poses[:, 1:], axis=0)).any(axis=1).sum())
    assert alone > 70 and together < 10


def test_pictures_that_see_nothing_leave_moves_as_they_are_told(scene):
    features, actions, _ = walked(scene, 60)
    blind = PerfectSight(scene)
    features[:, 3] = 0
    walk = Walk(features, actions, nowhere(features))
    told = evidence_for_moves(walk, blind, SETTINGS) > 0
    assert np.array_equal((np.diff(smoothed(walk, blind, SETTINGS)[:, 1:], axis=0) != 0).any(axis=1), told[1:])
    one = smoothed(Walk(features[:1], actions[:1], nowhere(features[:1])), blind, SETTINGS)
    assert one.tolist() == [[0, SETTINGS.side // 2, SETTINGS.side // 2]]


def test_a_map_has_what_a_walk_came_to_and_what_blocked_it(scene):
    features, actions, poses = walked(scene, 250)
    known = charted(Walk(features, actions, poses), poses, PerfectSight(scene), SETTINGS)
    cells = {tuple(cell) for cell in poses[:, 1:].tolist()}
    assert all(known.room[cell] == 12 for cell in cells) and known.room.min() >= -12
    assert np.array_equal(known.taken, poses) and np.array_equal(known.features, features)
    stayed = [n for n in np.flatnonzero(np.isin(actions[:-1], list(STEPS))) if (poses[n] == poses[n + 1]).all()]
    assert stayed
    shut = set()
    for number in stayed:
        pose = LatticePose(*poses[number].tolist())
        beyond = pose.moved(STEPS[Action(int(actions[number]))])
        heading = pose.heading if actions[number] == Action.MOVE_FORWARD else pose.turned(2).heading
        assert known.shut[heading, pose.row, pose.column] and known.room[beyond.cell] <= -1 - BUMPED
        shut.add((heading, *pose.cell))
    assert known.shut.sum() == len(shut)


def test_a_way_that_a_move_has_gone_is_open_and_one_that_eyes_take_for_free_may_be_left_so(scene):
    ahead, back, middle = int(Action.MOVE_FORWARD), int(Action.MOVE_BACKWARD), SETTINGS.side // 2
    features = np.repeat(scene.features[:1], 5, axis=0).astype(np.float16)
    poses = np.array([(0, middle + row, middle) for row in (0, 0, 1, 0, 0)])
    walk = Walk(features, np.array([ahead, ahead, back, back, 0]), poses)  # blocked, gone, gone back, blocked behind
    sight = PerfectSight(scene)
    sight.stands = lambda features: np.full((len(features), 63), 20.0, np.float32)
    known = charted(walk, poses, sight, SETTINGS)
    assert not known.shut[0, middle, middle] and known.shut[2, middle, middle] and known.shut.sum() == 1
    ahead_of_all = walk.features[:2], poses[:2]
    stopped, doubted = (
        charted(
            Walk(ahead_of_all[0], np.array([ahead, 0]), ahead_of_all[1]),
            ahead_of_all[1],
            sight,
            SETTINGS,
            doubts=doubts,
        )
        for doubts in (False, True)
    )
    assert stopped.shut.sum() == 1 and not doubted.shut.any()
    assert stopped.room[middle + 1, middle] == doubted.room[middle + 1, middle] - BUMPED > -12


def test_what_looks_unlike_its_place_counts_for_little(scene):
    features, actions, poses = walked(scene, 250)
    walk, sure = Walk(features, actions, poses), PerfectSight(scene)
    honest = sure.whereabouts
    sure.whereabouts = lambda first, second: 10 * honest(first, second)
    pairs = _pairs(*_compared(walk, sure, SETTINGS), walk.heading, SETTINGS)
    assert pairs.told.min() == LEAST * SETTINGS.place_weight / 2


def test_where_a_turn_was_none_what_was_held_by_pictures_is_likelier(scene):
    features, actions, poses = walked(scene, 250)
    walk = Walk(features, actions, poses)
    assert smoothed(walk, PerfectSight(scene), SETTINGS) is not None, "no less likely"
    slipped = actions.copy()
    slipped[np.flatnonzero(np.isin(actions[:-1], list(STEPS)))[40]] = int(Action.TURN_RIGHT)
    assert smoothed(Walk(features, slipped, poses), PerfectSight(scene), SETTINGS) is None


@pytest.mark.parametrize(("evidence", "than", "clearly"), [(111, 100, True), (109, 100, False), (-89, -100, True)])
def test_evidence_is_clearly_more_by_a_tenth(evidence, than, clearly):
    assert _clearly_more(evidence, than) is clearly
    assert not _clearly_more(-91, -100) and not _clearly_more(0, 0)
