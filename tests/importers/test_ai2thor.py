"""Against a stand-in for the simulator that speaks the package's own classes."""

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.importers import ai2thor as importer
from clearway.importers.ai2thor import photographed, started
from clearway.scenes.validate import SceneWarning, pose_quirks
from helpers.made import graph_of_cells

server = pytest.importorskip("ai2thor.server")
CELLS = [(0, 0), (0, 1), (1, 1), (1, 2)]
STEP_M, Y_M = 0.5, 0.901


class StandIn:
    """A simulator of one room; `refuse` says which teleports fail, `move` changes where they lead."""

    def __init__(self, cells: list[tuple[int, int]] = CELLS) -> None:
        self.positions = [{"x": -1.0 + STEP_M * x, "y": Y_M, "z": 2.0 + STEP_M * z} for x, z in cells]
        self.refuse: Callable[[dict], bool] = lambda words: False
        self.move: Callable[[dict], None] = lambda agent: None
        self.stopped = False
        self.screen = (16, 12)

    def step(self, action: str, **words: Any) -> object:
        if action == "GetReachablePositions":
            return self.event(action, True, actionReturn=list(reversed(self.positions)))
        assert action == "TeleportFull"
        assert (words["horizon"], words["standing"]) == (0.0, True)
        if self.refuse(words):
            return self.event(action, False, errorMessage="Collided with: Table")
        agent = {
            "position": {axis: words[axis] for axis in "xyz"},
            "rotation": {"x": 0.0, "y": words["rotation"]["y"] % 360, "z": 0.0},
            "cameraHorizon": 0.0,
        }
        self.move(agent)
        event = self.event(action, True, agent=agent)
        colour = (agent["position"]["x"] * 40 + 100, agent["position"]["z"] * 40, agent["rotation"]["y"] / 2)
        event.frame = np.full((12, 16, 3), np.round(colour), np.uint8)
        return event

    def event(self, action: str, success: bool, **more: Any) -> object:
        return server.Event(
            {
                "lastAction": action,
                "lastActionSuccess": success,
                "errorMessage": "",
                "screenWidth": self.screen[0],
                "screenHeight": self.screen[1],
                "colors": [],
                "objects": [],
                **more,
            }
        )

    def stop(self) -> None:
        self.stopped = True


def test_a_room_becomes_a_scene() -> None:
    scene = photographed(StandIn(), "FloorPlan1", step_m=STEP_M)
    assert pose_quirks(scene) == []
    np.testing.assert_array_equal(scene.graph, graph_of_cells(np.array(CELLS)))
    assert scene.locations_m[4].tolist() == [-1.0, 2.5]
    np.testing.assert_array_equal(scene.observations[5][0, 0], [60, 100, 45])
    assert scene.made_by.source == "ai2thor"


@pytest.mark.parametrize(
    "spoil",
    [
        lambda agent: agent["position"].update(x=agent["position"]["x"] + 0.25),
        lambda agent: agent["rotation"].update(y=agent["rotation"]["y"] + 45),
        lambda agent: agent.update(cameraHorizon=30.0),
    ],
)
def test_a_teleport_that_ends_elsewhere_has_failed(spoil: Callable[[dict], None]) -> None:
    simulator = StandIn()

    def move(agent: dict) -> None:
        if (agent["position"]["x"], agent["position"]["z"], agent["rotation"]["y"]) == (-1.0, 2.0, 180.0):
            spoil(agent)

    simulator.move = move
    with pytest.warns(SceneWarning, match="1 of 4 locations are left out"):
        scene = photographed(simulator, "FloorPlan1", step_m=STEP_M)
    assert scene.cell_count == 3


def test_a_heading_is_right_however_it_is_written() -> None:
    simulator = StandIn()
    simulator.move = lambda agent: agent["rotation"].update(y=agent["rotation"]["y"] - 360 + 0.01)
    assert photographed(simulator, "FloorPlan1", step_m=STEP_M).cell_count == 4


def test_a_location_that_cannot_be_stood_at_is_left_out_with_all_its_headings() -> None:
    simulator = StandIn()
    simulator.refuse = lambda words: words["x"] == -0.5 and words["rotation"]["y"] == 270
    with pytest.warns(SceneWarning, match="2 of 4 locations"):
        scene = photographed(simulator, "FloorPlan1", step_m=STEP_M)
    np.testing.assert_array_equal(scene.graph, graph_of_cells(np.array(CELLS[:2])))
    assert len(scene.observations) == 8


def test_no_positions_or_no_teleport_is_said() -> None:
    with pytest.raises(SceneError, match="names 0 reachable positions"):
        photographed(StandIn([]), "FloorPlan1", step_m=STEP_M)
    simulator = StandIn()
    simulator.refuse = lambda words: True
    with pytest.raises(SceneError, match="no teleport to any of 4 positions succeeded"):
        photographed(simulator, "FloorPlan1", step_m=STEP_M)


@pytest.mark.parametrize(
    ("screen", "cells", "problem"),
    [
        ((400, 3_000), CELLS, "pictures of 400 x 3000 pixels, expected sides of 1 to 2048"),
        ((2_048, 2_048), [(0, z) for z in range(100)], "400 pictures of 2048 x 2048 pixels take 4800 MiB"),
    ],
)
def test_pictures_that_are_too_large_are_refused_before_any_teleport(
    screen: tuple[int, int], cells: list[tuple[int, int]], problem: str
) -> None:
    simulator = StandIn(cells)
    simulator.screen = screen
    simulator.refuse = lambda words: pytest.fail("teleported")
    with pytest.raises(SceneError, match=problem):
        photographed(simulator, "FloorPlan1", step_m=STEP_M)


def test_a_simulator_that_cannot_be_downloaded_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    import ai2thor.controller

    def refuse(**words: object) -> None:
        raise ValueError("Invalid commit_id: f08 - no build exists for\narch=Linux")

    monkeypatch.setattr(ai2thor.controller, "Controller", refuse)
    with pytest.raises(SceneError) as caught, started("FloorPlan1", STEP_M, 400, 300):
        pytest.fail("started")
    assert str(caught.value).startswith("FloorPlan1: AI2-THOR's simulator cannot be downloaded or started (Invalid")
    assert "\n" not in str(caught.value)


def test_without_the_package_its_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ai2thor.controller", None)
    with pytest.raises(SceneError, match=r"-m pip install '/.*\[ai2thor\]'"), started("FloorPlan1", 0.5, 400, 300):
        pytest.fail("started")


def test_the_simulator_is_stopped_whatever_happens(monkeypatch: pytest.MonkeyPatch) -> None:
    import ai2thor.controller

    simulator = StandIn([])
    monkeypatch.setattr(ai2thor.controller, "Controller", lambda **words: simulator)
    with pytest.raises(SceneError), started("FloorPlan1", STEP_M, 400, 300) as controller:
        importer.photographed(controller, "FloorPlan1", step_m=STEP_M)
    assert simulator.stopped
