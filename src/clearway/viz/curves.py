"""Learning curves of one or more runs, a panel for each figure that any of them logged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from clearway import colours
from clearway.viz.figures import CURVES, LineStyle, Look, halo, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Rows = Sequence[Mapping[str, float]]
COLUMNS = 3
PANEL_WIDTH_IN, PANEL_HEIGHT_IN, LEGEND_IN = 2.9, 2.05, 0.35
LINE_PT, HALO_PT = 1.8, 3.0
SMOOTH_SHARE = 0.04  # of a run's rows that the strong line averages


@dataclass(frozen=True)
class Panel:
    """One figure of the log."""

    key: str
    title: str
    linear_below: float | None = None
    """From here on a logarithmic axis; None: a linear one."""
    from_zero: bool = False
    goal: float | None = None
    """A level that a dashed line marks."""


PANELS = (
    Panel("success", "success of training episodes", from_zero=True),
    Panel("steps", "steps an episode", linear_below=1.0),
    Panel("collisions", "collisions an episode", linear_below=0.1),
    Panel("solved_targets", "targets solved", from_zero=True),
    Panel("entropy", "entropy, nats", from_zero=True),
    Panel("loss", "loss"),
)


def draw_curves(
    runs: Mapping[str, Rows],
    path: Path,
    *,
    x: str = "frames",
    title: str = "",
    panels: Sequence[Panel] = PANELS,
    looks: Sequence[LineStyle] = CURVES,
) -> None:
    """Draw the learning curves of some runs and save them as PNG. Figures and rows that are missing are left out.

    Args:
        runs: rows of metrics by the run's name, in the order of training.
        path: of the picture.
        x: the figure along the horizontal axis: "frames" or "seconds".
        title: stands above.
        panels: the figures to draw, in this order.
        looks: of the runs, in their order.
    """
    panels = [panel for panel in panels if any(len(_series(rows, x, panel)[0]) for rows in runs.values())]
    columns = min(COLUMNS, max(1, len(panels)))
    lines = max(1, -(-len(panels) // columns))
    height_in = lines * PANEL_HEIGHT_IN + LEGEND_IN * (2 if title else 1)
    with new_figure(columns * PANEL_WIDTH_IN, height_in, path) as figure:
        if title:
            figure.suptitle(title, x=0.01, ha="left", fontsize=12, fontweight="bold")
        if not panels:
            figure.text(0.5, 0.5, "nothing logged yet", ha="center", color=colours.FAINT_INK)
            return
        for index, panel in enumerate(panels):
            axes = figure.add_subplot(lines, columns, index + 1)
            series = [_series(rows, x, panel) for rows in runs.values()]
            for style, (name, (across, up)) in enumerate(zip(runs, series, strict=True)):
                _draw_series(axes, across, up, name, looks[style % len(looks)])
            lowest = min(float(up.min()) for _, up in series if len(up))
            _dress(axes, panel, x, lowest, with_x_label=index >= len(panels) - columns)
        handles, labels = figure.axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), handlelength=3)


def _series(rows: Rows, x: str, panel: Panel) -> tuple[np.ndarray, np.ndarray]:
    """The rows that have both figures; where no episode ended, figures of episodes say nothing and are left out."""
    of_episodes = panel.key in ("success", "steps", "collisions")
    points = [
        (row[x], row[panel.key])
        for row in rows
        if x in row and panel.key in row and not (of_episodes and row.get("episodes", 1) == 0)
    ]
    points = [point for point in points if np.isfinite(point).all()]
    if not points:
        return np.empty(0), np.empty(0)
    across, up = np.array(points, dtype=np.float64).T
    return across, up


def _draw_series(axes: Axes, across: np.ndarray, up: np.ndarray, name: str, look: LineStyle) -> None:
    """The figures faintly, their running mean strongly."""
    width = max(1, round(SMOOTH_SHARE * len(up)))
    if width > 1:
        axes.plot(across, up, color=look.colour, alpha=0.22, linewidth=0.9)
    mean, effects = _running_mean(up, width), halo(look.halo, HALO_PT)
    line: Look = {"color": look.colour, "linestyle": look.pattern, "linewidth": LINE_PT, "path_effects": effects}
    axes.plot(across, mean, label=name, **line)


def _running_mean(values: np.ndarray, width: int) -> np.ndarray:
    """Mean of the last `width` values, of fewer at the beginning."""
    if len(values) == 0:
        return values
    total = np.concatenate([[0.0], np.cumsum(values)])
    end = np.arange(1, len(values) + 1)
    start = np.maximum(end - width, 0)
    return (total[end] - total[start]) / (end - start)


def _dress(axes: Axes, panel: Panel, x: str, lowest: float, *, with_x_label: bool) -> None:
    """Title, grid and scales; `lowest` is the smallest value drawn."""
    from matplotlib.ticker import EngFormatter

    axes.set_title(panel.title, loc="left", fontsize=9.5)
    if panel.goal is not None:
        axes.axhline(panel.goal, color=colours.FAINT_INK, linewidth=1, linestyle="--", zorder=0)
        lowest = min(lowest, panel.goal)
    axes.grid(axis="y")
    axes.tick_params(length=0)
    axes.xaxis.set_major_formatter(EngFormatter(sep=""))
    axes.margins(x=0.01)
    if panel.linear_below is not None:
        axes.set_yscale("symlog", linthresh=panel.linear_below)
        axes.yaxis.set_major_formatter("{x:g}")
        axes.set_ylim(bottom=lowest / 2 if lowest > panel.linear_below else 0)
    elif panel.from_zero:
        axes.set_ylim(bottom=0)
    if with_x_label:
        axes.set_xlabel(x)
