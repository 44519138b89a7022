"""Floor plans drawn in characters, for the tests."""

from __future__ import annotations

import numpy as np

from clearway.rooms.detail import Detail
from clearway.scenes.floor_plans import Area, FloorPlan

COARSE = Detail(texture_step=8)  # where it is asked what stands and hangs where, not how it looks
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
FLAT = (
    "WWWWWWWWWWWWW",
    "W###..W...##W",
    "W.....W...##W",
    "W.....W#....W",
    "WW.WWWWWWDWWW",
    "W...........W",
    "WWWWDWWW....W",
    "WW.....W.##.W",
    "###..#.W....W",
    "###...#WWWWWW",
)  # three rooms and a corridor that opens into a fourth, a gap and two doors; the last line has no wall beyond it
TWO_ROOMS = (
    "WWWWWWWWW",
    "W...W##.W",
    "W...D...W",
    "W.##W...W",
    "WWWWWWWWW",
)
MAPS = {"single": SINGLE, "ell": ELL, "island": ISLAND, "stray": STRAY}


def walled(
    name: str = "two rooms", lines: tuple[str, ...] = TWO_ROOMS, areas: tuple[Area, ...] = (), cell_size_m: float = 0.5
) -> FloorPlan:
    """The plan of a map with walls and doors."""
    return FloorPlan.of_text(name, lines, areas=areas, cell_size_m=cell_size_m)


def plan_of(
    name: str, lines: tuple[str, ...], blocked_edges: list | None = None, cell_size_m: float = 0.5
) -> FloorPlan:
    """The plan of lines seen from above, far end first: "." can be entered."""
    reachable = (np.array([list(line) for line in lines]) == ".")[::-1].T
    edges = np.array(blocked_edges or [], np.int64).reshape(-1, 2, 2)
    return FloorPlan.of_map(name, reachable, edges, cell_size_m=cell_size_m)
