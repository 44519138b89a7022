from __future__ import annotations

import heapq

import numpy as np
import pytest

from clearway.mapping.beliefs import LatticePose
from clearway.mapping.lattice import HEADINGS
from clearway.mapping.routes import FAR, first_action, ways_from
from clearway.scenes.actions import Action

SIDE = 7


def neighbours(pose: LatticePose, entering: np.ndarray):
    """Action, pose and cost of every step that stays in the lattice."""
    steps = (
        (Action.MOVE_FORWARD, pose.moved(1), (0, pose.heading)),
        (Action.MOVE_BACKWARD, pose.moved(-1), (1, (pose.heading + 2) % HEADINGS)),
        (Action.TURN_RIGHT, pose.turned(1), None),
        (Action.TURN_LEFT, pose.turned(-1), None),
    )
    for action, there, move in steps:
        if 0 <= there.row < SIDE and 0 <= there.column < SIDE:
            yield action, there, 1.0 if move is None else float(entering[*move, there.row, there.column])


def plain_costs(start: LatticePose, entering: np.ndarray) -> np.ndarray:
    """By Dijkstra's algorithm."""
    cost = np.full((HEADINGS, SIDE, SIDE), FAR)
    cost[start.index] = 0
    waiting = [(0.0, 0, start)]
    number = 0
    while waiting:
        so_far, _, pose = heapq.heappop(waiting)
        for _, there, price in neighbours(pose, entering):
            if so_far + price < cost[there.index] - 1e-9:
                cost[there.index] = so_far + price
                number += 1
                heapq.heappush(waiting, (so_far + price, number, there))
    return cost


@pytest.mark.parametrize("seed", range(5))
def test_ways_are_the_cheapest_and_first_actions_lead_along_them(seed):
    rng = np.random.default_rng(seed)
    entering = rng.uniform(1, 6, (1, 2, HEADINGS, SIDE, SIDE)).astype(np.float32)
    entering[rng.random(entering.shape) < 0.2] = FAR
    start = LatticePose(*rng.integers((HEADINGS, SIDE, SIDE)).tolist())
    cost = ways_from([start], entering)
    expected = plain_costs(start, entering[0])
    np.testing.assert_allclose(cost[0], expected, rtol=1e-4)
    for _ in range(20):
        end = LatticePose(*rng.integers((HEADINGS, SIDE, SIDE)).tolist())
        if end == start or expected[end.index] >= FAR:
            continue
        action = first_action(start, end, cost[0], entering[0])
        there, price = next((there, price) for made, there, price in neighbours(start, entering[0]) if made == action)
        onwards = plain_costs(there, entering[0])[end.index]
        assert price + onwards == pytest.approx(expected[end.index], rel=1e-4)
