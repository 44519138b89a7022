"""Where to go for something whose pose is uncertain: to what is likely for the way that it costs.

As in the search for a hidden object (Stone, Theory of Optimal Search, 1975). Axes: B episodes, 4 headings, G, G.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import uniform_filter

from clearway.mapping.beliefs import IMPOSSIBLE, NO_ROOM, SEEN, LatticePose, likeliest
from clearway.mapping.lattice import AHEAD, HEADINGS
from clearway.mapping.routes import FAR, first_action, shifted, ways_from
from clearway.mapping.settings import MappingSettings

DOUBT_COST, DOUBT_POWER = 20.0, 16  # steps besides, for a cell in which a body can hardly stand
MOST_FREE, MOST_FREE_BEHIND = 0.95, 0.9  # probability, at most, that a body can stand in a cell that was only seen
DEARER_BEHIND = 1.25  # times as much a collision costs backwards: who turns, sees first
TURNS_OUT, TURNS_OUT_AT_0 = 1.8, 1.53  # log-odds per log-odds held, and where 0 is held, of such cells in `validation`
BESIDE = 0.25  # share of what is likely beside a pose that counts as its own
IN_VIEW, VIEW_ALONG, VIEW_ACROSS = 0.1, 7, 3  # likewise, of what is within so many cells: eyes compare these well
TRUST = 0.5  # share of the evidence for a pose by which ways are chosen; arriving goes by all of it
DECEIVED = 0.2  # probability that what looked like the target was something else
IF_DECEIVED = 3.0  # evidence, at most, in that case


def probabilities(evidence: np.ndarray, room: np.ndarray) -> np.ndarray:
    """(B, 4, G, G), of poses by evidence for them, and by log-odds (B, G, G) that a body can stand in their cells."""
    logits = evidence - np.logaddexp(0, -room)[:, None]
    logits -= logits.max(axis=(1, 2, 3), keepdims=True)
    mass = np.exp(logits)
    return mass / mass.sum(axis=(1, 2, 3), keepdims=True)


def search_steps(
    poses: Sequence[LatticePose],
    evidence: np.ndarray,
    done: np.ndarray,
    room: np.ndarray,
    shut: np.ndarray,
    settings: MappingSettings,
    in_view: float = IN_VIEW,
    *,
    toured: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """The next actions (B,) int64, and whether nothing was left (B,) bool to which a way leads.

    Args:
        poses: B, where the agents stand.
        evidence: (B, 4, G, G), that what is searched for is in each pose.
        done: (B, 4, G, G) bool, poses in which it is not; where no other can be reached, the search begins anew.
        room, shut: see `Follower.begin`.
        settings: what ways cost.
        in_view: share of what is likely in view of a pose that counts as its own: 0 where poses are to be come to.
        toured: cells cost what is held of them, as after a tour; else, if only seen, what such cells turn out to be.
    """
    price = prices(room, shut, settings.collision_cost, toured=toured)
    cost = ways_from(poses, price)
    within = cost < FAR
    left = within & ~done
    lost = ~left.any(axis=(1, 2, 3))
    left = np.where(lost[:, None, None, None], within, left)
    worth = np.where(left, _spread(_likely(evidence, left, room), in_view), 0) / (cost + settings.nearby)
    ends = [likeliest(values) for values in worth]
    found = [first_action(poses[row], end, cost[row], price[row]) for row, end in enumerate(ends)]
    return np.array(found, np.int64), lost


def prices(room: np.ndarray, shut: np.ndarray, collision_cost: float, *, toured: bool = False) -> np.ndarray:
    """(B, 2, 4, G, G) of moves ahead and backwards, see `ways_from` and `search_steps`."""
    if toured:
        ahead = behind = _entering(_as_held(room), room, shut, collision_cost)
    else:
        ahead = _entering(_as_it_turns_out(room, MOST_FREE), room, shut, collision_cost)
        behind = _entering(_as_it_turns_out(room, MOST_FREE_BEHIND), room, shut, DEARER_BEHIND * collision_cost)
    return np.stack([ahead, behind], axis=1)


def _as_held(room: np.ndarray) -> np.ndarray:
    """Probability that a body can stand in a cell, by log-odds held of it."""
    return 1 / (1 + np.exp(-room))


def _as_it_turns_out(room: np.ndarray, most: float) -> np.ndarray:
    """How often a body can stand in a cell of which so much is held: in one that was only seen `most` often at most."""
    seen = np.minimum(_as_held(TURNS_OUT * room + TURNS_OUT_AT_0), most)
    return np.where(np.abs(room) > SEEN, _as_held(room), seen)


def _entering(free: np.ndarray, room: np.ndarray, shut: np.ndarray, collision_cost: float) -> np.ndarray:
    """(B, 4, G, G) cost of entering each cell along each direction; `free`: probability of each (B, G, G)."""
    price = 1 + collision_cost * (1 - free) + DOUBT_COST * (1 - free) ** DOUBT_POWER
    price = np.where(room < NO_ROOM, FAR, price)
    closed = np.stack([shifted(shut[:, d], AHEAD[d], True) for d in range(HEADINGS)], axis=1)
    return np.where(closed, FAR, price[:, None]).astype(np.float32)


def _likely(evidence: np.ndarray, left: np.ndarray, room: np.ndarray) -> np.ndarray:
    """Mass (B, 4, G, G) of the poses that are left (bool).

    What was likely where it turned out not to be is lost: eyes that were wrong there are no surer of what is left.
    Then it is mostly the mass of the other case that counts, in which what looked like the target was something else.
    """
    evidence = np.where(evidence > 0, TRUST * evidence, evidence)
    told = probabilities(evidence, room)
    deceived = probabilities(np.where(left, np.minimum(evidence, IF_DECEIVED), IMPOSSIBLE), room)
    return np.where(left, (1 - DECEIVED) * told + DECEIVED * deceived, 0)


def _spread(mass: np.ndarray, in_view: float) -> np.ndarray:
    """Mass (B, 4, G, G) with some of what is beside every pose and in view of it: who goes there sees it."""
    around = sum(shifted(mass, step, 0.0) for step in AHEAD)
    turned = mass[:, [3, 0, 1, 2]] + mass[:, [1, 2, 3, 0]]
    beside = mass + BESIDE * (around + turned)
    return beside + in_view * _in_view(mass) if in_view else beside


def _in_view(mass: np.ndarray) -> np.ndarray:
    """(B, 4, G, G), the mass around each pose in those that see much of what it sees: before and behind it."""
    found = np.empty_like(mass)
    for heading in range(HEADINGS):
        lengths = (VIEW_ALONG, VIEW_ACROSS) if AHEAD[heading, 0] else (VIEW_ACROSS, VIEW_ALONG)
        found[:, heading] = uniform_filter(mass[:, heading], (0, *lengths), mode="constant")
    return np.maximum(found, 0) * (VIEW_ALONG * VIEW_ACROSS)
