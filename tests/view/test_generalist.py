"""The generalist on the viewer's stage, by the shipped eyes, in a small made-up scene."""

from __future__ import annotations

import json

import numpy as np
import pytest
from fastapi.testclient import TestClient

from clearway.errors import AgentError
from clearway.view.episode import Episode, read_episode
from clearway.view.generalist import generalist_stage
from clearway.view.server import make_app
from clearway.view.stage import Stage
from clearway.view.viewing import Viewing
from helpers.made import grid_scene


@pytest.fixture(scope="module")
def alone() -> Stage:
    return generalist_stage([grid_scene(2)])


def test_every_step_tells_what_it_holds(alone):
    session = Viewing(alone)
    answer = session.answer({"do": "begin", "episode": "start=0"})
    scene = alone.scenes[0]
    (step,) = answer["walkers"][0]["steps"]
    x_m, z_m = scene.locations_m[0]
    assert step["held"]["here"][0] == pytest.approx([x_m, z_m, scene.headings_deg[0], 1], abs=1e-3)
    assert step["held"]["cells"] and step["probabilities"] is None and step["next"] in range(4)
    (after,) = session.answer({"do": "step"})["steps"]
    assert after["action"] == step["next"] and after["held"]["cells"] != step["held"]["cells"]
    assert json.loads(json.dumps(after)) == after


def test_its_link_replays_it(alone):
    session = Viewing(alone)
    session.begin(Episode(seed=4))
    for _ in range(3):
        session.answer({"do": "step"})
    again = Viewing(alone)
    again.begin(read_episode(session.walked().query()))
    for _ in range(3):
        again.answer({"do": "step"})
    assert [step.state for step in again.walkers[0].steps] == [step.state for step in session.walkers[0].steps]


def test_what_it_does_not_tell_is_refused(alone):
    session = Viewing(alone)
    session.begin(Episode())
    assert "tells no values" in session.answer({"do": "map", "walker": 0})["text"]
    with pytest.raises(AgentError, match="tells no probabilities"):
        session.begin(Episode(selection="argmax"))


def test_the_page_is_told_that_it_keeps_a_map(alone):
    told = TestClient(make_app(alone)).get("/stage.json").json()
    assert told["agents"] == [{"name": "generalist", "values": False, "map": True}]


def test_after_a_tour_its_map_lies_around_the_tours_start():
    stage = generalist_stage([grid_scene(2)], tour=12)
    (shown,) = stage.agents
    assert shown.name == "generalist, tour of 12 steps"
    session = Viewing(stage)
    session.begin(Episode(seed=1))
    scene, held = stage.scenes[0], session.walkers[0].steps[0].held
    start = shown._tour(scene.name).start
    middle = scene.locations_m[start]
    steps = (held.cells[:, :2] - middle) / scene.cell_size_m
    assert np.allclose(steps, np.rint(steps)) and len(held.cells) >= 4  # cells of the scene, not beside them
    assert (np.abs(held.cells[:, :2] - middle).sum(axis=1) < 1e-6).any()  # where it has stood
