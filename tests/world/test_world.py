from dataclasses import replace

import numpy as np
import pytest
import torch

from clearway.errors import SceneError
from clearway.scenes.actions import BLOCKED, Action
from clearway.scenes.scene import EncoderRecord, Scene
from clearway.world import world
from clearway.world.world import World, make_world
from clearway.zones import scene_zones
from helpers.made import corridor_scene, grid_scene


def one_way_corridor() -> Scene:
    """Two cells; nothing leads out of the second."""
    scene = corridor_scene(2)
    graph = scene.graph.copy()
    graph[4:, [Action.MOVE_FORWARD, Action.MOVE_BACKWARD]] = BLOCKED
    return replace(scene, graph=graph)


def steps_from_everywhere(world: World) -> np.ndarray:
    """(M, S)."""
    target, state = torch.arange(world.target_count), torch.arange(world.state_count)
    return world.distance_table()[target[:, None], state].numpy()


def test_two_scenes_share_one_numbering() -> None:
    first, second = corridor_scene(3, name="first"), corridor_scene(4, name="second")
    world = make_world([first, second], {"first": [8], "second": [0, 12]})
    assert world.scene_names == ("first", "second")
    assert world.scene_offset.tolist() == [0, 12, 28]
    assert (world.scene_count, world.target_count, world.state_count) == (2, 3, 28)
    assert world.target_state.tolist() == [8, 12, 24]
    assert world.target_scene.tolist() == [0, 1, 1]
    assert [world.scene_state(target) for target in range(3)] == [8, 0, 12]
    assert world.next_state[12].tolist() == [16, 13, 15, 12]  # forward, right, left; backward is blocked
    assert world.blocked[12].tolist() == [False, False, False, True]
    assert torch.equal(world.features[12:], torch.from_numpy(second.features))
    assert world.zone[12:].tolist() == scene_zones(second).tolist()


def test_starts_are_all_states_that_reach_the_target() -> None:
    scene = grid_scene(2)
    targets = [1, scene.state_count - 1]
    world = make_world([scene], {scene.name: targets})
    assert world.start_count.tolist() == [scene.state_count - 1] * 2
    for row, target in enumerate(targets):
        starts = world.start_state[world.start_offset[row] :][: world.start_count[row]]
        assert starts.tolist() == [state for state in range(scene.state_count) if state != target]
    assert np.array_equal(steps_from_everywhere(world), scene.distances[:, targets].T)
    expected = scene.distances[:, targets].sum(axis=0) / (scene.state_count - 1)
    steps = world.start_steps.double().split(world.start_count.tolist())
    assert [float(own.mean()) for own in steps] == pytest.approx(expected.tolist())


def test_states_that_cannot_reach_the_target_are_no_starts() -> None:
    scene = one_way_corridor()
    world = make_world([scene], {scene.name: [0, 4]})
    assert world.start_state.tolist() == [1, 2, 3, 0, 1, 2, 3, 5, 6, 7]
    assert steps_from_everywhere(world)[0].tolist() == [0, 1, 2, 1, -1, -1, -1, -1]


def test_the_cell_level_is_passed_on() -> None:
    scene = corridor_scene(5)
    world = make_world([scene], {scene.name: [0]}, "cell")
    assert (world.zone == 2).all()


def test_scenes_without_features() -> None:
    scene = replace(corridor_scene(3), features=None, encoder=None)
    assert make_world([scene], {scene.name: [0]}).features is None


@pytest.mark.parametrize(
    ("targets", "message"),
    [
        ({}, "no target"),
        ({"corridor": []}, "no target"),
        ({"corridor": [20]}, r"target 20 is out of range \(states are 0 to 19\)"),
        ({"corridor": [-1]}, "target -1 is out of range"),
        ({"corridor": [3, 4, 3]}, "named twice"),
    ],
)
def test_targets_that_do_not_fit(targets: dict[str, list[int]], message: str) -> None:
    with pytest.raises(SceneError, match=f"corridor: .*{message}"):
        make_world([corridor_scene(5)], targets)


def test_targets_of_a_scene_that_is_not_there() -> None:
    with pytest.raises(SceneError, match=r"^hall: targets are given .* not among the scenes.*Name targets of corridor"):
        make_world([corridor_scene(5)], {"corridor": [0], "hall": [3]})


def test_a_target_that_nothing_leads_to() -> None:
    scene = corridor_scene(2)
    graph = scene.graph.copy()
    graph[graph == 4] = BLOCKED
    with pytest.raises(SceneError, match="only 0 of 8 states lead to target 4"):
        make_world([replace(scene, graph=graph)], {scene.name: [4]})


def test_a_target_on_an_island() -> None:
    """In bedroom_04 a cell cannot be entered; there turning on the spot leads from state to state."""
    scene = corridor_scene(5)
    graph = scene.graph.copy()
    graph[16:20, [Action.MOVE_FORWARD, Action.MOVE_BACKWARD]] = BLOCKED
    inward = (graph[:16] >= 16) & (graph[:16] < 20)
    graph[:16][inward] = BLOCKED
    island = replace(scene, graph=graph)
    with pytest.raises(SceneError, match=r"only 3 of 20 states lead to target 17.*largest component"):
        make_world([island], {scene.name: [3, 17]})
    assert make_world([island], {scene.name: [3]}).start_count.tolist() == [15]


def test_scenes_of_one_name() -> None:
    with pytest.raises(SceneError, match="two scenes have this name"):
        make_world([corridor_scene(3), corridor_scene(4)], {"corridor": [0]})


def test_features_that_do_not_belong_together() -> None:
    first = corridor_scene(3, name="first")
    targets = {"first": [0], "second": [0]}
    cases = {
        "24 features a state": corridor_scene(3, name="second", feature_count=24),
        "made-up .*other-weights": replace(
            corridor_scene(3, name="second"), encoder=EncoderRecord("made-up", "other-weights")
        ),
        "only some of the scenes": replace(corridor_scene(3, name="second"), features=None, encoder=None),
    }
    for message, second in cases.items():
        with pytest.raises(SceneError, match=message) as refused:
            make_world([first, second], targets)
        assert "clearway scenes encode FILES --encoder made-up --out FOLDER" in str(refused.value)


def test_a_target_that_is_no_whole_number_is_refused() -> None:
    scene = corridor_scene(4)
    with pytest.raises(SceneError, match=r"target 1\.9 is no state id"):
        make_world([scene], {scene.name: [1.9]})
    assert make_world([scene], {scene.name: np.array([3])}).target_state.tolist() == [3]


def test_targets_are_refused_before_features_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    read = []
    monkeypatch.setattr(world, "joined_features", lambda *arguments: read.append(arguments))
    with pytest.raises(SceneError, match="out of range"):
        make_world([corridor_scene()], {"corridor": [99]})
    assert not read
    make_world([corridor_scene()], {"corridor": [16]})
    assert len(read) == 1
