"""What an agent with a map holds, painted on the room from above, with the way that it walked."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from PIL import Image, ImageDraw

from clearway import colours
from clearway.envs.marks import FINENESS, Point, draw_agent, draw_bump, draw_disc, draw_target
from clearway.mapping.held import Held
from clearway.scenes.scene import Scene
from clearway.viz.maps import map_extent

SHADE, SHADE_SHARE = (29, 35, 41), 0.62  # over the room
STANDS = "white"
STANDS_SHARE = 0.72
LEAST_MARK, MOST_MARK, LEAST_SCALE = 0.15, 0.75, 0.05  # strength of the target's marks; a probability that is little
PATH_SHARE, EDGE_SHARE, REACH = 0.09, 0.17, 0.47  # of a cell
HOLLOW = "#d81b60"
MEANING = "what it holds: light, free; green, the target; red, itself"


def held_picture(scene: Scene, held: Held, states: np.ndarray, target: int, size: tuple[int, int]) -> Image.Image:
    """The room from above, not larger than a size (width, height).

    Args:
        scene: with or without a picture from above.
        held: after the last of the states.
        states: (T + 1,) int, the way so far in the scene's own numbering; two alike in a row are a blocked move.
        target: the target's state.
        size: pixels.
    """
    sheet = _Sheet(scene, size)
    base = sheet.base()
    cells = [(sheet.square(x_m, z_m), STANDS_SHARE * stands) for x_m, z_m, stands in held.cells.tolist()]
    _blend(base, cells, STANDS)
    most = max([*held.target[:, 3].tolist(), LEAST_SCALE])
    poses = [
        (sheet.triangle(x_m, z_m, heading_deg), LEAST_MARK + MOST_MARK * share / most)
        for x_m, z_m, heading_deg, share in held.target.tolist()
    ]
    _blend(base, poses, colours.TARGET)
    pen, cell = ImageDraw.Draw(base), sheet.cell_px
    draw_target(pen, sheet.of(scene, target), 0.62 * cell)
    points = [sheet.of(scene, state) for state in states.tolist()]
    for share, colour in ((EDGE_SHARE, "white"), (PATH_SHARE, colours.PATH)):
        if len(set(points)) > 1:
            pen.line(points, fill=colour, width=round(share * cell), joint="curve")
        draw_disc(pen, points[0], share * cell, colour)
    for state in states[1:][states[1:] == states[:-1]].tolist():
        draw_bump(pen, sheet.of(scene, state), 0.5 * cell)
    for x_m, z_m, heading_deg, _ in held.here[:1].tolist():
        _draw_hollow(pen, sheet.pixel(x_m, z_m), 0.34 * cell, heading_deg)
    draw_agent(pen, points[-1], 0.5 * cell, float(scene.headings_deg[states[-1]]))
    return base.resize(sheet.size, Image.Resampling.LANCZOS)


def _blend(image: Image.Image, shapes: Iterable[tuple[list[Point], float]], colour: str) -> None:
    """Paint polygons that do not overlap, each of a strength of its own."""
    mask = Image.new("L", image.size)
    pen = ImageDraw.Draw(mask)
    for corners, share in shapes:
        pen.polygon(corners, fill=round(255 * share))
    image.paste(colour, mask=mask, box=(0, 0, *image.size))


def _draw_hollow(pen: ImageDraw.ImageDraw, middle: Point, size: float, heading_deg: float) -> None:
    """An arrowhead's outline, larger than the agent's own."""
    turn = np.radians(heading_deg)
    ahead, right = np.array([np.sin(turn), -np.cos(turn)]), np.array([np.cos(turn), np.sin(turn)])
    corners = [np.array(middle) + size * (a * ahead + r * right) for a, r in ((1, 0), (-0.9, 0.85), (-0.9, -0.85))]
    closed = [tuple(corner.tolist()) for corner in (*corners, corners[0], corners[1])]
    pen.line(closed, fill=HOLLOW, width=max(2, round(0.22 * size)), joint="curve")


class _Sheet:
    """Pixels of a scene's map, finer than what is shown."""

    def __init__(self, scene: Scene, size: tuple[int, int]) -> None:
        self._scene = scene
        self._left_m, right_m, low_m, self._high_m = map_extent(scene)
        wide_m, deep_m = right_m - self._left_m, self._high_m - low_m
        scale = min(size[0] / wide_m, size[1] / deep_m)
        self.size = max(1, round(wide_m * scale)), max(1, round(deep_m * scale))
        self._pixels_per_m = scale * FINENESS
        self.cell_px = scene.cell_size_m * self._pixels_per_m

    def base(self) -> Image.Image:
        """The room in the dark."""
        fine = (self.size[0] * FINENESS, self.size[1] * FINENESS)
        shade = Image.new("RGB", fine, SHADE)
        view = self._scene.top_view
        return shade if view is None else Image.blend(Image.fromarray(view.image).resize(fine), shade, SHADE_SHARE)

    def pixel(self, x_m: float, z_m: float) -> Point:
        """Of a place."""
        return float((x_m - self._left_m) * self._pixels_per_m), float((self._high_m - z_m) * self._pixels_per_m)

    def of(self, scene: Scene, state: int) -> Point:
        """Of a state."""
        x_m, z_m = scene.locations_m[state].tolist()
        return self.pixel(x_m, z_m)

    def square(self, x_m: float, z_m: float) -> list[Point]:
        """Corners of a cell."""
        (x, y), reach = self.pixel(x_m, z_m), REACH * self.cell_px
        return [(x - reach, y - reach), (x + reach, y - reach), (x + reach, y + reach), (x - reach, y + reach)]

    def triangle(self, x_m: float, z_m: float, heading_deg: float) -> list[Point]:
        """Of a pose: the quarter of its cell that it looks at."""
        middle, turn = np.array(self.pixel(x_m, z_m)), np.radians(heading_deg)
        ahead, right = np.array([np.sin(turn), -np.cos(turn)]), np.array([np.cos(turn), np.sin(turn)])
        far = middle + REACH * self.cell_px * ahead
        aside = REACH * self.cell_px * right
        return [tuple(corner.tolist()) for corner in (middle, far + aside, far - aside)]
