from dataclasses import replace

import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.scenes.floor_plans import GENERATED
from clearway.scenes.scene import Provenance, Scene
from clearway.scenes.targets import ZHU_TARGETS, default_held_out_targets, default_targets, seeded_targets, target_order
from helpers.made import grid_scene, scene_of_cells

ROOM = [[x, z] for x in range(3) for z in range(2)]
ISLANDS = [[10 * n, 10] for n in range(1, 7)]


def with_islands() -> Scene:
    """Islands of one cell each before and behind a room of six cells."""
    return scene_of_cells(np.array(ISLANDS[:3] + ROOM + ISLANDS[3:]))


def rectangle(width: int, depth: int, name: str) -> Scene:
    cells = np.argwhere(np.ones((width, depth), bool))
    return scene_of_cells(cells, feature_count=1, picture_size=(1, 1), name=name)


@pytest.mark.parametrize("seed", range(8))
def test_targets_lie_in_the_largest_component_in_distinct_cells(seed: int) -> None:
    scene = with_islands()
    room = range(4 * 3, 4 * 9)
    assert sorted(target_order(scene, seed)) == list(room)
    targets = seeded_targets(scene, 6, seed)
    assert list(targets) == sorted(set(targets) & set(room))
    assert len(targets) == len(set(scene.cells[list(targets)])) == 6
    assert seeded_targets(scene, 6, seed) == targets


def test_another_seed_chooses_others() -> None:
    assert len({seeded_targets(grid_scene(0), seed=seed) for seed in range(5)}) > 1


def test_more_targets_than_the_component_has_are_refused() -> None:
    with pytest.raises(SceneError, match="24 targets asked for, the largest component has 24 states"):
        seeded_targets(with_islands(), 24)


def test_a_small_component_has_fewer_default_targets() -> None:
    scene = scene_of_cells(np.array(ISLANDS))
    targets = default_targets(scene)
    assert len(targets) == 3
    assert {scene.components[target] for target in targets} == {0}


def test_published_targets_are_for_scenes_of_published_names_and_sizes() -> None:
    published = rectangle(13, 13, "kitchen_02")
    assert default_targets(published) == ZHU_TARGETS["kitchen_02"] == (90, 136, 157, 207, 329)
    assert default_targets(replace(published, name="kitchen")) == seeded_targets(published)
    larger, smaller = rectangle(13, 14, "kitchen_02"), rectangle(10, 10, "kitchen_02")
    assert default_targets(larger) == seeded_targets(larger)
    assert default_targets(smaller) == seeded_targets(smaller)


def generated(name: str = "room-train-000003-bathroom") -> Scene:
    scene = rectangle(6, 5, name)
    return replace(scene, made_by=Provenance(GENERATED, seed=0))


def test_in_generated_rooms_none_that_is_held_out_is_drawn() -> None:
    scene = generated()
    held = set(np.flatnonzero(scene.held_out).tolist())
    assert len(held) == 12 and set(target_order(scene)) == set(range(120)) - held
    for seed in range(40):
        assert not set(default_targets(scene, seed)) & held
        drawn = default_held_out_targets(scene, seed)
        assert len(drawn) == 5 and set(drawn) <= held and len(set(scene.cells[list(drawn)])) == 3
    ordinary = replace(scene, made_by=Provenance("floor-plan"))
    assert any(set(default_targets(ordinary, seed)) & held for seed in range(40))


def test_a_generated_room_of_few_poses_has_few_held_out_targets() -> None:
    scene = replace(rectangle(2, 1, "small"), made_by=Provenance(GENERATED, seed=0))
    assert len(default_held_out_targets(scene)) == len(default_targets(scene)) == 4
    assert not set(default_held_out_targets(scene)) & set(default_targets(scene))
    with pytest.raises(
        SceneError, match=r"5 targets asked for, the largest component has 4 states that are held out\."
    ):
        seeded_targets(scene, 5, held_out=True)


def test_where_nothing_is_held_out_a_line_says_so() -> None:
    with pytest.raises(SceneError, match=r"nothing is held out in it: it is no generated room or flat\. Name targets"):
        default_held_out_targets(rectangle(6, 5, "hall"))
    alone = replace(rectangle(1, 1, "alone"), made_by=Provenance(GENERATED, seed=0))
    with pytest.raises(SceneError, match="nothing is held out in it: it is too small"):
        default_held_out_targets(alone)
