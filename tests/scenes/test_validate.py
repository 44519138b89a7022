from dataclasses import replace

import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.scenes.actions import BLOCKED, Action
from clearway.scenes.scene import Provenance, Scene
from clearway.scenes.validate import check_scene, pose_quirks
from helpers.made import corridor_scene, grid_scene


def changed(scene: Scene, part: str, where: object, value: float) -> Scene:
    """The scene with one entry of one of its arrays replaced."""
    values = getattr(scene, part).copy()
    values[where] = value
    return replace(scene, **{part: values})


@pytest.mark.parametrize("seed", range(3))
def test_sound_scenes_pass_without_quirks(seed: int) -> None:
    scene = grid_scene(seed)
    check_scene(scene)
    assert pose_quirks(scene) == []


@pytest.mark.parametrize(
    ("part", "where", "value", "dataset", "problem"),
    [
        ("graph", (0, 0), 20, "graph", "state 0 leads to 20 by action 0, expected -1 to 19"),
        ("graph", (3, 1), -2, "graph", "state 3 leads to -2"),
        ("graph", (4, Action.TURN_RIGHT), -1, "graph", "the right turn is blocked at state 4"),
        ("graph", (4, Action.TURN_LEFT), -1, "graph", "the left turn is blocked at state 4"),
        ("graph", (4, Action.TURN_RIGHT), 6, "graph", "a right and a left turn do not lead back at state 4"),
        ("graph", (4, Action.TURN_LEFT), 5, "graph", "a right and a left turn do not lead back at state 7"),
        ("graph", (4, Action.MOVE_BACKWARD), 4, "graph", "a move leads where it began, and is not -1"),
        ("graph", (slice(None), [Action.MOVE_FORWARD, Action.MOVE_BACKWARD]), -1, "graph", "has no open move"),
        ("features", (7, 2), np.nan, "resnet_feature", "1 states, first 7, hold NaN or Inf"),
        ("features", (7, 2), np.inf, "resnet_feature", "NaN or Inf"),
        ("locations_m", (0, 0), np.nan, "location", "NaN"),
        ("locations_m", (0, 0), 1e9, "location", "10,000 m"),
        ("headings_deg", 0, 400, "rotation", "no headings"),
    ],
)
def test_a_fault_is_named(part: str, where: object, value: float, dataset: str, problem: str) -> None:
    with pytest.raises(SceneError) as caught:
        check_scene(changed(corridor_scene(5), part, where, value), "some.h5")
    assert caught.value.dataset == dataset
    assert problem in str(caught.value)
    assert str(caught.value).startswith("some.h5, dataset")


@pytest.mark.parametrize(
    ("view", "problem"),
    [
        ({"image": np.zeros((0, 8, 3), np.uint8)}, "no picture"),
        ({"image": np.zeros((8, 8), np.uint8)}, "no picture"),
        ({"image": np.zeros((8, 8, 3))}, "float64"),
        ({"x_min_m": 3.0, "x_max_m": 1.0}, "no rectangle"),
        ({"z_min_m": 1.0, "z_max_m": 1.0}, "no rectangle"),
        ({"z_max_m": np.inf}, "no rectangle"),
    ],
)
def test_a_view_from_above_that_cannot_be_drawn_is_refused(view: dict, problem: str) -> None:
    scene = corridor_scene(3)
    with pytest.raises(SceneError, match=problem) as caught:
        check_scene(replace(scene, top_view=replace(scene.top_view, **view)))
    assert caught.value.dataset == "top_view"


def test_wrong_shapes_and_types_are_refused() -> None:
    scene = corridor_scene(3)
    for part, values in {
        "graph": scene.graph[:, :3],
        "locations_m": scene.locations_m[:-1],
        "headings_deg": scene.headings_deg[:, None],
        "features": scene.features[:, :, None],
        "observations": scene.observations[..., :2],
    }.items():
        with pytest.raises(SceneError, match="has shape"):
            check_scene(replace(scene, **{part: values}))
    with pytest.raises(SceneError, match="expected integers"):
        check_scene(replace(scene, graph=scene.graph.astype(float)))
    with pytest.raises(SceneError, match="expected floats"):
        check_scene(replace(scene, features=scene.features.astype(int)))
    with pytest.raises(SceneError, match="no record of their encoder"):
        check_scene(replace(scene, encoder=None))
    with pytest.raises(SceneError, match="cell size"):
        check_scene(replace(scene, cell_size_m=0.0))


def test_one_state_is_too_few() -> None:
    scene = replace(corridor_scene(1), graph=np.zeros((1, 4), np.int32))
    with pytest.raises(SceneError, match="has 1 states"):
        check_scene(scene)


def turning_scene(heading_counts: tuple[int, ...]) -> Scene:
    """Cells in a row along +z, each with its own number of headings; moves lead along the row."""
    headings, graph, first = [], [], 0
    for count in heading_counts:
        own = first + np.arange(count)
        headings += [360 * k // count for k in range(count)]
        graph += [(BLOCKED, *turns, BLOCKED) for turns in zip(np.roll(own, -1), np.roll(own, 1), strict=True)]
        first += count
    cell = np.repeat(np.arange(len(heading_counts)), heading_counts)
    graph = np.array(graph, np.int32)
    along = np.flatnonzero(np.array(headings) == 0)
    graph[along[:-1], Action.MOVE_FORWARD] = along[1:]
    graph[along[1:], Action.MOVE_BACKWARD] = along[:-1]
    return Scene(
        name="turning",
        observations=None,
        features=None,
        locations_m=np.stack([0.0 * cell, 0.5 * cell], axis=1),
        headings_deg=np.array(headings),
        graph=graph,
        made_by=Provenance("test"),
    )


@pytest.mark.parametrize("count", [3, 4, 8, 12])
def test_a_scene_may_have_any_number_of_headings_if_all_places_have_it(count: int) -> None:
    scene = turning_scene((count, count))
    check_scene(scene)
    assert (scene.heading_count, scene.turn_deg) == (count, 360 / count)
    assert pose_quirks(scene) == []
    assert pose_quirks(replace(scene, headings_deg=scene.headings_deg + 1)) == [
        f"some headings are no multiples of {360 / count:g} degrees"
    ]


def test_places_with_different_headings_are_refused() -> None:
    with pytest.raises(SceneError, match=r"lead back are not 4, as elsewhere, at state 8"):
        check_scene(turning_scene((4, 4, 3)))


@pytest.mark.parametrize("count", [1, 2, 361])
def test_too_few_or_too_many_headings_are_refused(count: int) -> None:
    with pytest.raises(SceneError, match=f"has {count} headings, expected 3 to 360"):
        check_scene(turning_scene((count, count)))


def test_quirks_of_poses_are_told() -> None:
    scene = corridor_scene(4)
    (turned,) = {len(pose_quirks(replace(scene, headings_deg=(scene.headings_deg + 90) % 360)))}
    assert turned == 2  # turns are still right; moves lead across the heading, forward and backward
    askew = changed(scene, "headings_deg", 5, 91)
    assert pose_quirks(askew)[0] == "some headings are no multiples of 90 degrees"
    torn = changed(scene, "locations_m", (slice(4, 5), 1), 9.0)
    assert any("a right turn keeps the location" in quirk for quirk in pose_quirks(torn))
    mirrored = replace(scene, headings_deg=-scene.headings_deg % 360)
    assert any("a right turn changes the heading by 90" in quirk for quirk in pose_quirks(mirrored))


@pytest.mark.parametrize("cell_size_m", [0.0, -1.0, 0.0005, 10_001.0, np.nan, np.inf])
def test_cell_sizes_that_the_reader_refuses_are_not_written(cell_size_m: float) -> None:
    with pytest.raises(SceneError, match=r"a cell size of .* m\. Give a length from 0\.001 to 10,000 m"):
        check_scene(replace(corridor_scene(5), cell_size_m=cell_size_m))
