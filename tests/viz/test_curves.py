import numpy as np
import pytest
from PIL import Image

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


@pytest.mark.parametrize(
    "runs", [{}, {"a": []}, {"a": [{"frames": 1, "loss": 2}]}, {"a": rows(3), "b": rows(200), "c": []}]
)
def test_curves_are_drawn_whatever_is_missing(tmp_path, runs):
    path = tmp_path / "curves.png"
    draw_curves(runs, path, title="Curves")
    with Image.open(path) as picture:
        assert picture.width > 300


def test_the_axis_can_be_time(tmp_path):
    for x in ("frames", "seconds"):
        draw_curves({"run": rows(20)}, tmp_path / f"{x}.png", x=x)
    pictures = [np.asarray(Image.open(tmp_path / f"{x}.png")) for x in ("frames", "seconds")]
    assert not np.array_equal(*pictures)


def test_other_panels_can_be_drawn_and_goals_marked(tmp_path):
    def drawn(*panels: Panel) -> np.ndarray:
        draw_curves({"run": rows(20)}, tmp_path / "curves.png", panels=panels)
        with Image.open(tmp_path / "curves.png") as picture:
            return np.asarray(picture)

    plain, marked = drawn(Panel("steps", "steps")), drawn(Panel("steps", "steps", goal=100.0))
    assert plain.shape == marked.shape and not np.array_equal(plain, marked)
    assert drawn(Panel("steps", "steps"), Panel("loss", "loss")).shape[1] > plain.shape[1]
