"""A room from above as a picture: zones of every pose, the path so far, the agent, the target.

Each cell is made of triangles, one a heading (the upper one looks along +z), coloured by the pose's zone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw

from clearway import colours
from clearway.envs.marks import FINENESS, Point, draw_agent, draw_bump, draw_disc, draw_target, paint_zone
from clearway.scenes.actions import Action
from clearway.scenes.scene import Scene
from clearway.zones import Zone

MARGIN_CELLS = 1.0  # around the outermost cells' centres
CELL_SHARE = 0.94  # side of a cell's square as a share of the grid step, so that the grid shows
OPACITY_ON_PICTURE = {Zone.FREE: 0.3, Zone.PRECOLLISION: 0.6, Zone.COLLISION: 0.8}
MAX_CELL_PX = 52  # in a very small room the map stays below the size it is given
PICTURE_FADE = 0.3  # share of white in the picture from above, so that the marks stand out
PATH_WIDTH, PATH_EDGE_WIDTH = 0.16, 0.28  # in cells


@dataclass(frozen=True)
class Ink:
    """The colours of an agent and of its way."""

    agent: str = colours.AGENT
    path: str = colours.PATH
    edge: str = "white"


PLAIN = Ink()


class FloorMap:
    """A scene's map.

    Args:
        scene: the scene.
        zones: (S,) int, zone of each of its poses.
        size: largest width and height, pixels.
    """

    def __init__(self, scene: Scene, zones: np.ndarray, size: tuple[int, int]) -> None:
        self._scene = scene
        x_min, x_max, z_min, z_max = _extent_m(scene)
        scale = min(size[0] / (x_max - x_min), size[1] / (z_max - z_min), MAX_CELL_PX / scene.cell_size_m)
        self.size = max(1, round((x_max - x_min) * scale)), max(1, round((z_max - z_min) * scale))
        self._pixels_per_m = scale * FINENESS
        self._cell_px = scene.cell_size_m * self._pixels_per_m
        self._left_m, self._top_m = x_min, z_max
        self._base = self._paint_base(zones)

    def draw(self, states: np.ndarray, bumps: np.ndarray, target: int, ink: Ink = PLAIN) -> Image.Image:
        """The map with an episode on it.

        Args:
            states: (T + 1,) int, the path in the scene's own numbering; the agent is at its end.
            bumps: (B, 2) int, state and action of each blocked move.
            target: the target state.
            ink: of the agent.
        """
        image = self._base.copy()
        pen = ImageDraw.Draw(image)
        self._draw_path(pen, states, ink)
        draw_target(pen, self._at(target), self._cell_px, self._heading(target))
        for state, action in bumps.tolist():
            ahead = 0.5 if action == Action.MOVE_FORWARD else -0.5
            draw_bump(pen, self._at(state, ahead * self._scene.cell_size_m), self._cell_px)
        here = int(states[-1])
        draw_agent(pen, self._at(here), self._cell_px, self._heading(here), colour=ink.agent, edge=ink.edge)
        return image.resize(self.size, Image.Resampling.LANCZOS)

    def _paint_base(self, zones: np.ndarray) -> Image.Image:
        image = Image.new("RGB", (self.size[0] * FINENESS, self.size[1] * FINENESS), colours.WALL)
        view = self._scene.top_view
        if view is None:
            cells = self._poses_mask(np.arange(self._scene.state_count), image.size)
            image.paste(Image.new("RGB", image.size, colours.PAPER), mask=Image.fromarray(cells))
        else:
            left, top = self._pixel(view.x_min_m, view.z_max_m)
            right, bottom = self._pixel(view.x_max_m, view.z_min_m)
            picture = Image.fromarray(np.asarray(view.image)).convert("RGB")
            picture = picture.resize((round(right - left), round(bottom - top)), Image.Resampling.LANCZOS)
            picture = Image.blend(picture, Image.new("RGB", picture.size, "white"), PICTURE_FADE)
            image.paste(picture, (round(left), round(top)))
        for zone in Zone:
            mask = self._poses_mask(np.flatnonzero(zones == zone), image.size)
            paint_zone(image, zone, mask, 1.0 if view is None else OPACITY_ON_PICTURE[zone])
        return image

    def _poses_mask(self, states: np.ndarray, size: tuple[int, int]) -> np.ndarray:
        """(height, width) bool: the triangles of some poses."""
        mask = Image.new("1", size)
        pen = ImageDraw.Draw(mask)
        half = self._scene.cell_size_m / 2 * CELL_SHARE
        aside = half * np.tan(np.deg2rad(self._scene.turn_deg) / 2)  # four triangles make a square
        for state in states.tolist():
            pen.polygon([self._at(state), self._at(state, half, -aside), self._at(state, half, aside)], fill=1)
        return np.asarray(mask)

    def _draw_path(self, pen: ImageDraw.ImageDraw, states: np.ndarray, ink: Ink) -> None:
        points = [self._at(state) for state in states.tolist()]
        for share, colour in ((PATH_EDGE_WIDTH, ink.edge), (PATH_WIDTH, ink.path)):
            if len(set(points)) > 1:
                pen.line(points, fill=colour, width=round(share * self._cell_px), joint="curve")
        for radius, colour in ((0.26, ink.edge), (0.20, ink.path), (0.09, ink.edge)):
            draw_disc(pen, points[0], radius * self._cell_px, colour)

    def _heading(self, state: int) -> float:
        return float(self._scene.headings_deg[state])

    def _at(self, state: int, ahead_m: float = 0.0, right_m: float = 0.0) -> Point:
        """Pixel of the point so far ahead and to the right of a pose."""
        turn = np.deg2rad(self._heading(state))
        x = self._scene.locations_m[state, 0] + ahead_m * np.sin(turn) + right_m * np.cos(turn)
        z = self._scene.locations_m[state, 1] + ahead_m * np.cos(turn) - right_m * np.sin(turn)
        return self._pixel(x, z)

    def _pixel(self, x_m: float, z_m: float) -> Point:
        return float((x_m - self._left_m) * self._pixels_per_m), float((self._top_m - z_m) * self._pixels_per_m)


def _extent_m(scene: Scene) -> tuple[float, float, float, float]:
    """x_min, x_max, z_min, z_max of the map: the cells with a margin, and the picture from above if there is one."""
    low = scene.locations_m.min(axis=0) - MARGIN_CELLS * scene.cell_size_m
    high = scene.locations_m.max(axis=0) + MARGIN_CELLS * scene.cell_size_m
    if scene.top_view is not None:
        low = np.minimum(low, [scene.top_view.x_min_m, scene.top_view.z_min_m])
        high = np.maximum(high, [scene.top_view.x_max_m, scene.top_view.z_max_m])
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])
