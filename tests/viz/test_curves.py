import numpy as np
import pytest

from clearway.viz.curves import PANELS, Panel, _running_mean, _series, draw_curves

STEPS = next(panel for panel in PANELS if panel.key == "steps")


def rows(count: int) -> list[dict[str, float]]:
    return [
        {"frames": 1000 * i, "seconds": i, "episodes": i, "success": i / count, "steps": 200 / (i + 1), "loss": -i}
        for i in range(count)
    ]


def test_rows_without_the_figure_or_without_episodes_are_left_out():
    log = [
        {"frames": 1, "loss": 2.0},
        {"frames": 2, "episodes": 0, "steps": 0},
        {"frames": 3, "episodes": 4, "steps": 7},
    ]
    across, up = _series([*log, {"frames": 4, "episodes": 1, "steps": float("nan")}], "frames", STEPS)
    assert across.tolist() == [3] and up.tolist() == [7]


def test_the_running_mean_looks_back():
    assert _running_mean(np.array([2.0, 4, 6, 8]), 2).tolist() == [2, 3, 5, 7]


@pytest.mark.parametrize("runs", [{}, {"a": []}, {"a": [{"frames": 1, "loss": float("nan")}]}])
def test_without_figures_the_picture_says_so(tmp_path, drawn, runs):
    draw_curves(runs, tmp_path / "curves.png", title="Curves")
    (figure,) = drawn
    assert not figure.axes and not figure.legends
    assert "nothing logged yet" in [text.get_text() for text in figure.texts]


def test_only_figures_that_were_logged_get_a_panel(tmp_path, drawn):
    draw_curves({"a": [{"frames": 1, "loss": 2}, {"frames": 2, "loss": 3}], "b": rows(3)}, tmp_path / "curves.png")
    titles = {panel.key: panel.title for panel in PANELS}
    panels = {axes.get_title(loc="left"): axes for axes in drawn[0].axes}
    assert list(panels) == [titles[key] for key in ("success", "steps", "loss")]
    lines = {line.get_label(): line for line in panels["loss"].lines}
    assert np.array_equal(lines["a"].get_xydata(), [[1, 2], [2, 3]])
    assert np.array_equal(lines["b"].get_xydata(), [[0, 0], [1000, -1], [2000, -2]])
    assert np.array_equal(panels[titles["success"]].lines[0].get_ydata(), np.empty(0))  # of "a", which has none
    assert [text.get_text() for text in drawn[0].legends[0].get_texts()] == ["a", "b"]


def test_long_runs_are_drawn_faintly_and_their_running_mean_strongly(tmp_path, drawn):
    log = rows(200)
    draw_curves({"run": log}, tmp_path / "curves.png", panels=[STEPS])
    faint, strong = drawn[0].axes[0].lines
    steps = np.array([row["steps"] for row in log[1:]])  # the first row has no episodes
    assert np.array_equal(faint.get_ydata(), steps) and faint.get_alpha() < 0.5
    assert np.array_equal(strong.get_ydata(), _running_mean(steps, 8)) and strong.get_alpha() is None


@pytest.mark.slow
def test_the_axis_can_be_time(tmp_path, drawn):
    for x in ("frames", "seconds"):
        draw_curves({"run": rows(20)}, tmp_path / "curves.png", x=x)
    for figure, x, last in zip(drawn, ("frames", "seconds"), (19_000, 19), strict=True):
        assert {axes.get_xlabel() for axes in figure.axes} == {x}
        assert all(axes.lines[0].get_xdata()[-1] == last for axes in figure.axes)


def test_other_panels_can_be_drawn_and_goals_marked(tmp_path, drawn):
    draw_curves({"run": rows(20)}, tmp_path / "curves.png", panels=[Panel("steps", "steps", goal=100.0)])
    draw_curves({"run": rows(20)}, tmp_path / "curves.png", panels=[Panel("steps", "a"), Panel("loss", "b")])
    marked, two = drawn
    (goal,) = [line for line in marked.axes[0].lines if line.get_linestyle() == "--"]
    assert list(goal.get_ydata()) == [100, 100]
    assert [axes.get_title(loc="left") for axes in two.axes] == ["a", "b"]
    assert two.get_figwidth() > marked.get_figwidth()
