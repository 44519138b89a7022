"""Floor plans drawn in characters, for the tests."""

from __future__ import annotations

import numpy as np

from clearway.scenes.floor_plans import FloorPlan

SINGLE = (".",)
ELL = (
    "..####",
    "..####",
    "..####",
    "..####",
    "......",
    "......",
)  # the notch of 4 cells square becomes wall at 0.5 m a cell
ISLAND = (
    "......",
    "..##..",
    "..##..",
    "......",
)
STRAY = (
    "...#.#",
    ".#.###",
    "...##.",
)
MAPS = {"single": SINGLE, "ell": ELL, "island": ISLAND, "stray": STRAY}


def plan_of(
    name: str, lines: tuple[str, ...], blocked_edges: list | None = None, cell_size_m: float = 0.5
) -> FloorPlan:
    """The plan of lines seen from above, far end first: "." can be entered."""
    reachable = (np.array([list(line) for line in lines]) == ".")[::-1].T
    edges = np.array(blocked_edges or [], np.int64).reshape(-1, 2, 2)
    return FloorPlan.of_map(name, reachable, edges, cell_size_m=cell_size_m)
