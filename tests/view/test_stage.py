from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from clearway.errors import RunError, SceneError
from clearway.reward import Reward
from clearway.view.stage import Stage, _has, run_stage, scene_stage, variety
from helpers.agents import after_poses
from helpers.made import corridor_scene, grid_scene
from helpers.small_runs import FEATURES
from helpers.small_stage import small_agent, write_scenes


def test_two_agents_share_the_scenes_that_both_know(stage: Stage) -> None:
    assert [agent.name for agent in stage.agents] == ["aware", "plain"]
    assert [agent.reward.name for agent in stage.agents] == ["collision-aware", "shortest"]
    assert [scene.name for scene in stage.scenes] == ["corridor", "grid", "bare"]
    assert stage.targets["corridor"] == (0, 8, 16)
    assert stage.index("bare") == 2
    with pytest.raises(RunError, match=r"attic.*corridor, grid, bare"):
        stage.index("attic")


def test_an_agent_of_one_scene_limits_what_is_shown(folder: Path, stage: Stage, tmp_path: Path) -> None:
    corridor = [corridor_scene(5, feature_count=FEATURES)]
    alone = small_agent(tmp_path / "alone", scenes=corridor)
    shown = run_stage([folder / "aware", alone], [folder / f"{name}.h5" for name in ("corridor", "grid", "bare")])
    assert [scene.name for scene in shown.scenes] == ["corridor"]
    longer = [corridor_scene(6, feature_count=FEATURES)]
    other = small_agent(tmp_path / "other", scenes=longer)
    with pytest.raises(RunError, match=r"missing.*--scenes"):
        run_stage([alone, other])


def test_agents_without_a_scene_in_common_are_refused(tmp_path: Path) -> None:
    first = small_agent(tmp_path / "first", scenes=[corridor_scene(5, feature_count=FEATURES)])
    grid = grid_scene(1, width=4, depth=3, feature_count=FEATURES)
    second = small_agent(tmp_path / "second", scenes=[grid])
    files = write_scenes(tmp_path, [corridor_scene(5, feature_count=FEATURES), grid])
    with pytest.raises(RunError, match=r"second: trained on other rooms than .*first \(corridor and grid\)"):
        run_stage([first, second], files)


@pytest.mark.parametrize("part", ["graph", "locations_m", "headings_deg"])
def test_a_scene_of_the_same_name_with_other_poses_or_moves_is_not_shared(stage: Stage, part: str) -> None:
    shown, scene = stage.agents[1], stage.scenes[0]
    assert _has(shown, replace(scene))
    assert not _has(shown, replace(scene, **{part: getattr(scene, part)[::-1]}))


def test_runs_of_one_name_are_told_apart_by_their_paths(tmp_path: Path) -> None:
    corridor = [corridor_scene(5, feature_count=FEATURES)]
    runs = [small_agent(tmp_path / part / "run", scenes=corridor) for part in "ab"]
    shown = run_stage(runs, write_scenes(tmp_path, corridor))
    assert [agent.name for agent in shown.agents] == [str(run) for run in runs]


def test_an_agent_s_world_has_the_target_asked_for_alone_and_shares_its_tables(stage: Stage) -> None:
    shown = stage.agents[1]
    world = shown.place("grid", 7)
    assert world.scene_names == ("corridor", "grid", "bare")
    assert [world.scene_names[scene] for scene in world.target_scene.tolist()] == ["grid"]
    assert world.scene_state(0) == 7
    assert world.features is shown.world.features
    assert world.next_state is shown.world.next_state
    with pytest.raises(SceneError, match="99"):
        shown.place("corridor", 99)


def test_an_agent_thinks_of_a_target_as_if_it_had_been_there_from_the_beginning(stage: Stage) -> None:
    shown = stage.agents[0]
    for scene, target in (("grid", 7), ("corridor", 3)):
        placed = shown.place(scene, target)
        starts, goal = placed.start_state[:, None], torch.zeros(len(placed.start_state), dtype=torch.int64)
        found, expected = (
            after_poses(agent, placed, starts, goal)
            for agent in (shown.on_poses(placed), shown.trained.on_poses(placed))
        )
        np.testing.assert_allclose(found.probabilities, expected.probabilities, rtol=1e-5, atol=1e-6)
        np.testing.assert_allclose(found.value, expected.value, rtol=1e-5, atol=1e-6)
        assert np.ptp(found.value) > 0


def paid(reward: Reward, stage: Stage) -> float:
    """The most that a step earns."""
    return reward.table(stage.agents[0].world.moves()).max()


def test_values_and_rewards_are_of_one_scale(stage: Stage) -> None:
    """A learner that clipped its rewards knows of no reward of 10."""
    shown = stage.agents[0]
    record = shown.trained.record
    clipping = replace(record, reward=replace(record.learner, clip_rewards=True).paid(record.reward))
    assert paid(shown.reward, stage) == 10
    assert paid(replace(shown, trained=replace(shown.trained, record=clipping)).reward, stage) == 1


def test_the_map_shows_the_zones_that_the_first_agent_learnt_from(stage: Stage) -> None:
    shown, other = stage.agents
    by_cell = replace(shown, trained=replace(shown.trained, record=replace(shown.trained.record, zone_level="cell")))
    assert (stage.zone_level, replace(stage, agents=(by_cell, other)).zone_level) == ("pose", "cell")


def test_a_scene_alone_has_no_agents(stage: Stage) -> None:
    shown = scene_stage(stage.scenes[1])
    assert (shown.agents, shown.zone_level, shown.reward.name) == ((), "pose", "collision-aware")
    world = shown.user_world(shown.scenes[0], 3)
    assert world.scene_state(0) == 3
    np.testing.assert_array_equal(world.blocked.numpy(), shown.scenes[0].graph < 0)


def test_the_first_target_is_no_wall(stage: Stage) -> None:
    fine = np.indices((300, 400)).sum(0) % 20 < 10  # bricks
    wall = np.repeat(np.where(fine, 90, 170).astype(np.uint8)[..., None], 3, axis=2)
    view = np.full((300, 400, 3), 120, np.uint8)
    view[:150], view[150:, :200] = 240, 30
    assert variety(view) > 5 * variety(wall)
    scene = corridor_scene(5)
    pictures = np.stack([view if state == 6 else wall for state in range(scene.state_count)])
    shown = Stage((replace(scene, observations=pictures),), {scene.name: (2, 6, 9)})
    assert shown.first_target(scene.name) == 6
    assert stage.first_target("bare") == stage.targets["bare"][0]  # without pictures
