"""The agent for any room: by PyTorch and by its file, in walks, on tours, with its map in a file."""

from __future__ import annotations

import json
from dataclasses import asdict, replace

import numpy as np
import pytest

import clearway
from clearway.deploy.card import card_from_json
from clearway.deploy.generalist import exported_generalist
from clearway.deploy.onnx_file import read_onnx, sealed
from clearway.errors import ArgumentError, DeployError
from clearway.evaluation.episodes import run_episodes
from clearway.mapping.charting import charted
from clearway.mapping.map_files import HEADER, read_map, write_map
from clearway.mapping.room_map import RoomMap
from clearway.mapping.settings import MappingSettings
from clearway.mapping.smoothing import smoothed
from clearway.mapping.walk import Walk
from clearway.scenes.actions import BLOCKED
from clearway.scenes.aspect import AspectWarning
from clearway.scenes.sensors import RGB
from clearway.world.world import make_world
from helpers.agents import check_agent
from helpers.imported import imported_by
from helpers.made import corridor_scene, grid_scene
from helpers.sums import Sums, plain

SCENE = grid_scene(3, picture_size=(24, 32))
PICTURES = SCENE.observations[:]


def walked(agent, **settings):
    world = make_world([SCENE], {SCENE.name: [5, 22, 40]})
    return run_episodes(
        world, agent, scenes=[SCENE], episodes_per_target=3, step_limit=60, seed=1, record=True, **settings
    )


def toured(navigator, steps=25):
    """What a navigator did on a tour of the scene from its first pose."""
    state, actions = 0, []
    for _ in range(steps):
        actions.append(int(navigator.explore(PICTURES[state]).action))
        state = max(int(SCENE.graph[state, actions[-1]]), -1) if SCENE.graph[state, actions[-1]] >= 0 else state
    return actions


def gone(navigator, start=8, target=30, steps=12):
    """What a navigator did on the way to a target, and whether it held each time that it was there."""
    state, told = start, []
    navigator.set_target(PICTURES[target])
    for _ in range(steps):
        action = int(navigator.act(PICTURES[state]).action)
        told.append((action, navigator.arrived))
        state = int(SCENE.graph[state, action]) if SCENE.graph[state, action] >= 0 else state
    return told


@pytest.mark.slow
def test_the_file_sees_and_compares_as_the_eyes_do(one_file) -> None:
    """However many there are, none among them."""
    torch, onnx = one_file.generalist, one_file.onnx.generalist
    features = torch.encoder.encode(PICTURES[:6])
    np.testing.assert_allclose(onnx.encoder.encode(PICTURES[:6]), features, atol=1e-4)
    for count in (0, 1, 6):
        pair = features[:count], np.flip(features, 0)[:count].copy()
        np.testing.assert_allclose(onnx.sight.stands(pair[0]), torch.sight.stands(pair[0]), atol=1e-4)
        np.testing.assert_allclose(onnx.sight.whereabouts(*pair), torch.sight.whereabouts(*pair), atol=1e-4)
    np.testing.assert_array_equal(onnx.sight.description(features), torch.sight.description(features))


@pytest.mark.slow
def test_the_file_walks_whole_walks_as_pytorch_does(one_file) -> None:
    expected, found = walked(one_file.torch), walked(one_file.onnx)
    assert len({walk.actions.tobytes() for walk in expected.trajectories}) > 3, (
        "all walks are alike: this shows nothing"
    )
    for one, other in zip(found.trajectories, expected.trajectories, strict=True):
        assert one.actions.tolist() == other.actions.tolist()
    assert found.false_arrivals.tolist() == expected.false_arrivals.tolist() and found.false_arrivals.any()


@pytest.mark.slow
def test_the_file_makes_the_same_map_of_pictures_that_do_not_repeat(one_file) -> None:
    rng, state, seen, actions, settings = np.random.default_rng(2), 0, [], [], MappingSettings()
    for _ in range(40):
        seen.append(np.clip(PICTURES[state] + rng.integers(-20, 20, PICTURES[0].shape), 0, 255).astype(np.uint8))
        actions.append(int(rng.choice([0, 0, 1, 2, 3])))
        state = int(SCENE.graph[state, actions[-1]]) if SCENE.graph[state, actions[-1]] != BLOCKED else state
    features = one_file.generalist.encoder.encode(np.stack(seen)).astype(np.float16)
    walk = Walk(features, np.array(actions), np.full((40, 3), settings.side // 2) * (0, 1, 1))
    poses, maps = [], []
    for agent in (one_file.generalist, one_file.onnx.generalist):
        poses.append(smoothed(walk, agent.sight, settings))
        maps.append(charted(walk, poses[-1], agent.sight, settings))
    assert poses[0].tolist() == poses[1].tolist() and len(np.unique(poses[0], axis=0)) > 5
    np.testing.assert_allclose(maps[1].room, maps[0].room, atol=1e-3)
    assert (maps[1].shut == maps[0].shut).all()


@pytest.mark.parametrize("made", ["torch", pytest.param("onnx", marks=pytest.mark.slow)])
def test_it_keeps_the_protocol(one_file, made) -> None:
    rng = np.random.default_rng(0)
    observations = [{RGB: PICTURES[rng.integers(len(PICTURES), size=3)]} for _ in range(4)]
    assert check_agent(getattr(one_file, made), observations, {RGB: PICTURES[:3]}, draws=False).shape == (4, 3)


@pytest.mark.slow
def test_a_navigator_tours_then_goes_by_its_map_also_from_a_file(one_file, tmp_path) -> None:
    one, other, new = (clearway.Navigator(agent) for agent in (one_file.torch, one_file.path, one_file.onnx))
    assert toured(one) == toured(other)
    before = gone(new)
    told = gone(one)
    assert gone(other) == told != before
    one.save_map(tmp_path / "room.safetensors")
    new.load_map(tmp_path / "room.safetensors")
    assert gone(new) == told
    assert gone(clearway.Navigator(one_file.torch)) == before, "a map is the navigator's, not the agent's"


def test_a_tour_is_saved_while_it_lasts_and_a_new_one_begins_after_a_target(one_file, tmp_path) -> None:
    navigator, path = clearway.Navigator(one_file.torch), tmp_path / "room.safetensors"
    with pytest.raises(DeployError, match=r"no map yet\. Call explore first"):
        navigator.save_map(path)
    toured(navigator, 9)
    navigator.save_map(path)
    longer = len(one_file.torch.read_map(path).taken)
    navigator.set_target(PICTURES[3])
    navigator.explore(PICTURES[3])
    assert navigator.arrived is None
    with pytest.raises(DeployError, match="no target yet"):
        navigator.act(PICTURES[3])
    navigator.save_map(path)
    assert len(one_file.torch.read_map(path).taken) == 1 < longer
    with pytest.raises(DeployError, match="room: cannot be written"):
        (tmp_path / "room").mkdir()
        navigator.save_map(tmp_path / "room")


def test_a_room_without_ways_out_is_toured_all_the_same(one_file) -> None:
    navigator = clearway.Navigator(one_file.torch)
    actions = {int(navigator.explore(PICTURES[state % 4]).action) for state in range(60)}
    assert len(actions) > 1
    navigator.set_target(PICTURES[2])
    navigator.act(PICTURES[0])


def test_what_it_tells(one_file) -> None:
    navigator = clearway.Navigator(one_file.path)
    card = navigator.card
    assert (card.scene, card.kind, card.picture_size) == ("any room", "generalist", (48, 64))
    assert card.observation["vertical_fov_deg"] == 60 and card.settings["side_m"] == 10.0
    assert card_from_json(card.to_json(), "here") == card
    navigator.set_target(PICTURES[3])
    assert navigator.arrived is None
    decision = navigator.act(PICTURES[3])
    assert decision.probabilities is decision.value is None and navigator.arrived in (True, False)
    network = clearway.Navigator(Sums())
    network.set_target(plain(1))
    network.act(plain(1))
    assert network.arrived is None


def test_the_name_is_the_agent_that_comes_along_unless_there_is_a_file_of_it(one_file, monkeypatch, tmp_path) -> None:
    navigator = clearway.Navigator("generalist")
    assert navigator.card.encoder["name"] == "clearway" and navigator.card.feature_count == 3200
    with pytest.raises(DeployError, match=r"is for scene any room, not attic\. Leave the scene out"):
        clearway.Navigator("generalist", scene="attic")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "generalist").write_bytes(b"")
    with pytest.raises(DeployError, match="not an agent's ONNX file"):
        clearway.Navigator("generalist")


def test_any_size_is_taken_and_another_aspect_is_refused(one_file) -> None:
    navigator = clearway.Navigator(one_file.torch)
    for size in ((48, 64), (300, 400), (97, 128)):
        navigator.set_target(plain(5, size))
    for size, crop in (((360, 640), "480 x 360"), ((300, 300), "300 x 225")):
        with pytest.raises(DeployError, match=rf"those of the training 1\.33 .*Crop them to {crop}"):
            navigator.set_target(plain(5, size))


def test_scenes_of_another_aspect_are_walked_with_a_warning(one_file) -> None:
    square = grid_scene(3, picture_size=(24, 24))
    with pytest.warns(AspectWarning, match="scene grid: pictures of 24 x 24 pixels have the aspect 1.00"):
        one_file.generalist.seen([square])
    with pytest.warns(AspectWarning) as told:
        one_file.generalist.warn_of_aspect([square, replace(square, name="other"), SCENE])
    assert [str(one.message).partition(":")[0] for one in told] == ["scene grid and 1 more"]
    one_file.generalist.seen([SCENE])


@pytest.mark.parametrize("call", ["explore", "save_map", "load_map"])
def test_an_agent_without_memory_has_nothing_of_a_tour(call, tmp_path) -> None:
    given = plain(1) if call == "explore" else tmp_path / "map"
    with pytest.raises(DeployError, match=r"the agent for scene attic keeps no map, and .*Open generalist"):
        getattr(clearway.Navigator(Sums()), call)(given)


def test_it_draws_nothing_that_could_be_chosen(one_file) -> None:
    with pytest.raises(DeployError, match="selection is 'argmax', and the agent draws nothing"):
        clearway.Navigator(one_file.torch, selection="argmax")


def test_goals_are_walked_by_the_file_as_by_the_eyes(one_file) -> None:
    asked = {"goals": 6, "step_limit": 30, "tour": 20}
    (expected, *_), (found, *_) = (
        clearway.evaluate_goals(agent, [SCENE], **asked) for agent in (one_file.generalist, one_file.path)
    )
    assert found == expected
    with pytest.raises(ArgumentError, match=r"is for any room.*evaluate --goals"):
        clearway.evaluate(one_file.path, [corridor_scene(5)])


def test_goals_are_not_for_the_file_of_one_scene(deployed) -> None:
    with pytest.raises(ArgumentError, match=r"agent\.onnx: holds the agent for scene cellar, and goals are for agents"):
        clearway.evaluate_goals(deployed.agent, [SCENE], goals=4)


SETTINGS = asdict(MappingSettings())


def resealed(one_file, path, **changes):
    """The file with another card."""
    import onnx

    from clearway.deploy.onnx_file import CARD_KEY, CHECKSUM_KEY, NO_DIGEST

    model = onnx.load(one_file.path)
    for entry in model.metadata_props:
        if entry.key == CARD_KEY:
            entry.value = json.dumps(json.loads(entry.value) | changes)
        if entry.key == CHECKSUM_KEY:
            entry.value = NO_DIGEST.decode()
    path.write_bytes(sealed(model.SerializeToString(deterministic=True)))
    return path


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"kind": "dreamer"}, "holds an agent of the kind 'dreamer', unknown to this clearway"),
        ({"settings": {"side": 21}}, "its card is not one of a generalist of clearway .*arrived"),
        ({"settings": "none"}, "its metadata cannot be read .a part of it is no object"),
        ({"settings": SETTINGS | {"side_m": 1e4}}, r"side_m is 10000.0, expected 1 to 60"),
        ({"settings": SETTINGS | {"side_m": float("nan")}}, "side_m is nan"),
        ({"settings": SETTINGS | {"step_m": 0.0}}, "step_m is 0.0"),
        ({"settings": SETTINGS | {"compared": -3}}, "compared is -3"),
        ({"encoder": {}}, "its card is not one of a generalist"),
    ],
)
def test_files_that_do_not_fit_are_refused(one_file, tmp_path, changes, part) -> None:
    with pytest.raises(DeployError, match=part):
        clearway.Navigator(resealed(one_file, tmp_path / "other.onnx", **changes))


def test_an_altered_file_is_refused(one_file, tmp_path) -> None:
    content = bytearray(one_file.path.read_bytes())
    content[len(content) // 2] ^= 1
    (tmp_path / "altered.onnx").write_bytes(content)
    with pytest.raises(DeployError, match="has changed since it was exported"):
        clearway.Navigator(tmp_path / "altered.onnx")


@pytest.mark.slow
def test_a_robot_with_the_file_needs_no_pytorch(one_file) -> None:
    statement = f"""
import clearway, numpy
navigator, picture = clearway.Navigator({str(one_file.path)!r}), numpy.zeros((24, 32, 3), numpy.uint8)
navigator.explore(picture)
navigator.set_target(picture)
navigator.act(picture)
"""
    loaded = imported_by(statement)
    assert {"clearway.deploy.onnx_session", "clearway.deploy.generalist"} <= loaded and not loaded & {
        "torch",
        "onnx",
        "gymnasium",
    }


KNOWN = RoomMap(
    np.ones((5, 5), np.float32),
    np.zeros((4, 5, 5), bool),
    np.array([[0, 1, 2], [3, 4, 4]]),
    np.ones((2, 8), np.float16),
)


def test_a_map_comes_back_as_it_was(tmp_path) -> None:
    write_map(tmp_path / "map", KNOWN, "eyes", 0.5)
    found = read_map(tmp_path / "map", "eyes", 0.5, 8)
    for name, value in vars(KNOWN).items():
        np.testing.assert_array_equal(getattr(found, name), value)
        assert getattr(found, name).dtype == value.dtype


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"features": np.ones((2, 7), np.float16)}, r"features is float16 \(2, 7\), expected float16 \(2, 8\)"),
        ({"features": np.full((2, 8), np.nan, np.float16)}, "NaN or Inf"),
        ({"taken": np.array([[0, 1, 5], [0, 0, 0]])}, "a picture's pose lies outside it"),
        ({"shut": np.zeros((4, 5, 4), bool)}, r"shut is bool \(4, 5, 4\)"),
        ({"room": np.zeros((0, 0), np.float32), "shut": np.zeros((4, 0, 0), bool)}, "has 2 pictures on 0 x 0 cells"),
    ],
)
def test_maps_that_cannot_be(tmp_path, changes, part) -> None:
    write_map(tmp_path / "map", replace(KNOWN, **changes), "eyes", 0.5)
    with pytest.raises(DeployError, match=part):
        read_map(tmp_path / "map", "eyes", 0.5, 8)


def test_a_map_of_other_eyes_an_altered_one_and_what_is_none(tmp_path) -> None:
    path = tmp_path / "map"
    write_map(path, KNOWN, "eyes", 0.5)
    with pytest.raises(DeployError, match=r"made by other eyes \('eyes'\), and the agent's are 'others'"):
        read_map(path, "others", 0.5, 8)
    with pytest.raises(DeployError, match=r"made by moves of 0\.5 m, and the agent's are 0\.25 m\. Tour"):
        read_map(path, "eyes", 0.25, 8)
    whole = path.read_bytes()
    for end in (1, 60, -40):
        content = bytearray(whole)
        content[end] ^= 4
        path.write_bytes(content)
        with pytest.raises(DeployError, match=r"map: .*Tour the room again"):
            read_map(path, "eyes", 0.5, 8)
    content = bytearray(whole)
    content[-2 * KNOWN.features.size] ^= 1  # the first byte of an array: still a number
    path.write_bytes(content)
    with pytest.raises(DeployError, match="altered, its SHA-256"):
        read_map(path, "eyes", 0.5, 8)
    path.write_bytes(whole.replace(HEADER.encode(), b"x" * len(HEADER)))
    with pytest.raises(DeployError, match="not the map of a room"):
        read_map(path, "eyes", 0.5, 8)
    for content in (b"", b"\xff" * 40, whole[:100]):
        path.write_bytes(content)
        with pytest.raises(DeployError, match="not the map of a room, or damaged"):
            read_map(path, "eyes", 0.5, 8)
    with pytest.raises(DeployError, match="nothing: cannot be read"):
        read_map(tmp_path / "nothing", "eyes", 0.5, 8)


def test_the_file_holds_its_own_settings(one_file) -> None:
    assert exported_generalist(read_onnx(one_file.path)).generalist.settings == one_file.generalist.settings
