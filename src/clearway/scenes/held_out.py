"""Poses held out of training: in every room a tenth of the locations, chosen by a hash of the room's name and the cell.

No views are taken there, and trainings in generated rooms draw no target there, so that both can be tested on poses
that are new in rooms that are known. The choice needs no list: it follows from the scene's name and its cells.
"""

from __future__ import annotations

import hashlib

import numpy as np

SHARE = 0.1
ROUNDING = 1e-6  # of places, in cells


def held_out_cells(name: str, cells: np.ndarray) -> np.ndarray:
    """Which cells of a plan are held out, (C,) bool: a tenth of them, rounded, at least one; none of a single cell.

    Args:
        name: of the plan and of its scene.
        cells: (C, 2) int, x and z of distinct cells in units of the cell size; their order does not matter.
    """
    count = max(1, round(SHARE * len(cells))) if len(cells) > 1 else 0
    ranks = [hashlib.sha256(f"held out: {name}, {x}, {z}".encode()).digest() for x, z in cells.tolist()]
    chosen = np.zeros(len(cells), bool)
    chosen[sorted(range(len(ranks)), key=ranks.__getitem__)[:count]] = True
    return chosen


def held_out_poses(name: str, cells: np.ndarray, locations_m: np.ndarray, cell_size_m: float) -> np.ndarray:
    """Which poses of a scene are held out, (S,) bool: all headings of the held-out cells.

    A scene that is renamed has others, so keep the names of generated files.

    Args:
        name: of the scene.
        cells: (S,) int64, cell of each state, see `Scene.cells`.
        locations_m: (S, 2), x and z.
        cell_size_m: length of a move.
    """
    _, first = np.unique(cells, return_index=True)
    steps = locations_m[first] / cell_size_m
    grid = np.ceil(steps - 0.5 - ROUNDING).astype(np.int64)  # cells may lie halfway
    return held_out_cells(name, grid)[cells]
