"""Figures of reports: what their axes show."""

from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from clearway.experiments.section import ReportFigure, Series
from clearway.viz.report_figures import draw_report_figure

CURVE = Series("agent", [0, 1e6, 2e6], [100.0, 0.2, 0.1], [90.0, 0.1, 0.0], [110.0, 0.3, 0.2])


def test_a_curve_over_decades_gets_a_logarithmic_axis_that_reaches_zero(tmp_path: Path, drawn: list[Figure]) -> None:
    figure = ReportFigure("f", "title", "training frames", "collisions", (CURVE,), linear_below=0.1)
    draw_report_figure(figure, tmp_path / "f.png")
    (axes,) = drawn[0].axes
    assert axes.get_yscale() == "symlog"
    assert -0.01 < axes.get_ylim()[0] < 0  # points at 0 are drawn whole
    assert {0, 0.1, 0.2, 0.5, 1} <= set(axes.get_yticks().round(3).tolist())
    assert axes.xaxis.get_major_formatter()(2e6) == "2M"


def test_where_nothing_is_small_the_axis_begins_below_the_lowest(tmp_path: Path, drawn: list[Figure]) -> None:
    curve = Series("agent", [0, 1], [400.0, 12.0], [300.0, 10.0], [500.0, 14.0])
    figure = ReportFigure("f", "title", "training frames", "steps", (curve,), linear_below=1.0)
    draw_report_figure(figure, tmp_path / "f.png")
    assert drawn[0].axes[0].get_ylim()[0] == 5


def test_others_stay_linear(tmp_path: Path, drawn: list[Figure]) -> None:
    figure = ReportFigure("f", "title", "targets", "success score", (CURVE,))
    draw_report_figure(figure, tmp_path / "f.png")
    assert drawn[0].axes[0].get_yscale() == "linear"


def test_eight_series_are_told_apart_by_their_lines_and_by_their_marks(tmp_path: Path, drawn: list[Figure]) -> None:
    series = tuple(Series(str(number), [0, 1], [number, number]) for number in range(8))
    draw_report_figure(ReportFigure("f", "Many", "x", "y", series), tmp_path / "f.png")
    lines = [line for line in drawn[0].axes[0].lines if line.get_label().isdigit()]
    assert len(lines) == len({line.get_color() for line in lines}) == len({line.get_marker() for line in lines}) == 8
    assert len({str(line._dash_pattern) for line in lines}) == 8


def interval_figure(count: int) -> ReportFigure:
    """A rising line of `count` points, one above and one below each."""
    x = list(map(float, range(count)))
    curve = Series("agent", x, x, [value - 1 for value in x], [value + 2 for value in x])
    return ReportFigure("f", "title", "targets", "success score", (curve,), band="95 % intervals")


def test_a_mean_that_rounding_puts_beside_its_interval_is_drawn(tmp_path: Path) -> None:
    share = 894 / 895
    mean = float(np.mean([share] * 3))
    assert mean < share
    figure = ReportFigure("f", "title", "x", "y", (Series("map", [0, 1], [mean, 1.0], [share, 1.0], [share, 1.0]),))
    draw_report_figure(figure, tmp_path / "f.png")
    assert (tmp_path / "f.png").stat().st_size > 0


def test_intervals_at_few_points_are_bars(tmp_path: Path, drawn: list[Figure]) -> None:
    draw_report_figure(interval_figure(4), tmp_path / "f.png")
    (axes,) = drawn[0].axes
    (bars,) = [each for each in axes.collections if isinstance(each, LineCollection)]
    assert [bar.tolist() for bar in bars.get_segments()] == [[[x, x - 1], [x, x + 2]] for x in range(4)]
    assert not [each for each in axes.collections if isinstance(each, PolyCollection)]
    assert drawn[0].legends[0].get_title().get_text() == "95 % intervals"


def test_intervals_at_many_points_are_a_band_with_edges(tmp_path: Path, drawn: list[Figure]) -> None:
    draw_report_figure(interval_figure(30), tmp_path / "f.png")
    (axes,) = drawn[0].axes
    (band,) = [each for each in axes.collections if isinstance(each, PolyCollection)]
    ends = {(x, x + off) for x in range(30) for off in (-1, 2)}
    assert {tuple(point) for path in band.get_paths() for point in path.vertices.tolist()} == ends
    assert sorted(line.get_ydata()[0] for line in axes.lines) == [-1, 0, 2]  # edges, and the line between them
    assert drawn[0].legends[0].get_title().get_text() == "95 % intervals"
