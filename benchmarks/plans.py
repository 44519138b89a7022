"""Generated plans beside real ones, in figures.

    python benchmarks/plans.py --real ithor_floor_plans.npz                 # some seconds
    python benchmarks/plans.py --real ithor_floor_plans.npz --count 1000
    python benchmarks/plans.py --real ithor_floor_plans.npz --sheet plans.png    # twelve real plans, 24 rooms, 8 flats
    python benchmarks/plans.py --variety --count 1000                       # how much differs; needs MuJoCo

The real plans are the positions that AI2-THOR's agent reaches, (cells, 2) whole numbers a room in units of 0.25 m. To
compare like with like they are brought to the generator's grid of 0.5 m: of the four ways to take every second position
along both axes, the one whose largest connected part has most cells, and that part of it. A move of 0.5 m is free where
the position half-way can be reached too.

    cells            that can be entered
    blocked_share    of the smallest rectangle around them, what cannot be entered
    dead_ends        cells with one way out at most
    mean_path_steps, longest_path_steps    shortest paths between poses, turns included
    blank_share      poses with something nearer than 0.6 m ahead: those that cannot move forward
    within           generated plans that lie between the real ones' 5 and 95 %
    first drafts     rooms as they come, before any is drawn again for being unlike real ones or another split's
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from clearway.choices import PlanKind, SplitName
from clearway.generation.plans import draw_plan, draw_room, finished
from clearway.generation.request import KINDS, ROOM_USES, SPLITS, Request
from clearway.generation.split import canonical_hash
from clearway.generation.statistics import FIGURES, plan_statistics
from clearway.generation.structure import draw_structure
from clearway.rooms.parts import Lamp
from clearway.scenes.floor_plans import FloorPlan
from clearway.scenes.grid import connected_parts, edges_among, neighbour_pairs

REAL_USES = {0: "kitchen", 2: "living room", 3: "bedroom", 4: "bathroom"}  # hundreds of a plan's number

SHEET_PX, SPACE_PX = 1360, 8
WALL, FURNITURE, DOOR = (64, 64, 64), (150, 110, 75), (230, 120, 60)
FLOORS = {
    "kitchen": (250, 225, 170),
    "living room": (200, 225, 190),
    "bedroom": (205, 205, 240),
    "bathroom": (185, 230, 240),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--real", type=Path, help="real plans, .npz")
    parser.add_argument("--variety", action="store_true", help="say how much generated plans and rooms differ")
    parser.add_argument("--count", type=int, default=200, help="generated plans of each kind")
    parser.add_argument("--split", choices=SPLITS, default="train")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", type=Path, help="write all figures here")
    parser.add_argument("--sheet", type=Path, help="draw plans here")
    given = parser.parse_args()
    if given.variety:
        for kind in KINDS:
            requests = [Request(kind, given.split, given.seed, number) for number in range(given.count)]
            print(f"\n{given.count} {kind}s\n")
            print("\n".join(f"| {what} | {shown} |" for what, shown in variety(requests).items()))
        return
    if given.real is None:
        parser.error("give real plans with --real")
    if given.sheet:
        draw_sheet(given.real, given.split, given.seed, given.sheet)
        return
    rows = {"real rooms": real_figures(given.real)}
    uses = {"real rooms": [REAL_USES[int(name.removeprefix("FloorPlan")) // 100] for name in np.load(given.real).files]}
    for kind in KINDS:
        requests = [Request(kind, given.split, given.seed, number) for number in range(given.count)]
        started, rejected = time.process_time(), Counter[str]()
        drawn = [draw_plan(request) for request in requests]
        took_s = time.process_time() - started
        for one in drawn:
            rejected += one.rejected
        rows[f"{kind}s"] = table([one.plan for one in drawn])
        uses[f"{kind}s"] = [request.use or "" for request in requests]
        told = ", ".join(f"{count} {why}" for why, count in sorted(rejected.items())) or "none"
        print(f"{given.count} {kind}s: {1000 * took_s / given.count:.1f} ms each; drawn again: {told}")
    print(f"\n5 / 50 / 95 % of {len(rows['real rooms'])} real rooms and {given.count} generated plans a kind\n")
    print(markdown(rows))
    for use in ROOM_USES:
        some = {who: values[[each == use for each in uses[who]]] for who, values in rows.items() if who != "flats"}
        some["first drafts"] = drafts(use, given.count // len(ROOM_USES), given.seed)
        print(f"\n{use}s\n\n{markdown(some)}")
    if given.json:
        content = {
            who: [dict(zip(FIGURES, row, strict=True)) for row in values.tolist()] for who, values in rows.items()
        }
        given.json.write_text(json.dumps(content, indent=1) + "\n")


def variety(requests: Sequence[Request]) -> dict[str, str]:
    """What differs among generated plans and the rooms that are built of them, by how much."""
    from clearway.rooms.plans.plan_room import build_plan_room

    plans = [draw_plan(request).plan for request in requests]
    insides = [plan.cells.tolist() + [cell for piece in plan.furniture for cell in piece.cells] for plan in plans]
    sizes_m2 = np.array([0.25 * (len(inside) - len(plan.doors)) for inside, plan in zip(insides, plans, strict=True)])
    filled = [len(inside) == np.prod(np.ptp(inside, axis=0) + 1) for inside in insides]
    pieces = np.array([len(plan.furniture) for plan in plans], float)
    rooms = [build_plan_room(plan, request.seed, looks=False)[0] for plan, request in zip(plans, requests, strict=True)]
    found = {
        "distinct plans": str(len({canonical_hash(plan.cells) for plan in plans})),
        "floor, m2": spread(sizes_m2),
        "pieces of furniture": spread(pieces),
        "kinds of furniture": str(len({piece.kind for plan in plans for piece in plan.furniture})),
        "time of day": shares(room.daytime.name for room in rooms),
        "colour of lamps": shares(lamp_colour(room.lamps) for room in rooms),
        "distinct schemes of colours": str(len({room.colours for room in rooms})),
        "windows": spread(np.array([len(room.windows) for room in rooms], float)),
    }
    if requests[0].kind == "room":
        found["outline is a rectangle"] = f"{np.mean(filled):.0%}"
    else:
        drawn = (draw_structure(np.random.default_rng([request.seed, request.number])) for request in requests)
        flats = [flat for flat in drawn if flat is not None]
        ours = [(flat, number) for flat in flats for number, use in enumerate(flat.uses, 1) if use != "corridor"]
        cells = [np.argwhere(flat.numbers == number) for flat, number in ours]
        found |= {
            "corridor": shares(flat.form for flat in flats),
            "rooms": shares(str(len(flat.uses) - 1) for flat in flats),
            "rooms that are no rectangle": f"{np.mean([len(c) < np.prod(np.ptp(c, axis=0) + 1) for c in cells]):.0%}",
        }
    return found


def lamp_colour(lamps: Sequence[Lamp]) -> str:
    """Of the brightest lamp."""
    red, _, blue = max(lamps, key=lambda lamp: lamp.power).colour
    return "cool" if blue >= red else "neutral" if blue > 0.8 * red else "warm"


def shares(words: Iterable[str]) -> str:
    """How often each of some words comes."""
    counts = Counter(words)
    return ", ".join(f"{word} {count / counts.total():.0%}" for word, count in counts.most_common())


def draw_sheet(real: Path, split: SplitName, seed: int, path: Path) -> None:
    """Real plans, rooms and flats from above: floor by use, walls dark, furniture (and what is unknown) brown."""
    plans = np.load(real)
    names = [name for first in (0, 12, 24, 36) for name in plans.files[first : first + 3]]
    rows = [[on_coarse_grid(name, plans[name]) for name in names]]
    asked: tuple[tuple[PlanKind, int, int], ...] = (("room", 24, 12), ("flat", 8, 4))
    for kind, count, across in asked:
        made = [draw_plan(Request(kind, split, seed, number)).plan for number in range(count)]
        rows += [made[start : start + across] for start in range(0, count, across)]
    tiles = [[drawn(plan, 8) for plan in row] for row in rows]
    heights = [max(tile.height for tile in row) + SPACE_PX for row in tiles]
    sheet = Image.new("RGB", (SHEET_PX, sum(heights) + SPACE_PX), "white")
    for row, top in zip(tiles, np.cumsum([SPACE_PX, *heights[:-1]]), strict=True):
        left = SPACE_PX
        for tile in row:
            sheet.paste(tile, (left, int(top)))
            left += max(SHEET_PX // len(row) - 1, tile.width)
    sheet.save(path, optimize=True)


def drawn(plan: FloorPlan, cell_px: int) -> Image.Image:
    """A plan from above."""
    everything = np.concatenate([plan.cells, plan.walls])
    low = everything.min(axis=0)
    image = np.full((*(np.ptp(everything, axis=0) + 1), 3), FURNITURE, np.uint8)
    image[tuple((plan.walls - low).T)] = WALL
    for cell in plan.cells:
        uses = (area.use for area in plan.areas if (cell >= area.low).all() and (cell <= area.high).all())
        image[tuple(cell - low)] = FLOORS.get(next(uses, ""), (238, 238, 230))
    image[tuple((plan.doors - low).T)] = DOOR
    seen = image.swapaxes(0, 1)[::-1].repeat(cell_px, axis=0).repeat(cell_px, axis=1)
    return Image.fromarray(np.ascontiguousarray(seen))


def real_figures(path: Path) -> np.ndarray:
    """(plans, figures) of real plans on the grid of 0.5 m."""
    plans = np.load(path)
    return table([on_coarse_grid(name, plans[name]) for name in plans.files])


def on_coarse_grid(name: str, positions: np.ndarray) -> FloorPlan:
    """A plan of positions 0.25 m apart on a grid of 0.5 m; see the head of the file."""
    known = set(map(tuple, positions.tolist()))
    best: tuple[np.ndarray, np.ndarray] | None = None
    for corner in ((0, 0), (0, 1), (1, 0), (1, 1)):
        taken = positions[((positions - corner) % 2 == 0).all(axis=1)].astype(np.int64)
        cells = (taken - corner) // 2
        pairs, _ = neighbour_pairs(cells)
        open_ways = np.array([tuple(middle) in known for middle in (taken[pairs].sum(axis=1) // 2).tolist()], bool)
        parts, sizes = connected_parts(len(cells), pairs[open_ways])
        if sizes and (best is None or sizes[0] > len(best[0])):
            kept = parts == 0
            shut = edges_among(kept, pairs[~open_ways & kept[pairs].all(axis=1)])
            best = cells[kept], cells[kept][shut]
    assert best is not None
    return FloorPlan(name, best[0], best[1].reshape(-1, 2, 2), cell_size_m=0.5)


def drafts(use: str, count: int, seed: int) -> np.ndarray:
    """(plans, figures) of rooms of some use as they come, none of which is drawn again."""
    drawn = (draw_room(use, np.random.default_rng([seed, number])) for number in range(count))
    return table([finished(draft, use) for draft in drawn if draft is not None])


def table(plans: Sequence[FloorPlan]) -> np.ndarray:
    """(plans, figures)."""
    found = [plan_statistics(plan).to_json() for plan in plans]
    return np.array([[one[name] for name in FIGURES] for one in found], float)


def markdown(rows: dict[str, np.ndarray]) -> str:
    """A row a figure; what lies within the real rooms' 5 to 95 % beside each."""
    others = [name for name in rows if name != "real rooms"]
    head = ["figure", "real rooms", *(cell for name in others for cell in (name, "within"))]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for column, figure in enumerate(FIGURES):
        low, high = np.percentile(rows["real rooms"][:, column], [5, 95])
        cells = [spread(rows["real rooms"][:, column])]
        for name in others:
            values = rows[name][:, column]
            cells += [spread(values), f"{((values >= low) & (values <= high)).mean():.0%}"]
        lines.append("| " + " | ".join([figure.replace("_", " "), *cells]) + " |")
    return "\n".join(lines)


def spread(values: np.ndarray) -> str:
    """5, 50 and 95 %."""
    digits = 2 if values.max() <= 1 else 1
    return " / ".join(f"{value:.{digits}f}".removesuffix(".0") for value in np.percentile(values, [5, 50, 95]))


if __name__ == "__main__":
    main()
