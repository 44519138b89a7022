"""What is true of pictures and of pairs of them: depth at each token, relative pose, which tokens see the same place.

Axes: P pairs, B pictures, T tokens, row by row from the upper left. A place is seen again where the line of sight of
one picture's token ends at a point that the other camera sees at the depth where it should be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.perception.token_grid import TokenGrid
from clearway.perception.whereabouts import bin_of
from clearway.views.table import ViewTable

MILLIMETRE = 0.001
LEAST_AHEAD_M = 0.1  # of a point, to be seen
SAME_M, SAME_SHARE = 0.12, 0.08  # depths that differ by no more, or by no more than this share, are of one place


@dataclass(frozen=True, eq=False)
class PairLabels:
    """What is true of P ordered pairs of pictures, seen from the first of each.

    Attributes:
        place_m: (P, 2) float32, where the second camera stands: so far ahead, so far to the right.
        turn: (P, 2) float32, cosine and sine of how far the second camera is turned to the right.
        match: (P, T) int64, token of the second picture that sees what each of the first one's sees; T where none does.
        overlap: (P,) float32, share of the first one's tokens that have a match.
        where: (P,) int64, bin of `perception.whereabouts` that the second camera's pose is in.
    """

    place_m: np.ndarray
    turn: np.ndarray
    match: np.ndarray
    overlap: np.ndarray
    where: np.ndarray


def token_depth_m(depth: np.ndarray, grid: TokenGrid) -> np.ndarray:
    """(B, T) float32 metres, depth (B, height, width) in millimetres in the middle of every token."""
    rows, columns = grid.middles(*depth.shape[1:])
    return (depth[:, rows][:, :, columns].reshape(len(depth), -1) * MILLIMETRE).astype(np.float32)


def pair_labels(
    table: ViewTable, depth: np.ndarray, first: np.ndarray, second: np.ndarray, grid: TokenGrid
) -> PairLabels:
    """What is true of pairs of pictures of the same room.

    Args:
        table: of B pictures.
        depth: (B, height, width) uint16 millimetres, what they see along the camera's axis.
        first, second: (P,) numbers of the pictures of each pair.
        grid: the tokens.
    """
    here, there = table[first], table[second]
    ahead_m, right_m, turn = _seen_from(here, there)
    points = _points_m(token_depth_m(depth[first], grid), here.pitch_deg, grid)
    points += np.stack([-ahead_m, -right_m, here.height_m - there.height_m])[:, :, None]
    deep_m, up, right = _slopes_in(points, turn, there.pitch_deg)
    match = _matches(deep_m, up, right, depth, second, grid)
    return PairLabels(
        place_m=np.stack([ahead_m, right_m], axis=1).astype(np.float32),
        turn=np.stack([np.cos(turn), np.sin(turn)], axis=1).astype(np.float32),
        match=match,
        overlap=(match < grid.count).astype(np.float32).mean(axis=1),
        where=bin_of(ahead_m, right_m, np.degrees(turn)),
    )


def _seen_from(here: ViewTable, there: ViewTable) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where another camera stands, metres ahead and to the right, and its turn to the right in radians, (P,) each."""
    heading = np.radians(here.heading_deg)
    x_m, z_m = there.x_m - here.x_m, there.z_m - here.z_m
    ahead_m = x_m * np.sin(heading) + z_m * np.cos(heading)
    right_m = x_m * np.cos(heading) - z_m * np.sin(heading)
    return ahead_m, right_m, np.radians(there.heading_deg) - heading


def _points_m(deep_m: np.ndarray, pitch_deg: np.ndarray, grid: TokenGrid) -> np.ndarray:
    """Where the lines of sight end, (3, P, T) metres ahead, right and up of the camera, as if it looked level."""
    up, right = grid.slopes.T
    pitch = np.radians(pitch_deg)[:, None]
    ahead_m = deep_m * (np.cos(pitch) - up * np.sin(pitch))
    up_m = deep_m * (np.sin(pitch) + up * np.cos(pitch))
    return np.stack([ahead_m, deep_m * right, up_m])


def _slopes_in(points_m: np.ndarray, turn: np.ndarray, pitch_deg: np.ndarray) -> tuple[np.ndarray, ...]:
    """Depth and slopes up and right, (P, T) each, of points in a camera that is turned and pitched so."""
    ahead_m, right_m, up_m = points_m
    cosine, sine = np.cos(turn)[:, None], np.sin(turn)[:, None]
    level_m, right_m = ahead_m * cosine + right_m * sine, right_m * cosine - ahead_m * sine
    pitch = np.radians(pitch_deg)[:, None]
    deep_m = level_m * np.cos(pitch) + up_m * np.sin(pitch)
    up_m = up_m * np.cos(pitch) - level_m * np.sin(pitch)
    ahead = np.where(deep_m > LEAST_AHEAD_M, deep_m, np.inf)
    return deep_m, up_m / ahead, right_m / ahead


def _matches(
    deep_m: np.ndarray, up: np.ndarray, right: np.ndarray, depth: np.ndarray, second: np.ndarray, grid: TokenGrid
) -> np.ndarray:
    """(P, T) int64, the token that each point falls on where the picture sees it, else T."""
    height_px, width_px = depth.shape[1:]
    row, column = grid.place(up, right)
    inside = (deep_m > LEAST_AHEAD_M) & (row >= 0) & (row < grid.rows) & (column >= 0) & (column < grid.columns)
    row, column = np.where(inside, row, 0), np.where(inside, column, 0)
    y, x = (row * height_px / grid.rows).astype(int), (column * width_px / grid.columns).astype(int)
    seen_m = depth[second[:, None], y, x] * MILLIMETRE
    inside &= np.abs(seen_m - deep_m) < np.maximum(SAME_M, SAME_SHARE * deep_m)
    return np.where(inside, row.astype(np.int64) * grid.columns + column.astype(np.int64), grid.count)
