from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from clearway.live.report import Comparison, Figures, LiveResult
from clearway.live.settings import Perturbations
from clearway.viz.figures import CURVES
from clearway.viz.live import PANELS, ROW_IN, _moves_to, draw_live_figures
from made import corridor_scene


def figures(value: float) -> Figures:
    values = {metric: value for metric, _, _ in PANELS}
    return Figures(values, dict.fromkeys(values, (value - 0.1, value + 0.1)))


def results(count: int) -> list[LiveResult]:
    none: Comparison | None = None
    agents = {"shortest": figures(0.4), "collision-aware": figures(0.8)}
    return [LiveResult(f"setting {number}", Perturbations(), agents, none) for number in range(count)]


def colour_share(picture: np.ndarray, colour: str) -> float:
    wanted = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)])
    return float((np.abs(picture.astype(int) - wanted).max(axis=2) < 12).mean())


def test_a_row_a_setting_and_a_colour_an_agent(tmp_path: Path) -> None:
    sizes = []
    for count in (1, 4):
        draw_live_figures(results(count), tmp_path / "live.png")
        picture = np.array(Image.open(tmp_path / "live.png").convert("RGB"))
        sizes.append(picture.shape[0])
        for style in CURVES[:2]:
            assert colour_share(picture, style.colour) > 1e-4
    assert sizes[1] - sizes[0] == round(3 * ROW_IN * 160)


def test_a_place_lies_ahead_where_free_moves_lead_there() -> None:
    scene = corridor_scene(5)  # state 4 * cell + heading / 90, cells along +z
    place_m = scene.locations_m[4 * 3]
    assert _moves_to(scene, 4 * 1, place_m) == 2  # two moves forward
    assert _moves_to(scene, 4 * 1 + 2, place_m) == 0  # looks the other way
    assert _moves_to(scene, 4 * 1 + 1, place_m) == 0  # blocked
    assert _moves_to(scene, 4 * 3, place_m) == 0  # stands there
