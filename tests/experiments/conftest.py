"""A room that can be walked in, for several tests of experiments."""

from pathlib import Path

import pytest

from clearway.experiments.setting import Setting
from clearway.live.live_room import LiveRoom
from helpers.live_setting import live_setting
from helpers.small_live import walkable_live


@pytest.fixture(scope="module")
def live() -> LiveRoom:
    """Made once a file."""
    return walkable_live()


@pytest.fixture
def in_room(tmp_path: Path, live: LiveRoom, monkeypatch: pytest.MonkeyPatch) -> Setting:
    """A setting of two seeds in it."""
    return live_setting(tmp_path, live, monkeypatch, seeds=2)
