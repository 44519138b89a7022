"""What `render` shows: the agent's view, the target's picture and the map side by side, or the map as text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from clearway import colours
from clearway.envs.floor_map import FloorMap
from clearway.envs.marks import FINENESS, draw_agent, draw_bump, draw_target, paint_zone
from clearway.envs.record import EpisodeSoFar
from clearway.scenes.scene import Scene
from clearway.zones import ZONE_NAMES, Zone

if TYPE_CHECKING:
    from clearway.world.world import World

RENDER_MODES = ("rgb_array", "ansi")
PANEL_HEIGHT_PX = 360
MAP_WIDTH_PX = 480
MARGIN_PX = 16
CAPTION_HEIGHT_PX, LEGEND_HEIGHT_PX, TEXT_SIZE_PX = 34, 42, 16
SMOOTH_FROM_PX = 90  # pictures lower than this are made-up ones: enlarge them pixel by pixel
LONGEST_NAME = 24  # letters, with which there is room for more
ARROWS = "↑↗→↘↓↙←↖"  # headings 0, 45, 90, ...
ANSI_MARKS = {Zone.FREE: "·", Zone.PRECOLLISION: "-", Zone.COLLISION: "!"}


class Renderer:
    """Draws episodes of a world.

    Args:
        scenes: the scenes of the world, in its order.
        world: its tables.
    """

    def __init__(self, scenes: Sequence[Scene], world: World) -> None:
        self._scenes, self._first = list(scenes), world.scene_offset.numpy()
        self._zones, self._target_scene = world.zone.numpy(), world.target_scene.numpy()
        self._target_state = world.target_state.numpy()
        self._steps_to = world.distance_table()
        self._maps: dict[int, FloorMap] = {}

    def rgb(self, episode: EpisodeSoFar, target: int) -> np.ndarray:
        """The frame, (height, width, 3) uint8.

        Args:
            episode: the episode so far.
            target: which of the world's targets it seeks.
        """
        index, states, bumps, goal = self._in_scene(episode, target)
        scene = self._scenes[index]
        room_map = self._map(index).draw(states, bumps, goal)
        panels = [_picture(scene, int(states[-1])), _picture(scene, goal), room_map]
        detail = ", a triangle for each heading" if len(scene.name) <= LONGEST_NAME else ""
        captions = ("view", "target", f"{scene.name} from above{detail}")
        return np.asarray(_side_by_side(panels, captions, self._status(episode, target)))

    def ansi(self, episode: EpisodeSoFar, target: int) -> str:
        """The map as text: an arrow for the agent, T for the target, each cell by the worst zone of its headings."""
        index, states, _, goal = self._in_scene(episode, target)
        scene = self._scenes[index]
        grid = np.round((scene.locations_m - scene.locations_m.min(axis=0)) / scene.cell_size_m).astype(int)
        width, depth = grid.max(axis=0) + 1
        worst = np.full((width, depth), -1)
        np.maximum.at(worst, tuple(grid.T), self._scene_zones(index))
        text = [[ANSI_MARKS[Zone(zone)] if zone >= 0 else " " for zone in column] for column in worst.tolist()]
        text[grid[goal, 0]][grid[goal, 1]] = "T"
        here = int(states[-1])
        text[grid[here, 0]][grid[here, 1]] = ARROWS[round(scene.headings_deg[here] / 45) % len(ARROWS)]
        rows = [" ".join(text[x][z] for x in range(width)).rstrip() for z in reversed(range(depth))]
        return "\n".join([self._status(episode, target), *rows])

    def _in_scene(self, episode: EpisodeSoFar, target: int) -> tuple[int, np.ndarray, np.ndarray, int]:
        """The target's scene; path, bumps and target state in that scene's own numbering."""
        index = int(self._target_scene[target])
        first = int(self._first[index])
        return index, episode.states - first, episode.bumps - [first, 0], int(self._target_state[target]) - first

    def _scene_zones(self, index: int) -> np.ndarray:
        return self._zones[self._first[index] : self._first[index + 1]]

    def _map(self, index: int) -> FloorMap:
        if index not in self._maps:
            size = MAP_WIDTH_PX, PANEL_HEIGHT_PX
            self._maps[index] = FloorMap(self._scenes[index], self._scene_zones(index), size)
        return self._maps[index]

    def _status(self, episode: EpisodeSoFar, target: int) -> str:
        here, bumps = int(episode.states[-1]), len(episode.bumps)
        to_go = int(self._steps_to[target, here])
        zone = ZONE_NAMES[self._zones[here]]
        ways = {0: "at the target", -1: "no way to the target"}
        place = ways.get(to_go, f"{_counted(to_go, 'step')} to go")
        return f"step {len(episode.states) - 1}  ·  {_counted(bumps, 'collision')}  ·  {place}  ·  {zone} zone"


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _picture(scene: Scene, state: int) -> Image.Image:
    """A state's picture at the panels' height; an empty panel where the scene has no pictures."""
    if scene.observations is None:
        image = Image.new("RGB", (PANEL_HEIGHT_PX * 4 // 3, PANEL_HEIGHT_PX), colours.ZONE_COLOURS["free"])
        middle = image.width // 2, image.height // 2
        ImageDraw.Draw(image).text(middle, "no pictures in this scene", colours.FAINT_INK, _font(16), anchor="mm")
        return image
    image = Image.fromarray(np.asarray(scene.observations[state : state + 1][0]))
    size = max(1, image.width * PANEL_HEIGHT_PX // image.height), PANEL_HEIGHT_PX
    smooth = image.height >= SMOOTH_FROM_PX
    return image.resize(size, Image.Resampling.LANCZOS if smooth else Image.Resampling.NEAREST)


def _side_by_side(panels: Sequence[Image.Image], captions: Sequence[str], status: str) -> Image.Image:
    """The panels with their captions above, and the status and the legend below."""
    widths = [*(panel.width for panel in panels[:-1]), max(panels[-1].width, MAP_WIDTH_PX)]
    width = sum(widths) + MARGIN_PX * (len(panels) + 1)
    frame = Image.new("RGB", (width, CAPTION_HEIGHT_PX + PANEL_HEIGHT_PX + LEGEND_HEIGHT_PX), colours.PAPER)
    pen = ImageDraw.Draw(frame)
    left = MARGIN_PX
    for panel, caption, space in zip(panels, captions, widths, strict=True):
        pen.text((left, CAPTION_HEIGHT_PX / 2), caption, colours.INK, _font(TEXT_SIZE_PX), anchor="lm")
        top = CAPTION_HEIGHT_PX + (PANEL_HEIGHT_PX - panel.height) // 2
        frame.paste(panel, (left, top))
        left += space + MARGIN_PX
    middle = CAPTION_HEIGHT_PX + PANEL_HEIGHT_PX + LEGEND_HEIGHT_PX / 2
    pen.text((MARGIN_PX, middle), status, colours.INK, _font(TEXT_SIZE_PX), anchor="lm")
    legend = _legend()
    frame.paste(legend, (width - MARGIN_PX - legend.width, round(middle - legend.height / 2)))
    return frame


def _legend() -> Image.Image:
    """One line that names the marks of the map; drawn larger and scaled down, as the map is."""
    cell, font = 18.0 * FINENESS, _font(TEXT_SIZE_PX * FINENESS)
    gap, between = 0.5 * cell, 1.0 * cell
    names = ("agent", "target", "blocked move", "collision zone", "precollision zone")
    width = sum(cell + gap + font.getlength(name) for name in names) + between * (len(names) - 1)
    image = Image.new("RGB", (int(width) + 1, int(1.6 * cell)), colours.PAPER)
    pen = ImageDraw.Draw(image)
    left, middle = 0.0, 0.8 * cell
    for name in names:
        centre = left + cell / 2, middle
        if name == "agent":
            draw_agent(pen, centre, 1.1 * cell, 0.0)
        elif name == "target":
            draw_target(pen, centre, 1.1 * cell)
        elif name == "blocked move":
            draw_bump(pen, centre, 1.6 * cell)
        else:
            zone = Zone.COLLISION if name == "collision zone" else Zone.PRECOLLISION
            mask = np.zeros((image.height, image.width), bool)
            mask[round(middle - cell / 2) : round(middle + cell / 2), round(left) : round(left + cell)] = True
            paint_zone(image, zone, mask, 1.0)
        pen.text((left + cell + gap, middle), name, colours.INK, font, anchor="lm")
        left += cell + gap + font.getlength(name) + between
    return image.resize((image.width // FINENESS, image.height // FINENESS), Image.Resampling.LANCZOS)


def _font(size_px: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size_px)
