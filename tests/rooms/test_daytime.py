"""The light outside: what it does to a room's windows, walls and furniture."""

import numpy as np
import pytest

from clearway.rooms.daytime import DAYTIMES, NOON, Daytime, draw_daytime
from clearway.rooms.furniture import openings
from clearway.rooms.light import _sun_direction, _window_sources
from clearway.rooms.parts import Window
from clearway.rooms.room import Room

WINDOW = Window(np.array([2.0, 0.0, 1.5]), np.array([0.0, 1.0, 0.0]), 1.2, 1.0)
BY_NAME = {daytime.name: daytime for daytime in DAYTIMES}


def test_every_time_comes_as_often_as_it_says() -> None:
    assert sum(daytime.share for daytime in DAYTIMES) == pytest.approx(1)
    rng = np.random.default_rng(0)
    drawn = [draw_daytime(rng).name for _ in range(2000)]
    for daytime in DAYTIMES:
        assert drawn.count(daytime.name) / 2000 == pytest.approx(daytime.share, abs=0.04)


def test_the_sky_colours_what_comes_in() -> None:
    noon, night, evening = (
        sum(source.light for source in _window_sources(WINDOW, one))
        for one in (NOON, BY_NAME["night"], BY_NAME["evening"])
    )
    assert night.sum() < 0.1 * noon.sum()
    assert evening[0] / evening[2] > 1.3 * noon[0] / noon[2]


def test_the_sun_shines_low_in_the_evening_and_not_at_all_at_night() -> None:
    assert _sun_direction([WINDOW], BY_NAME["night"]) is None and _sun_direction([], NOON) is None
    noon, evening = (_sun_direction([WINDOW], one) for one in (NOON, BY_NAME["evening"]))
    assert noon is not None and evening is not None
    assert 0 < evening[2] < noon[2] and np.linalg.norm(evening) == pytest.approx(1)


def test_noon_leaves_a_view_as_it_is_and_night_darkens_it() -> None:
    picture = np.random.default_rng(0).random((4, 5, 3))
    np.testing.assert_array_equal(NOON.seen(picture), picture)
    assert BY_NAME["night"].seen(picture).max() < 0.2
    np.testing.assert_array_equal(Daytime("any", view=(2.0, 1.0, 0.0)).seen(np.full((1, 1, 3), 0.8)), [[[1, 0.8, 0]]])


def test_a_window_shows_the_time() -> None:
    def view_of(daytime: Daytime) -> np.ndarray:
        room = Room("any", 3.0, 3.0, 2.6, (0.5, 0.5), daytime=daytime)
        openings.window(room, room.wall("south", 1.5, 1.0), 1.2, 1.0)
        return max((look.image for look in room._looks.values() if look.emission > 0.9), key=np.size)

    assert view_of(BY_NAME["night"]).mean() < 0.3 * view_of(NOON).mean()
