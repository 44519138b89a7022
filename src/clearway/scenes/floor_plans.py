"""Floor plans: which cells of a grid can be entered.

`plan_scenes.floor_plan_scene` makes one a scene, with made-up features, and `clearway.rooms.build.build_floor_plan` a
furnished room, with pictures.

Axis letters: C cells, E edges, S = 4 C states.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

import numpy as np

from clearway.errors import SceneError
from clearway.scenes.grid import HEADING_COUNT, connected_parts, neighbour_pairs
from clearway.scenes.validate import MAX_COORDINATE_M, MAX_STATES

SOURCE = "floor_plan"  # stands in a scene's `made_by`
GENERATED = "generated"  # the same of a plan that was drawn (`clearway.generation`)
SOURCES = (SOURCE, GENERATED)  # of scenes that `plan_of` knows
CELL_SIZE_M = 0.25  # of the published AI2-THOR plans
MAX_CELLS = MAX_STATES // HEADING_COUNT
MAX_WALLS = 1 << 18
MAX_FURNITURE_CELLS = 64  # along a side
BLOCKED_LETTER, FREE_LETTER, WALL_LETTER, DOOR_LETTER = "#", ".", "W", "D"  # of a map in characters
LETTERS = {BLOCKED_LETTER: "blocked", FREE_LETTER: "reachable", WALL_LETTER: "a wall", DOOR_LETTER: "a door in it"}
USES = ("bathroom", "bedroom", "kitchen", "living room", "corridor")
FURNITURE = (
    *("armchair", "basin", "bath", "bookcase", "cabinet", "chest", "coats", "coffee table", "counter", "desk"),
    *("dining table", "double bed", "fireplace", "fridge", "island", "nightstand", "pantry", "plant", "shoe cabinet"),
    *("shower", "sideboard", "single bed", "sofa", "table", "television", "toilet", "wardrobe", "worktop"),
)  # kinds that a plan may name
FRONTS = ("south", "north", "west", "east")  # z grows to the north, x to the east


def _no_edges() -> np.ndarray:
    return np.zeros((0, 2, 2), np.int64)


def _no_cells() -> np.ndarray:
    return np.zeros((0, 2), np.int64)


@dataclass(frozen=True)
class Area:
    """A rectangle of cells that is used as a room of some kind, which chooses its furniture.

    Attributes:
        use: one of `USES`.
        low, high: x and z of its lowest and highest cell, both included.
    """

    use: str
    low: tuple[int, int]
    high: tuple[int, int]


@dataclass(frozen=True)
class Furnishing:
    """A piece of furniture that a plan names, on a rectangle of blocked cells.

    Attributes:
        kind: one of `FURNITURE`.
        low, high: x and z of its lowest and highest cell, both included.
        front: the side that its front looks to, one of `FRONTS`.
    """

    kind: str
    low: tuple[int, int]
    high: tuple[int, int]
    front: str

    @property
    def cells(self) -> list[tuple[int, int]]:
        """X and z of the cells that it stands on."""
        (x0, z0), (x1, z1) = self.low, self.high
        return [(x, z) for x in range(x0, x1 + 1) for z in range(z0, z1 + 1)]


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """The cells that can be entered, on a square grid. Neighbouring cells are joined unless the way is blocked.

    Attributes:
        name: of the plan and of its scene.
        cells: (C, 2) int, x and z of each cell in units of the cell size, distinct; the scene keeps their order.
        blocked_edges: (E, 2, 2) int, pairs of neighbouring cells, x and z of each, without a way between them.
        cell_size_m: side of a cell, metres.
        source: file that errors name; empty for a plan made in memory.
        dataset: array of the file that errors name; empty where the file is the plan.
        walls: (W, 2) int, x and z of cells that are wall up to the ceiling, none of them in `cells`; what is neither is
            furniture.
        doors: (D, 2) int, x and z of `cells` that are openings in a wall.
        areas: what parts of the plan are used as; the first that holds a cell counts, none: any furniture.
        furniture: pieces on blocked cells, where the plan has walls; what stands on other blocked cells is chosen when
            the plan is built.

    Raises:
        SceneError: there are no cells or too many, one stands twice or far away, or a blocked edge, a wall, a door, an
            area or a piece of furniture is none.
    """

    name: str
    cells: np.ndarray
    blocked_edges: np.ndarray = field(default_factory=_no_edges)
    cell_size_m: float = CELL_SIZE_M
    source: str = ""
    dataset: str = ""
    walls: np.ndarray = field(default_factory=_no_cells)
    doors: np.ndarray = field(default_factory=_no_cells)
    areas: tuple[Area, ...] = ()
    furniture: tuple[Furnishing, ...] = ()

    def __post_init__(self) -> None:
        """Check all of it."""
        if not 0 < self.cell_size_m < math.inf:
            self._refuse(f"has a cell size of {self.cell_size_m} m", "Give a length above 0")
        if self.cells.ndim != 2 or self.cells.shape[1] != 2 or self.cells.dtype.kind not in "iu":
            shape = f"is {self.cells.dtype} of shape {self.cells.shape}"
            self._refuse(f"{shape}, expected whole numbers (cells, 2)", "Give x and z of every reachable cell")
        if not 1 <= len(self.cells) <= MAX_CELLS:
            self._refuse(f"has {len(self.cells)} reachable cells, expected 1 to {MAX_CELLS}", "Give another plan")
        if self._is_far(self.cells):
            self._refuse(f"has cells more than {MAX_COORDINATE_M:,.0f} m away", "Move the plan near its origin")
        distinct, times = np.unique(self.cells, axis=0, return_counts=True)
        if times.max() > 1:
            self._refuse(f"names the cell {tuple(distinct[times.argmax()].tolist())} twice", "Name every cell once")
        self._check_blocked()
        self._check_parts()
        self._check_furniture()

    @classmethod
    def of_map(
        cls,
        name: str,
        reachable: np.ndarray,
        blocked_edges: np.ndarray | None = None,
        *,
        cell_size_m: float = CELL_SIZE_M,
        source: str = "",
        dataset: str = "",
    ) -> FloorPlan:
        """The plan of a map, (X, Z) bool: element [x, z] says whether that cell can be entered; see the attributes."""
        assert reachable.ndim == 2 and reachable.dtype == np.bool_, (reachable.shape, reachable.dtype)
        blocked = _no_edges() if blocked_edges is None else blocked_edges
        return cls(name, np.argwhere(reachable), blocked, cell_size_m, source, dataset)

    @classmethod
    def of_text(
        cls,
        name: str,
        lines: Sequence[str],
        *,
        areas: tuple[Area, ...] = (),
        cell_size_m: float = CELL_SIZE_M,
        source: str = "",
    ) -> FloorPlan:
        """The plan of a map in characters (`LETTERS`), as seen from above.

        The first line is the far end, the largest z; the last line is z = 0, the first column x = 0.

        Raises:
            SceneError: the lines differ in length or hold another character, or it is no plan.
        """
        letters = grid_from_above(source or name, [list(line) for line in lines], LETTERS)
        cells = np.argwhere((letters == FREE_LETTER) | (letters == DOOR_LETTER))
        return cls(
            name,
            cells,
            cell_size_m=cell_size_m,
            source=source,
            walls=np.argwhere(letters == WALL_LETTER),
            doors=np.argwhere(letters == DOOR_LETTER),
            areas=areas,
        )

    @property
    def has_walls(self) -> bool:
        """Whether the plan says where walls are; else they follow from its cells."""
        return len(self.walls) + len(self.doors) > 0

    @property
    def parts(self) -> list[np.ndarray]:
        """The cells of each part that can be reached in itself, (cells, 2) each, the largest part first."""
        part, sizes = connected_parts(len(self.cells), self.edges)
        return [self.cells[part == number] for number in range(len(sizes))]

    @property
    def edges(self) -> np.ndarray:
        """(E, 2) int64, indices of the neighbouring cells with a way between them."""
        pairs, _ = neighbour_pairs(self.cells)
        blocked = set(_ends(self.blocked_edges))
        free = [ends not in blocked for ends in _ends(self.cells[pairs])]
        return pairs[np.array(free, bool)]

    def _check_blocked(self) -> None:
        edges = self.blocked_edges
        if edges.ndim != 3 or edges.shape[1:] != (2, 2) or edges.dtype.kind not in "iu":
            shape = f"has blocked edges of {edges.dtype} and shape {edges.shape}"
            self._refuse(f"{shape}, expected whole numbers (edges, 2, 2)", "Give x and z of the two cells of each edge")
        pairs, _ = neighbour_pairs(self.cells)
        unknown = set(_ends(edges)) - set(_ends(self.cells[pairs]))
        if unknown:
            ends = " and ".join(str(cell) for cell in sorted(unknown.pop()))
            self._refuse(f"has a blocked edge of {ends}", "Name two neighbouring cells that can be entered")

    def _check_parts(self) -> None:
        cells = set(map(tuple, self.cells.tolist()))
        for name, part in (("wall", self.walls), ("door", self.doors)):
            if part.ndim != 2 or part.shape[1] != 2 or part.dtype.kind not in "iu":
                shape = f"has {name}s of {part.dtype} and shape {part.shape}"
                self._refuse(f"{shape}, expected whole numbers ({name}s, 2)", f"Give x and z of every {name}")
            if len(part) > MAX_WALLS:
                self._refuse(f"has {len(part)} {name}s, at most {MAX_WALLS} can be kept", "Give a smaller plan")
            if self._is_far(part):
                self._refuse(f"has {name}s more than {MAX_COORDINATE_M:,.0f} m away", "Move the plan near its origin")
            for cell in map(tuple, part.tolist()):
                if (cell in cells) == (name == "wall"):
                    can = "that can be entered" if name == "wall" else "that cannot be entered"
                    self._refuse(f"has a {name} in the cell {cell} {can}", f"Take the {name} or the cell out")
        for area in self.areas:
            if area.use not in USES or area.low[0] > area.high[0] or area.low[1] > area.high[1]:
                self._refuse(f"has the area {area}", f"Give a use among {', '.join(USES)}, then low and high cell")

    def _check_furniture(self) -> None:
        taken = set(map(tuple, np.concatenate([self.cells, self.walls]).tolist())) if self.furniture else set()
        for piece in self.furniture:
            known = piece.kind in FURNITURE and piece.front in FRONTS
            sides = [high - low for low, high in zip(piece.low, piece.high, strict=True)]
            if not known or min(sides) < 0 or max(sides) >= MAX_FURNITURE_CELLS:
                self._refuse(f"has the furniture {piece}", "Give a kind of FURNITURE, low and high cell, and a front")
            standing = set(piece.cells)
            if standing & taken:
                cell = min(standing & taken)
                self._refuse(
                    f"has a {piece.kind} in the cell {cell} that is taken", "Put it on blocked cells of its own"
                )
            taken |= standing

    def _is_far(self, cells: np.ndarray) -> bool:
        far = MAX_COORDINATE_M / self.cell_size_m
        return bool((cells > far).any() or (cells < -far).any())

    def _refuse(self, problem: str, remedy: str) -> NoReturn:
        raise SceneError(self.source or self.name, problem, remedy, self.dataset)


def grid_from_above(where: Path | str, rows: list[list[str]], words: Mapping[str, str]) -> np.ndarray:
    """The map (X, Z) str of rows of words as seen from above, the far end first.

    Args:
        where: what errors name.
        rows: of one length.
        words: that may stand in it, and what each means.

    Raises:
        SceneError: there are no rows, they differ in length, or another word stands there.
    """
    if not rows or not rows[0]:
        raise SceneError(where, "is empty", "Give a map or a list of cells")
    for number, row in enumerate(rows, 1):
        if len(row) != len(rows[0]):
            problem = f"line {number} has {len(row)} cells, the first has {len(rows[0])}"
            raise SceneError(where, problem, "Give all lines of a map the same length")
        strange = next((column for column, word in enumerate(row) if word not in words), None)
        if strange is not None:
            problem = f"line {number}, column {strange + 1} holds {row[strange][:20]!r}"
            *most, last = (f"{word} for {meaning}" for word, meaning in words.items())
            raise SceneError(where, problem, f"Write {', '.join(most)} and {last}")
    return np.array(rows)[::-1].T


def parts_apart(plan: FloorPlan, most: int = 6) -> str:
    """One line on the parts of a plan that cannot be reached from its largest; empty where there are none.

    Args:
        plan: the plan.
        most: parts, and cells of each part, that are named; the rest are counted.
    """
    _, *others = plan.parts
    if not others:
        return ""
    named = [f"{_cell_count(len(part))} at {_first_of(list(map(str, _tuples(part))), most)}" for part in others[:most]]
    if len(others) > most:
        named.append(f"{_cell_count(sum(map(len, others[most:])))} in {len(others) - most} more")
    which = "1 part cannot be" if len(others) == 1 else f"{len(others)} parts cannot be"
    return f"{plan.name}: {which} reached from the largest part (kept in the scene): {'; '.join(named)}"


def _cell_count(count: int) -> str:
    return "1 cell" if count == 1 else f"{count} cells"


def _first_of(words: list[str], most: int) -> str:
    return ", ".join(words[:most]) + (f" and {len(words) - most} more" if len(words) > most else "")


def _tuples(cells: np.ndarray) -> list[tuple[int, int]]:
    return [(x, z) for x, z in cells.tolist()]


def _ends(pairs: np.ndarray) -> list[frozenset[tuple[int, int]]]:
    """The two cells of each pair, (E, 2, 2), without regard to which comes first."""
    return [frozenset((tuple(one), tuple(other))) for one, other in pairs.tolist()]
