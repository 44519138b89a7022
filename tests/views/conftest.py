import pytest

from clearway.live.live_room import LiveRoom
from helpers.small_live import walkable_live


@pytest.fixture(scope="session")
def live() -> LiveRoom:
    return walkable_live()
