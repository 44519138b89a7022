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
    """Draw a figure and save it as PNG. Series differ in colour, and in dashes or markers."""
    from matplotlib.ticker import EngFormatter, SymmetricalLogLocator

    with new_figure(WIDTH_IN, HEIGHT_IN, path) as canvas:
        canvas.suptitle(figure.title, x=0.01, ha="left", fontsize=12, fontweight="bold")
        axes = canvas.add_subplot()
        for index, series in enumerate(figure.series):
            style, marker = CURVES[index % len(CURVES)], MARKERS[index % len(MARKERS)]
            if series.points:
                size, kind, front = (160, "*", 5) if series.highlighted else (26, marker, 3)
                axes.scatter(
                    series.x, series.y, s=size, color=style.colour, edgecolor=colours.INK, linewidth=0.5, marker=kind,
                    label=series.label, zorder=front,
                )  # fmt: skip
                continue
            few = len(series.x) <= len(MARKERS)
            axes.plot(
                series.x, series.y, color=style.colour, linestyle=style.pattern, marker=marker if few else None,
                markersize=4, label=series.label,
            )  # fmt: skip
            if series.low is None or series.high is None:
                continue
            if few:
                ends = [[max(0.0, y - low) for y, low in zip(series.y, series.low, strict=True)],
                        [max(0.0, high - y) for y, high in zip(series.y, series.high, strict=True)]]  # fmt: skip
                axes.errorbar(series.x, series.y, yerr=ends, fmt="none", ecolor=style.colour, capsize=3, linewidth=1)
            else:
                axes.fill_between(series.x, series.low, series.high, color=style.colour, alpha=0.15, linewidth=0)
                for edge in (series.low, series.high):  # so that bands can be told apart in grey
                    axes.plot(series.x, edge, color=style.colour, linestyle=style.pattern, linewidth=0.5)
        if figure.linear_below is not None:
            axes.set_yscale("symlog", linthresh=figure.linear_below)
            axes.yaxis.set_major_locator(SymmetricalLogLocator(base=10, linthresh=figure.linear_below, subs=(1, 2, 5)))
            axes.yaxis.set_major_formatter("{x:g}")
            lowest = min(value for series in figure.series for value in (series.low or series.y))
            axes.set_ylim(bottom=lowest / 2 if lowest > figure.linear_below else -0.06 * figure.linear_below)
        axes.xaxis.set_major_formatter(EngFormatter(sep=""))
        axes.set_xlabel(figure.x_label)
        axes.set_ylabel(figure.y_label)
        axes.grid(visible=True)
        axes.set_axisbelow(True)
        canvas.legend(
            loc="outside lower center", ncols=2, fontsize=8, handlelength=3, title=figure.band or None, title_fontsize=8
        )
