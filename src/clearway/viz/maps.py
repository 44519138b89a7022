"""A room from above with its zones and the ways that agents took through it (as in the paper's Figure 1).

Zones belong to poses, so each cell is drawn as four triangles, one for each heading: the upper triangle of a cell is
the pose that looks up the map (+z), the right one the pose that looks right (+x).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from clearway import colours
from clearway.scenes.scene import Scene
from clearway.viz.figures import LINES, LineStyle, Look, counted, halo, new_figure
from clearway.zones import Zone

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

WIDTH_IN = 6.4
LEGEND_HEIGHT_IN, TITLE_HEIGHT_IN = 0.9, 0.3
VEIL = 0.45  # white over the cells in the picture from above, so that what is drawn on them stands out
ZONE_OPACITY = {Zone.PRECOLLISION: 0.55, Zone.COLLISION: 0.55}
HATCH_INK = "#5c0f0b"
MARGIN_M = 0.1
SCALE_BAR_M, SCALE_BAR_SPACE_M = 1.0, 0.3
LANE_PT = 5.2  # between the lines of two agents that walk the same way
LINE_PT, HALO_PT = 2.4, 4.4
ARROW_EVERY_M = 1.0


@dataclass(frozen=True)
class Walk:
    """An agent's way through a scene.

    Attributes:
        label: stands in the legend.
        states: (T + 1,) int, in the scene's own numbering; two alike in a row are a blocked move.
    """

    label: str
    states: np.ndarray

    @property
    def bumps(self) -> np.ndarray:
        """(T,) bool, the step was a blocked move (a turn always changes the state)."""
        return self.states[1:] == self.states[:-1]


def draw_map(
    scene: Scene,
    path: Path,
    *,
    zones: np.ndarray,
    target: int | None = None,
    walks: Sequence[Walk] = (),
    title: str = "",
) -> None:
    """Draw a scene from above and save it as PNG.

    Args:
        scene: with or without a picture from above.
        path: of the picture.
        zones: (S,) int, zone of each pose (`zones.Zone`).
        target: the target's state, or None.
        walks: drawn over each other in this order, each in its own lane.
        title: stands above.
    """
    assert zones.shape == (scene.state_count,)
    left, right, low, high = map_extent(scene)
    bottom = low - SCALE_BAR_SPACE_M
    height_in = WIDTH_IN * (high - bottom) / (right - left)
    lane_m = LANE_PT / 72 * (right - left) / WIDTH_IN
    with new_figure(WIDTH_IN, height_in + LEGEND_HEIGHT_IN + (TITLE_HEIGHT_IN if title else 0), path) as figure:
        axes = figure.add_subplot()
        axes.set(xlim=(left, right), ylim=(bottom, high), aspect="equal")
        axes.set_axis_off()
        if title:
            axes.set_title(title, loc="left", fontsize=12, fontweight="bold")
        _draw_room(axes, scene)
        entries = _draw_zones(axes, scene, zones)
        for index, walk in enumerate(walks):
            lane = (index - (len(walks) - 1) / 2) * lane_m
            entries.append(_draw_walk(axes, scene, walk, LINES[index % len(LINES)], lane))
        entries += _draw_ends(axes, scene, walks, target)
        _draw_scale_bar(axes, right, low)
        figure.legend(
            handles=entries, loc="outside lower left", ncols=2, fontsize=8, handlelength=2.6, columnspacing=1.6
        )


def map_extent(scene: Scene) -> tuple[float, float, float, float]:
    """The rectangle of the map, metres: x from, x to, z from, z to."""
    view = scene.top_view
    if view is not None:
        return view.x_min_m, view.x_max_m, view.z_min_m, view.z_max_m
    reach = scene.cell_size_m / 2 + MARGIN_M
    (left, low), (right, high) = scene.locations_m.min(axis=0) - reach, scene.locations_m.max(axis=0) + reach
    return float(left), float(right), float(low), float(high)


def _draw_room(axes: Axes, scene: Scene) -> None:
    """The picture from above, its cells under a veil; without one a dark ground with light cells."""
    from matplotlib.patches import Rectangle

    left, right, low, high = map_extent(scene)
    if scene.top_view is not None:
        axes.imshow(scene.top_view.image, extent=(left, right, low, high), origin="upper", aspect="equal")
    else:
        axes.add_patch(Rectangle((left, low), right - left, high - low, facecolor=colours.WALL, linewidth=0))
    fill = colours.ZONE_COLOURS["free"] if scene.top_view is None else ("white", VEIL)
    side = scene.cell_size_m
    _, first = np.unique(scene.cells, return_index=True)
    for x, z in scene.locations_m[first]:
        corner = (x - side / 2, z - side / 2)
        axes.add_patch(Rectangle(corner, side, side, facecolor=fill, edgecolor="white", linewidth=0.8))


def _triangles(scene: Scene) -> np.ndarray:
    """The triangle of each pose on the map, (S, 3, 2) metres: the part of its cell that it looks at."""
    reach = 0.94 * scene.cell_size_m / 2
    turn = np.deg2rad(scene.headings_deg)
    ahead = np.stack([np.sin(turn), np.cos(turn)], axis=1)
    aside = np.stack([np.cos(turn), -np.sin(turn)], axis=1) * np.tan(np.deg2rad(scene.turn_deg) / 2)
    corners = np.stack([0 * ahead, ahead + aside, ahead - aside], axis=1)
    return scene.locations_m[:, None] + reach * corners


def _draw_zones(axes: Axes, scene: Scene, zones: np.ndarray) -> list[Artist]:
    """Precollision plain, collision hatched; returns their legend entries."""
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Patch

    corners = _triangles(scene)
    names = {
        Zone.COLLISION: "collision zone: a move is blocked",
        Zone.PRECOLLISION: "precollision zone: one move before it",
    }
    entries: list[Artist] = []
    for zone, label in names.items():
        colour = colours.ZONE_COLOURS[zone.name.lower()]
        hatch = "////" if zone is Zone.COLLISION else None
        look: Look = {"facecolor": colour, "alpha": ZONE_OPACITY[zone], "linewidth": 0, "hatch": hatch}
        axes.add_collection(PolyCollection(corners[zones == zone], edgecolor=HATCH_INK, **look))
        entries.append(Patch(label=label, edgecolor=HATCH_INK, **look))
    note = f"triangles of a cell: its {scene.heading_count} headings"
    entries.append(Patch(facecolor="white", edgecolor="#b9bec5", linewidth=0.8, label=note))
    return entries


def _draw_walk(axes: Axes, scene: Scene, walk: Walk, style: LineStyle, lane_m: float) -> Artist:
    """The way as a line with arrows, moved aside by its lane; crosses where moves were blocked."""
    from matplotlib.lines import Line2D

    places = scene.locations_m[walk.states] + lane_m  # aside from horizontal and from vertical ways alike
    line: Look = {"color": style.colour, "linewidth": LINE_PT, "solid_capstyle": "round", "dash_capstyle": "butt"}
    axes.plot(*places.T, linestyle="-", color=style.halo, linewidth=HALO_PT, solid_capstyle="round", zorder=3)
    axes.plot(*places.T, linestyle=style.pattern, zorder=3.1, **line)
    _draw_arrows(axes, places, max(1, round(ARROW_EVERY_M / scene.cell_size_m)), style)
    bumps = places[1:][walk.bumps]
    if len(bumps):
        cross: Look = {"marker": "X", "s": 80, "linewidth": 1.0, "edgecolor": style.halo, "zorder": 4.5}
        axes.scatter(*bumps.T, color=style.colour, **cross)
    steps, collisions = len(walk.states) - 1, int(walk.bumps.sum())
    label = f"{walk.label}: {counted(steps, 'step')}, {counted(collisions, 'collision')}"
    return Line2D([], [], linestyle=style.pattern, label=label, path_effects=halo(style.halo, HALO_PT), **line)


def _draw_arrows(axes: Axes, places: np.ndarray, every: int, style: LineStyle) -> None:
    """Arrowheads amid every so many moves, places (T + 1, 2) metres."""
    moved = np.flatnonzero((places[1:] != places[:-1]).any(axis=1))
    for step in moved[every // 2 :: every]:
        along_x, along_z = places[step + 1] - places[step]
        heading_deg = np.rad2deg(np.arctan2(along_x, along_z))
        middle = (places[step] + places[step + 1]) / 2
        _draw_dart(axes, middle, heading_deg, size_pt=8.5, colour=style.colour, edge=style.halo, zorder=3.2)


def _draw_ends(axes: Axes, scene: Scene, walks: Sequence[Walk], target: int | None) -> list[Artist]:
    """Start poses as discs and the target as a star, each with a dart along its heading; returns legend entries."""
    from matplotlib.lines import Line2D

    entries: list[Artist] = []
    mark: Look = {"linestyle": "none", "markeredgecolor": "white", "markeredgewidth": 1.2}
    starts = dict.fromkeys(int(walk.states[0]) for walk in walks)
    for start in starts:
        _draw_pose(axes, scene, start, "o", 11, colours.INK)
    if starts:
        label = "start; the dart shows the heading"
        entries.append(Line2D([], [], marker="o", markersize=8, color=colours.INK, label=label, **mark))
    if target is not None:
        _draw_pose(axes, scene, target, "*", 19, colours.TARGET)
        label = "target position and heading"
        entries.append(Line2D([], [], marker="*", markersize=13, color=colours.TARGET, label=label, **mark))
    if any(walk.bumps.any() for walk in walks):
        label = "blocked move (a collision)"
        entries.append(Line2D([], [], marker="X", markersize=8, color=colours.BUMP, label=label, **mark))
    return entries


def _draw_pose(axes: Axes, scene: Scene, state: int, marker: str, size_pt: float, colour: str) -> None:
    """A mark at a pose's place and a dart ahead of it."""
    place, heading_deg = scene.locations_m[state], float(scene.headings_deg[state])
    turn = np.deg2rad(heading_deg)
    ahead = place + 0.36 * scene.cell_size_m * np.array([np.sin(turn), np.cos(turn)])
    _draw_dart(axes, ahead, heading_deg, size_pt=9.5, colour=colour, edge="white", zorder=5)
    edge: Look = {"markeredgecolor": "white", "markeredgewidth": 1.4}
    axes.plot(*place, marker=marker, markersize=size_pt, color=colour, zorder=5.1, **edge)


def _draw_dart(
    axes: Axes, place: np.ndarray, heading_deg: float, *, size_pt: float, colour: str, edge: str, zorder: float
) -> None:
    """A triangle that points along a heading; matplotlib turns markers the other way round."""
    look: Look = {"markersize": size_pt, "color": colour, "markeredgecolor": edge, "markeredgewidth": 0.9}
    axes.plot(*place, marker=(3, 0, -heading_deg), zorder=zorder, **look)


def _draw_scale_bar(axes: Axes, right_m: float, low_m: float) -> None:
    """Below the room, at its right."""
    height_m = low_m - SCALE_BAR_SPACE_M / 2
    ends_m = [right_m - SCALE_BAR_M - 0.02, right_m - 0.02]
    axes.plot(ends_m, [height_m] * 2, color=colours.INK, linewidth=2, marker="|", markersize=7)
    axes.text(ends_m[0] - 0.08, height_m, f"{SCALE_BAR_M:g} m", ha="right", va="center", fontsize=8)
