"""The figures of a report, drawn from their data: lines with intervals, points, and maps; readable in grey."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from clearway import colours
from clearway.experiments.section import ReportFigure, ReportMap
from clearway.scenes.scene import Scene
from clearway.viz.figures import CURVES, new_figure
from clearway.viz.maps import Walk, draw_map
from clearway.zones import scene_zones

WIDTH_IN, HEIGHT_IN = 6.4, 3.9
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")


def draw_report_map(shown: ReportMap, scenes: Sequence[Scene], path: Path) -> None:
    """Draw a map, whose scene is among those given, and save it as PNG."""
    (scene,) = [each for each in scenes if each.name == shown.scene]
    walks = [Walk(label, np.array(states)) for label, states in shown.walks.items()]
    draw_map(scene, path, zones=scene_zones(scene), target=shown.target, walks=walks, title=shown.title)


def draw_report_figure(figure: ReportFigure, path: Path) -> None:
    """Draw a figure and save it as PNG. Series differ in colour, in lightness, and in dashes or markers."""
    from matplotlib.ticker import EngFormatter

    with new_figure(WIDTH_IN, HEIGHT_IN, path) as canvas:
        canvas.suptitle(figure.title, x=0.01, ha="left", fontsize=12, fontweight="bold")
        axes = canvas.add_subplot()
        for index, series in enumerate(figure.series):
            style, marker = CURVES[index % len(CURVES)], MARKERS[index % len(MARKERS)]
            if series.points:
                axes.scatter(
                    series.x, series.y, s=26, color=style.colour, edgecolor=colours.INK, linewidth=0.5, marker=marker,
                    label=series.label, zorder=3,
                )  # fmt: skip
                continue
            few = len(series.x) <= len(MARKERS)
            axes.plot(
                series.x, series.y, color=style.colour, linestyle=style.pattern, marker=marker if few else None,
                markersize=4, label=series.label,
            )  # fmt: skip
            if series.low is not None and series.high is not None:
                axes.fill_between(series.x, series.low, series.high, color=style.colour, alpha=0.15, linewidth=0)
        if figure.linear_below is not None:
            axes.set_yscale("symlog", linthresh=figure.linear_below)
            axes.yaxis.set_major_formatter("{x:g}")
            lowest = min(value for series in figure.series for value in (series.low or series.y))
            axes.set_ylim(bottom=lowest / 2 if lowest > figure.linear_below else 0)
        axes.xaxis.set_major_formatter(EngFormatter(sep=""))
        axes.set_xlabel(figure.x_label)
        axes.set_ylabel(figure.y_label)
        axes.grid(visible=True)
        axes.set_axisbelow(True)
        canvas.legend(loc="outside lower center", ncols=2, fontsize=8, handlelength=3)
