"""A deployed agent of a run says whether it has arrived."""

from dataclasses import replace

import numpy as np
import pytest

import clearway
from clearway.agents.agent import FEATURES
from clearway.agents.arrival import fitted_arrival
from clearway.deploy.from_run import RunAgent, compared_numbers
from clearway.deploy.onnx_file import OnnxAgent, read_onnx
from clearway.errors import DeployError
from clearway.perception import eyes


@pytest.mark.parametrize("source", ["run", "agent"])
def test_a_navigator_has_arrived_at_the_target_and_at_few_other_poses(deployed, source) -> None:
    navigator = clearway.Navigator(getattr(deployed, source), scene="cellar", seed=0)
    assert navigator.card.tells_arrival
    navigator.set_target(deployed.pictures[9])
    assert navigator.arrived is None
    told = []
    for picture in deployed.pictures:
        navigator.act(picture)
        told.append(navigator.arrived)
    features = np.asarray(deployed.scenes[1].features)
    expected = fitted_arrival(features, features.shape[1])(features, features[[9]].repeat(len(features), axis=0))
    assert told[9] is True
    assert told == expected.tolist()
    assert sum(told) < len(told) / 4


def test_the_policy_alone_tells_too(deployed, policy_file) -> None:
    features = deployed.scenes[1].features
    navigator = clearway.Navigator(policy_file)
    navigator.set_target(features[3])
    for state in (3, 22):
        navigator.act(features[state])
        assert navigator.arrived is (state == 3)


def test_the_first_numbers_of_eyes_are_their_description() -> None:
    record = eyes.find_record()
    assert compared_numbers(record, 3_200) == record.settings["shape"]["description_width"] < 3_200
    assert compared_numbers(replace(record, settings={"kind": "another"}), 3_200) == 3_200


def test_an_earlier_file_still_walks_and_tells_nothing(deployed) -> None:
    file = read_onnx(deployed.agent)
    earlier = replace(file, card=replace(file.card, settings={}))
    navigator = clearway.Navigator(OnnxAgent(earlier), seed=0)
    navigator.set_target(deployed.pictures[3])
    navigator.act(deployed.pictures[3])
    assert navigator.arrived is None and not navigator.card.tells_arrival


@pytest.mark.parametrize("kept", [{"threshold": 3.0, "numbers": 1}, [1, 2], "high", {"threshold": 0.5}])
def test_a_damaged_threshold_is_one_line(deployed, kept) -> None:
    file = read_onnx(deployed.agent)
    with pytest.raises(DeployError, match=r"its metadata cannot be read .*Export it again"):
        OnnxAgent(replace(file, card=replace(file.card, settings={"arrival": kept})))


def test_a_scene_of_equal_pictures_has_no_threshold(deployed) -> None:
    scene = deployed.scenes[1]
    alike = np.ones_like(np.asarray(scene.features))
    chosen = replace(deployed.chosen, scene=replace(scene, features=alike))
    agent = RunAgent(chosen)
    assert chosen.arrival is None and not agent.card.tells_arrival
    state = agent.reset({FEATURES: alike[:1]}, np.zeros(1, np.int64))
    assert agent.act({"rgb": deployed.pictures[:1]}, state)[0].arrived is None
