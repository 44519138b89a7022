"""Where to go for something whose pose is uncertain: to what is likely for the way that it costs.

As in the search for a hidden object (Stone, Theory of Optimal Search, 1975). Axes: B episodes, 4 headings, G, G.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.mapping.beliefs import LatticePose, likeliest
from clearway.mapping.lattice import AHEAD, HEADINGS
from clearway.mapping.routes import FAR, first_action, shifted, ways_from
from clearway.mapping.settings import MappingSettings

NO_WAY = 0.02  # probability that a body can stand in a cell, below which no way leads through it
BESIDE = 0.25  # share of what is likely beside a pose that counts as its own


def probabilities(evidence: np.ndarray, room: np.ndarray) -> np.ndarray:
    """(B, 4, G, G), of poses by evidence for them, and by log-odds (B, G, G) that a body can stand in their cells."""
    logits = evidence - np.logaddexp(0, -room)[:, None]
    logits -= logits.max(axis=(1, 2, 3), keepdims=True)
    mass = np.exp(logits)
    return mass / mass.sum(axis=(1, 2, 3), keepdims=True)


def search_steps(
    poses: Sequence[LatticePose],
    likely: np.ndarray,
    done: np.ndarray,
    room: np.ndarray,
    shut: np.ndarray,
    settings: MappingSettings,
) -> np.ndarray:
    """The next actions (B,) int64.

    Args:
        poses: B, where the agents stand.
        likely: (B, 4, G, G), how likely what is searched for is in each pose.
        done: (B, 4, G, G) bool, poses in which it is not.
        room, shut: see `Follower.begin`.
        settings: what ways cost.
    """
    price = _entering(room, shut, settings.collision_cost)
    start = np.full(likely.shape, FAR, np.float32)
    for row, pose in enumerate(poses):
        start[row][pose.index] = 0
    cost = ways_from(start, price)
    worth = np.where(done | (cost >= FAR), 0, _spread(likely)) / (cost + settings.nearby)
    ends = [likeliest(values) for values in worth]
    found = [first_action(poses[row], end, cost[row], price[row]) for row, end in enumerate(ends)]
    return np.array(found, np.int64)


def _entering(room: np.ndarray, shut: np.ndarray, collision_cost: float) -> np.ndarray:
    """(B, 4, G, G) cost of entering each cell along each direction."""
    free = 1 / (1 + np.exp(-room))
    price = np.where(free < NO_WAY, FAR, 1 + collision_cost * (1 - free))
    closed = np.stack([shifted(shut[:, d], AHEAD[d], True) for d in range(HEADINGS)], axis=1)
    return np.where(closed, FAR, price[:, None]).astype(np.float32)


def _spread(mass: np.ndarray) -> np.ndarray:
    """Mass (B, 4, G, G) with some of what is beside every pose: who goes there sees it."""
    around = sum(shifted(mass, step, 0.0) for step in AHEAD)
    turned = mass[:, [3, 0, 1, 2]] + mass[:, [1, 2, 3, 0]]
    return mass + BESIDE * (around + turned)
