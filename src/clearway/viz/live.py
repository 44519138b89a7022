"""Pictures of live evaluation: figures by setting with intervals, and one episode seen from above and by the agent."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from clearway import colours
from clearway.live.arrangement import Arrangement
from clearway.live.draws import Draws
from clearway.live.live_room import LiveRoom
from clearway.live.results import LiveResult
from clearway.live.walks import LiveOutcome, LiveScene
from clearway.rooms.camera import first_person_shot
from clearway.rooms.topview import render_top_view
from clearway.scenes.actions import BLOCKED, Action
from clearway.scenes.scene import Scene, TopView
from clearway.viz.figures import CURVES, LINES, Look, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANELS = (
    ("success", "success, %", 100.0),
    ("contacts", "contacts an episode", 1.0),
    ("min_clearance_m", "least clearance, cm", 100.0),
    ("share_within_10cm", "time within 10 cm, %", 100.0),
)
ROW_IN, HEAD_IN, LABELS_IN, PANEL_IN = 0.34, 0.9, 1.9, 1.75
COLUMNS, COLUMN_IN, PAIR_IN = 3, 2.8, 4.4
VIEW_MOVES = 3  # the view that shows a new obstacle is taken from at most so far


def draw_live_pictures(folder: Path, places: Sequence[LiveScene], outcomes: Sequence[LiveOutcome]) -> list[Path]:
    """Draw the figures by setting, and for each scene one episode under every setting; returns the paths."""
    made = [folder / "live.png"]
    draw_live_figures([outcome.result for outcome in outcomes], made[0])
    for index, stage in enumerate(places):
        made.append(folder / f"live-{stage.live.scene.name}.png")
        draw_live_episode(stage, index, outcomes, made[-1])
    return made


def draw_live_figures(results: Sequence[LiveResult], path: Path) -> None:
    """A row a setting, a panel a figure, a mark and an interval an agent; saved as PNG."""
    height_in = HEAD_IN + ROW_IN * len(results)
    with new_figure(LABELS_IN + PANEL_IN * len(PANELS), height_in, path) as figure:
        panels = figure.subplots(1, len(PANELS), sharey=True, squeeze=False)[0]
        for axes, (metric, title, scale) in zip(panels, PANELS, strict=True):
            _draw_panel(axes, results, metric, scale)
            axes.set_title(title, loc="left", fontsize=9)
        panels[0].set_yticks(range(len(results)), [result.label for result in results])
        panels[0].set_ylim(len(results) - 0.5, -0.5)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower left", ncols=2)


def _draw_panel(axes: Axes, results: Sequence[LiveResult], metric: str, scale: float) -> None:
    names = list(results[0].agents)
    for number, name in enumerate(names):
        figures = [result.agents[name] for result in results]
        value = scale * np.array([own.values[metric] for own in figures])
        ends = scale * np.array([own.intervals[metric] for own in figures])
        rows = np.arange(len(results)) + 0.24 * (number - (len(names) - 1) / 2)
        reach = np.abs(ends.T - value)
        look: Look = {"color": CURVES[number].colour, "marker": "os"[number % 2], "markersize": 4.5, "capsize": 2}
        axes.errorbar(value, rows, xerr=reach, linestyle="none", linewidth=1.2, label=name, **look)
    axes.set_xlim(left=0)
    axes.grid(axis="x")
    axes.tick_params(length=0)


def draw_live_episode(stage: LiveScene, scene_index: int, outcomes: Sequence[LiveOutcome], path: Path) -> None:
    """The same episode under every setting: the walks from above, and below what the agent sees at one pose."""
    episode = _telling_episode(outcomes, scene_index)
    pose = _telling_pose(stage, scene_index, outcomes, episode)
    rows = -(-len(outcomes) // COLUMNS)
    columns = min(COLUMNS, len(outcomes))
    with new_figure(columns * COLUMN_IN, rows * PAIR_IN + 0.4, path) as figure:
        panels = figure.subplots(2 * rows, columns, squeeze=False)
        for axes in panels.flat:
            axes.set_axis_off()
        for number, outcome in enumerate(outcomes):
            row, column = divmod(number, columns)
            _draw_from_above(panels[2 * row, column], stage, scene_index, outcome, episode)
            panels[2 * row, column].set_title(outcome.setting.label, loc="left", fontsize=9)
            panels[2 * row + 1, column].imshow(_view(stage, scene_index, outcome, episode, pose))
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower left", ncols=columns + 1, fontsize=8)


def _telling_episode(outcomes: Sequence[LiveOutcome], scene_index: int) -> int:
    """The episode in which most settings changed the room, the one with the longest way among those."""
    tables = [next(iter(outcome.tables.values()))[scene_index] for outcome in outcomes]
    changed = np.sum([table.changed for table in tables], axis=0)
    return int(np.lexsort((-tables[0].shortest_path_steps, -changed))[0])


def _telling_pose(
    stage: LiveScene, scene_index: int, outcomes: Sequence[LiveOutcome], episode: int
) -> tuple[float, float, float]:
    """A pose from which free moves lead to the place of a new obstacle, if a setting has one; else the start's."""
    scene = stage.live.scene
    tables = [next(iter(outcome.tables.values()))[scene_index] for outcome in outcomes]
    chosen = int(tables[0].start[episode])
    places_m = [table.layouts[episode].new_m for table in tables]
    for new_m in (place_m for place_m in places_m if place_m is not None):
        moves = [_moves_to(scene, state, np.array(new_m)) for state in range(scene.state_count)]
        chosen = int(np.argmax(moves)) if max(moves) else chosen
        break
    x_m, z_m = scene.locations_m[chosen].tolist()
    return x_m, z_m, float(scene.headings_deg[chosen])


def _moves_to(scene: Scene, state: int, place_m: np.ndarray) -> int:
    """Free moves forward from a state to a place of the grid; 0 where it does not lie ahead within VIEW_MOVES."""
    for moves in range(1, VIEW_MOVES + 1):
        state = int(scene.graph[state, Action.MOVE_FORWARD])
        if state == BLOCKED:
            return 0
        if np.allclose(scene.locations_m[state], place_m):
            return moves
    return 0


def _draw_from_above(axes: Axes, stage: LiveScene, scene_index: int, outcome: LiveOutcome, episode: int) -> None:
    live = stage.live
    first = next(iter(outcome.tables.values()))[scene_index]
    view = _from_above(live, first.layouts[episode])
    if view is not None:
        axes.imshow(view.image, extent=(view.x_min_m, view.x_max_m, view.z_min_m, view.z_max_m), alpha=0.75)
    for number, (name, tables) in enumerate(outcome.tables.items()):
        style, walk = LINES[number], tables[scene_index].walks[episode]
        axes.plot(walk[:, 0], walk[:, 1], color=style.halo, linewidth=3.4, solid_capstyle="round")
        axes.plot(walk[:, 0], walk[:, 1], color=style.colour, linestyle=style.pattern, linewidth=1.8, label=name)
    goal = live.scene.locations_m[stage.world.scene_state(int(first.target[episode]))]
    edge: Look = {"markeredgecolor": "white", "linestyle": "none"}
    axes.plot(*first.walks[episode][0, :2], marker="o", color=colours.INK, markersize=6, label="start", **edge)
    axes.plot(*goal, marker="*", color=colours.TARGET, markersize=11, label="target", **edge)


def _from_above(live: LiveRoom, layout: Arrangement) -> TopView | None:
    """The room in a layout; of a MuJoCo model of others what the scene has, where nothing is ever moved."""
    if live.room is None:
        return live.scene.top_view
    return render_top_view(live.model, live.room.width_m, live.room.depth_m, layout.bodies_m)


def _view(
    stage: LiveScene, scene_index: int, outcome: LiveOutcome, episode: int, pose: tuple[float, float, float]
) -> np.ndarray:
    """What the agent would see at a pose, first of all in this setting's episode, (height, width, 3) uint8."""
    table = next(iter(outcome.tables.values()))[scene_index]
    draws = Draws(int(table.seed[episode]), outcome.setting.perturbations)
    shot = first_person_shot(
        *pose,
        height_m=stage.live.camera_m + draws.height_error_m(),
        pitch_deg=draws.pitch_error_deg(),
        moved_m=stage.live.bodies_m(table.layouts[episode]),
    )
    return draws.seen(stage.camera([shot])[0])
