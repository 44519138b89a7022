"""The marks on maps, drawn with Pillow: agent, target, blocked move, zone swatch. Sizes are shares of a cell's side.

Headings are clockwise from upwards on the picture. Draw on an image `FINENESS` times larger and scale it down, which
smooths all edges.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw

from clearway import colours
from clearway.zones import ZONE_NAMES, Zone

FINENESS = 3
HATCH_PERIOD_PX, HATCH_WIDTH_PX = 7.0, 2.6  # of the scaled-down picture
STRIPE_OPACITY, GROUND_OPACITY = 0.95, 0.55  # of the collision zone: its stripes and between them
STAR_WAIST = 0.48  # inner radius of the star as a share of the outer

Point = tuple[float, float]


def draw_agent(
    pen: ImageDraw.ImageDraw,
    centre: Point,
    cell_px: float,
    heading_deg: float,
    *,
    colour: str = colours.AGENT,
    edge: str = "white",
) -> None:
    """An arrowhead along the heading, with an edge."""
    outline = ((1.0, 0.0), (-0.80, 0.78), (-0.42, 0.0), (-0.80, -0.78))  # ahead, right
    for size, fill in ((0.62, edge), (0.46, colour)):
        pen.polygon(_turned(outline, centre, size * cell_px, heading_deg), fill=fill)


def draw_target(pen: ImageDraw.ImageDraw, centre: Point, cell_px: float, heading_deg: float | None = None) -> None:
    """A star with a white edge, and a dart ahead of it that shows the heading."""
    corners = np.arange(10) * np.pi / 5
    for grown, colour in ((0.11, "white"), (0.0, colours.TARGET)):
        if heading_deg is not None:
            dart = (0.78 + 1.6 * grown, 0.0), (0.5 - grown, 0.2 + grown), (0.5 - grown, -0.2 - grown)
            pen.polygon(_turned(dart, centre, cell_px, heading_deg), fill=colour)
        reach = np.where(np.arange(10) % 2 == 0, 1.0, STAR_WAIST + grown) * (0.42 + grown)
        star = np.stack([reach * np.cos(corners), reach * np.sin(corners)], axis=1).tolist()
        pen.polygon(_turned(star, centre, cell_px, 0.0), fill=colour)


def draw_bump(pen: ImageDraw.ImageDraw, centre: Point, cell_px: float) -> None:
    """A cross with a white edge."""
    for arm, width, colour in ((0.19, 0.20, "white"), (0.15, 0.09, colours.BUMP)):
        for slope in (-1, 1):
            reach = arm * cell_px
            ends = [(centre[0] + side * reach, centre[1] + side * slope * reach) for side in (-1, 1)]
            pen.line(ends, fill=colour, width=round(width * cell_px))


def draw_disc(pen: ImageDraw.ImageDraw, centre: Point, radius_px: float, colour: str) -> None:
    """A filled disc."""
    x, y = centre
    pen.ellipse((x - radius_px, y - radius_px, x + radius_px, y + radius_px), fill=colour)


def paint_zone(image: Image.Image, zone: Zone, mask: np.ndarray, opacity: float) -> None:
    """Lay a zone's colour over the pixels of mask (height, width) bool; the collision zone is hatched."""
    alpha = np.full(mask.shape, opacity)
    if zone == Zone.COLLISION:
        rows, columns = np.indices(mask.shape)
        stripe = (rows + columns) / FINENESS % HATCH_PERIOD_PX < HATCH_WIDTH_PX
        alpha = opacity * np.where(stripe, STRIPE_OPACITY, GROUND_OPACITY)
    colour = Image.new("RGB", image.size, colours.ZONE_COLOURS[ZONE_NAMES[zone]])
    image.paste(colour, mask=Image.fromarray((mask * alpha * 255).astype(np.uint8)))


def _turned(points: Sequence[Sequence[float]], centre: Point, scale: float, heading_deg: float) -> list[Point]:
    """Points given as (ahead, right) around a centre, as pixels."""
    turn = np.deg2rad(heading_deg)
    ahead, right = np.asarray(points, float).T * scale
    x = centre[0] + ahead * np.sin(turn) + right * np.cos(turn)
    y = centre[1] - ahead * np.cos(turn) + right * np.sin(turn)
    return list(zip(x.tolist(), y.tolist(), strict=True))
