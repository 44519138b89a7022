"""The ROS 2 package is found where it lies; it is no part of clearway."""

import sys

import pytest

from helpers.documents import ROOT

FOLDER = ROOT / "integrations/ros2"


@pytest.fixture(scope="session", autouse=True)
def _package_on_the_path():
    sys.path.insert(0, str(FOLDER))
    yield
    sys.path.remove(str(FOLDER))
    for name in [name for name in sys.modules if name.partition(".")[0] == "clearway_ros"]:
        del sys.modules[name]
