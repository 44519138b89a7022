"""Generated rooms and flats on one sheet, from above and from inside.

    python docs/pictures/generated.py room 24 docs/pictures/generated-rooms.jpg
    python docs/pictures/generated.py flat 8 docs/pictures/generated-flats.jpg

Those of `--split train --seed 0`, in order. A view is from the free pose of a room before which most of that room lies.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps

from clearway.generation.plans import generated_plan
from clearway.generation.request import KINDS, Request
from clearway.rooms.camera import first_person_view
from clearway.rooms.plans.plan_room import build_plan_room
from clearway.rooms.render import render
from clearway.rooms.topview import render_top_view
from clearway.scenes.floor_plans import Area, FloorPlan

SPACE_PX = 8
ABOVE_PX = {"room": (220, 220), "flat": (330, 330)}  # width and height of the view from above, at most
INSIDE_PX = {"room": (220, 165), "flat": (216, 161)}
ACROSS = {"room": 6, "flat": 2}
VIEWED = ("living room", "kitchen", "bedroom", "bathroom")
LARGER = 2  # pictures are drawn larger and made smaller
WALL = (70, 70, 70)  # around the view from above, whose outer walls have no thickness
WORTH = 8  # cells that two free ones ahead are worth
SLOPE = 0.75  # of the sides of what is before a pose


def main() -> None:
    """Draw the sheet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("count", type=int)
    parser.add_argument("path", type=Path, help="of the sheet")
    parser.add_argument("--first", type=int, default=0, help="number of the first one")
    given = parser.parse_args()
    requests = [Request(given.kind, "train", 0, given.first + number) for number in range(given.count)]
    tiles = [tile(request) for request in requests]
    width, height = (max(side) + SPACE_PX for side in zip(*(one.size for one in tiles), strict=True))
    across = ACROSS[given.kind]
    sheet = Image.new("RGB", (across * width, -(-len(tiles) // across) * height), "white")
    for number, one in enumerate(tiles):
        sheet.paste(one, (number % across * width, number // across * height))
    sheet.save(given.path, quality=84, optimize=True)


def tile(request: Request) -> Image.Image:
    """One plan: from above, and from inside below it or, of a flat, twice beside it."""
    plan = generated_plan(request)
    room, layout = build_plan_room(plan, request.seed)
    model = room.spec.compile()
    above = Image.fromarray(render_top_view(model, room.width_m, room.depth_m, here=True).image)
    wide, high = INSIDE_PX[request.kind]
    poses = best_poses(plan, 1 if request.kind == "room" else 2)
    places_m = np.array([cell for cell, _ in poses]) * plan.cell_size_m - np.array(layout.origin_m)
    headings = np.array([90 * heading for _, heading in poses])
    view = first_person_view(places_m, headings, height_px=LARGER * high, width_px=LARGER * wide)
    inside = [Image.fromarray(picture).resize((wide, high)) for picture in render(model, view, here=True)]
    most = ABOVE_PX[request.kind]
    share = min(side / own for side, own in zip(most, above.size, strict=True))
    size = round(share * above.width), round(share * above.height)
    above = ImageOps.expand(
        above.resize(size, Image.Resampling.LANCZOS).crop((2, 2, size[0] - 2, size[1] - 2)), 2, WALL
    )
    beside = request.kind == "flat"
    whole = Image.new("RGB", (most[0] + SPACE_PX + wide, most[1]) if beside else (most[0], most[1] + high), "white")
    whole.paste(above, ((most[0] - above.width) // 2, (most[1] - above.height) // 2))
    for number, picture in enumerate(inside):
        whole.paste(picture, (most[0] + SPACE_PX, number * (high + SPACE_PX)) if beside else (0, most[1]))
    return whole


def best_poses(plan: FloorPlan, count: int) -> list[tuple[np.ndarray, int]]:
    """A cell and a heading (a quarter turn each) in so many areas, those of `VIEWED` first."""
    areas = sorted(plan.areas, key=lambda area: (*VIEWED, "corridor").index(area.use))
    distinct = [area for number, area in enumerate(areas) if area.use not in [one.use for one in areas[:number]]]
    return [best_pose(plan, [one for one in areas if one.use == area.use]) for area in distinct[:count]]


def best_pose(plan: FloorPlan, areas: list[Area]) -> tuple[np.ndarray, int]:
    """The cell and heading in some areas before which most cells of them lie; two free cells ahead are worth more."""
    free = {(x, z) for x, z in plan.cells.tolist()}
    cells = np.concatenate([np.argwhere(np.ones(np.subtract(a.high, a.low) + 1, bool)) + a.low for a in areas])
    inside = [cell for cell in plan.cells if any((cell >= a.low).all() and (cell <= a.high).all() for a in areas)]
    found = []
    for cell in inside:
        for heading, (dx, dz) in enumerate(((0, 1), (1, 0), (0, -1), (-1, 0))):
            x, z = (cells - cell).T
            ahead, aside = x * dx + z * dz, np.abs(x * dz - z * dx)
            open_ahead = all((int(cell[0]) + n * dx, int(cell[1]) + n * dz) in free for n in (1, 2))
            found.append((WORTH * open_ahead + int(((ahead > 1) & (aside <= SLOPE * ahead)).sum()), cell, heading))
    _, cell, heading = max(found, key=lambda one: one[0])
    return cell, heading


if __name__ == "__main__":
    main()
