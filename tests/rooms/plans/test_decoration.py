import numpy as np
import pytest

from clearway.rooms.plans.decoration import MOST_BEHIND_M, MOST_WINDOWS, decorate
from clearway.rooms.plans.layout import Layout, lay_out
from clearway.rooms.room import Room
from helpers.plan_maps import ELL, plan_of

PLAN = plan_of("ell", ELL)


def decorated(top_m: float, seed: int = 0) -> tuple[Room, Layout]:
    layout = lay_out(PLAN, np.random.default_rng(seed))
    room = Room("ell", layout.width_m, layout.depth_m, 2.6, (0.35, 0.35), seed)
    decorate(room, layout, [top_m] * len(layout.pieces))
    return room, layout


@pytest.mark.parametrize("seed", range(4))
def test_windows_are_in_the_outer_walls_over_furniture_or_free_floor(seed: int) -> None:
    room, layout = decorated(0.9, seed)
    assert 1 <= len(room.windows) <= MOST_WINDOWS
    for window in room.windows:
        x_m, y_m, z_m = window.centre_m
        assert min(abs(gap) for gap in (x_m, y_m, layout.width_m - x_m, layout.depth_m - y_m)) < 1e-6
        assert z_m - window.height_m / 2 > 0.89


def test_nothing_hangs_behind_high_furniture() -> None:
    low, layout = decorated(0.9)
    high, _ = decorated(MOST_BEHIND_M + 0.1)
    assert len(high.parts) < len(low.parts)
    backs = [stretch for stretch in layout.stretches if stretch.piece is not None and stretch.outer]
    hung = [part for part in high.parts if 0.3 < part.position_m[2] < 2.3]
    for stretch in backs:
        for part in hung:
            along_m, off_m, _ = np.linalg.solve(axes(stretch.at), part.position_m - stretch.at.point(0, 0, 0))
            assert not (abs(along_m) < stretch.length_m / 2 - 0.2 and abs(off_m) < 0.1)


def axes(frame) -> np.ndarray:
    """The frame's directions as columns, (3, 3)."""
    return np.stack([frame.point(*unit) - frame.point(0, 0, 0) for unit in np.eye(3)], axis=1)


def test_lamps_hang_over_free_cells() -> None:
    room, layout = decorated(0.9)
    free_m = layout.middles_m(np.argwhere(layout.free))
    assert len(room.lamps) >= 1
    for lamp in room.lamps:
        assert np.linalg.norm(free_m - lamp.centre_m[:2], axis=1).min() < 1e-6
