"""Figures of reports: what their axes show."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from clearway.experiments.section import ReportFigure, Series
from clearway.viz import report_figures
from clearway.viz.report_figures import draw_report_figure

CURVE = Series("agent", [0, 1e6, 2e6], [100.0, 0.2, 0.1], [90.0, 0.1, 0.0], [110.0, 0.3, 0.2])


def axes_of(figure: ReportFigure, path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The axes of the figure as drawn."""
    drawn = []
    plain = report_figures.new_figure

    @contextmanager
    def watched(*arguments: Any) -> Iterator[Any]:
        with plain(*arguments) as canvas:
            drawn.append(canvas)
            yield canvas

    monkeypatch.setattr(report_figures, "new_figure", watched)
    draw_report_figure(figure, path)
    assert path.stat().st_size > 1000
    return drawn[0].axes[0]


def test_a_curve_over_decades_gets_a_logarithmic_axis_that_reaches_zero(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figure = ReportFigure("f", "title", "training frames", "collisions", (CURVE,), linear_below=0.1)
    axes = axes_of(figure, tmp_path / "f.png", monkeypatch)
    assert axes.get_yscale() == "symlog"
    assert -0.01 < axes.get_ylim()[0] < 0  # points at 0 are drawn whole
    assert {0, 0.1, 0.2, 0.5, 1} <= set(axes.get_yticks().round(3).tolist())
    assert axes.xaxis.get_major_formatter()(2e6) == "2M"


def test_where_nothing_is_small_the_axis_begins_below_the_lowest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    curve = Series("agent", [0, 1], [400.0, 12.0], [300.0, 10.0], [500.0, 14.0])
    figure = ReportFigure("f", "title", "training frames", "steps", (curve,), linear_below=1.0)
    assert axes_of(figure, tmp_path / "f.png", monkeypatch).get_ylim()[0] == 5


def test_others_stay_linear(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    figure = ReportFigure("f", "title", "targets", "success score", (CURVE,))
    assert axes_of(figure, tmp_path / "f.png", monkeypatch).get_yscale() == "linear"


def test_intervals_are_bars_at_few_points_and_bands_with_edges_at_many(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for count, lines, bands in ((4, 1, 0), (30, 3, 1)):
        x = list(map(float, range(count)))
        curve = Series("agent", x, x, [value - 1 for value in x], [value + 1 for value in x])
        figure = ReportFigure("f", "title", "targets", "success score", (curve,), band="Bars: 95 % intervals")
        axes = axes_of(figure, tmp_path / "f.png", monkeypatch)
        drawn = [line for line in axes.lines if len(line.get_xdata()) == count and line.get_linestyle() != "None"]
        assert len(drawn) == lines
        assert len([each for each in axes.collections if type(each).__name__ == "FillBetweenPolyCollection"]) == bands
        assert axes.figure.legends[0].get_title().get_text() == "Bars: 95 % intervals"
