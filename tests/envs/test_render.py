from dataclasses import replace

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from PIL import Image, ImageColor

from clearway import colours
from clearway.envs.floor_map import FloorMap
from clearway.envs.record import EpisodeRecord
from clearway.envs.single import ImageGoalEnv
from clearway.envs.vector import ImageGoalVectorEnv
from clearway.scenes.actions import BLOCKED, Action
from clearway.scenes.scene import Scene
from clearway.zones import Zone, scene_zones
from helpers.made import corridor_scene, grid_scene

NO_BUMPS = np.empty((0, 2), np.int64)


def bare_corridor() -> Scene:
    return replace(corridor_scene(5), top_view=None)


def colour_at(image: Image.Image, share_x: float, share_y: float) -> np.ndarray:
    return np.asarray(image)[round(share_y * image.height), round(share_x * image.width)].astype(int)


def close(colour: np.ndarray, name: str) -> bool:
    return bool(np.abs(colour - ImageColor.getrgb(name)).max() <= 12)


def test_the_frame_shows_view_target_and_map() -> None:
    scene = replace(grid_scene(0), observations=np.repeat(np.arange(120, dtype=np.uint8), 12 * 16 * 3))
    scene = replace(scene, observations=np.resize(scene.observations, (scene.state_count, 12, 16, 3)))
    env = ImageGoalEnv(scene, render_mode="rgb_array")
    _, info = env.reset(seed=0)
    frame = env.render()
    assert frame.dtype == np.uint8 and frame.ndim == 3 and frame.shape[2] == 3
    assert (frame[200, 20] == scene.observations[info["state"], 0, 0]).all()
    assert (frame[200, 520] == scene.observations[info["target"], 0, 0]).all()
    env.step(Action.TURN_RIGHT)
    assert not np.array_equal(env.render(), frame)


def test_a_frame_without_pictures_keeps_its_size() -> None:
    scene = grid_scene(0)
    shapes = set()
    for shown in (scene, replace(scene, observations=None), replace(scene, top_view=None)):
        env = ImageGoalEnv(shown, render_mode="rgb_array")
        env.reset(seed=0)
        shapes.add(env.render().shape)
    assert len(shapes) == 1


def test_the_map_colours_each_heading_by_its_zone() -> None:
    """Five cells along +z, upwards on the map. The agent is in the lowest cell, the target in the second lowest."""
    scene = bare_corridor()
    image = FloorMap(scene, scene_zones(scene), (300, 600)).draw(np.array([0]), NO_BUMPS, 4)
    cell = image.height / 6  # five steps between the outermost cells' centres and the margins, a cell each
    middle_x, third_y = 0.5, (image.height - 3 * cell) / image.height
    up = cell * 0.3 / image.height
    assert close(colour_at(image, middle_x, third_y - up), colours.ZONE_COLOURS["free"])
    assert close(colour_at(image, middle_x, third_y - cell / image.height - up), colours.ZONE_COLOURS["precollision"])
    sideways = np.asarray(image)[:, round(image.width / 2 + 0.3 * cell)]
    reddish = (sideways[:, 0].astype(int) - sideways[:, 2] > 60).mean()
    assert reddish > 0.6  # looking across the corridor is the collision zone in every cell
    assert close(colour_at(image, 0.02, 0.5), colours.WALL)


def test_the_map_shows_agent_target_path_and_bump() -> None:
    scene = bare_corridor()
    floor = FloorMap(scene, scene_zones(scene), (300, 600))

    def pixels(image: Image.Image, colour: str) -> np.ndarray:
        """Rows where a colour is seen, as heights above the lower edge in cells."""
        seen = (np.abs(np.asarray(image).astype(int) - ImageColor.getrgb(colour)).max(axis=2) < 12).any(axis=1)
        return (image.height - np.flatnonzero(seen)) / (image.height / 6)

    image = floor.draw(np.array([0, 4, 8]), np.array([[0, Action.MOVE_BACKWARD]]), 16)
    assert pixels(image, colours.AGENT).mean() == pytest.approx(3.0, abs=0.2)  # cell 2: a margin and two steps
    assert pixels(image, colours.TARGET).mean() == pytest.approx(5.1, abs=0.3)  # cell 4 and the dart ahead of it
    path = pixels(image, colours.PATH)
    assert (path.min() < 1.1) and (path.max() > 2.2)
    assert np.median(pixels(image, colours.BUMP)) == pytest.approx(0.5, abs=0.1)  # at the lower edge of cell 0
    assert pixels(floor.draw(np.array([8]), NO_BUMPS, 16), colours.BUMP).size == 0


def test_the_collision_zone_is_told_apart_without_hue() -> None:
    def luminance(name: str) -> float:
        return float(np.dot(ImageColor.getrgb(colours.ZONE_COLOURS[name]), [0.2126, 0.7152, 0.0722]))

    assert luminance("collision") + 60 < luminance("precollision") < luminance("free") - 30


def test_text() -> None:
    env = ImageGoalEnv(corridor_scene(5), targets={"corridor": [16]}, render_mode="ansi")
    env.reset(options={"start": 0})
    assert env.render() == "step 0  ·  0 collisions  ·  4 steps to go  ·  collision zone\nT\n!\n!\n!\n↑"
    env.step(Action.MOVE_BACKWARD)
    env.step(Action.TURN_RIGHT)
    assert env.render().startswith("step 2  ·  1 collision  ·  5 steps to go")
    assert env.render().endswith("→")
    env.reset(options={"start": 12})
    env.step(Action.MOVE_FORWARD)
    assert "step 1  ·  0 collisions  ·  at the target" in env.render()


def test_text_where_no_way_leads_to_the_target() -> None:
    scene = corridor_scene(5)
    graph = scene.graph.copy()
    graph[16:] = np.where(graph[16:] < 16, BLOCKED, graph[16:])  # the last cell can be entered, not left
    env = ImageGoalEnv(replace(scene, graph=graph), targets={"corridor": [0]}, render_mode="ansi")
    env.reset(options={"start": 12})
    env.step(Action.MOVE_FORWARD)
    assert "no way to the target" in env.render()


def test_a_batch_renders_each_environment() -> None:
    envs = ImageGoalVectorEnv(grid_scene(0), num_envs=3, render_mode="rgb_array")
    envs.reset(seed=0)
    frames = envs.render()
    assert len(frames) == 3
    assert not np.array_equal(frames[0], frames[1])


def test_rendering_out_of_turn() -> None:
    with pytest.raises(ResetNeeded, match="before the first reset"):
        ImageGoalEnv(grid_scene(0), render_mode="ansi").render()
    env = ImageGoalEnv(grid_scene(0))
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None


def test_the_record_keeps_the_episodes_in_progress_alone() -> None:
    record = EpisodeRecord(2)
    record.begin(np.array([0, 1]), np.array([10, 20]))
    record.add(np.array([11, 20]), np.array([0, 3]), np.array([False, True]))
    record.add(np.array([12, 21]), np.array([0, 1]), np.array([False, False]))
    record.begin(np.array([0]), np.array([15, 21]))
    assert record.episode(0).states.tolist() == [15]
    assert record.episode(1).states.tolist() == [20, 20, 21]
    assert record.episode(1).bumps.tolist() == [[20, 3]]
    for step in range(50):
        record.add(np.array([15, 21]), np.array([1, 1]), np.array([False, False]))
        record.begin(np.array([step % 2]), np.array([15, 21]))
    assert len(record._rows) == 2
    assert record.episode(0).states.tolist() == [15, 15]


def test_the_record_of_an_env_agrees_with_its_infos() -> None:
    envs = ImageGoalVectorEnv(grid_scene(1), num_envs=4, max_episode_steps=9, render_mode="ansi")
    _, info = envs.reset(seed=0)
    paths = [[int(state)] for state in info["state"]]
    resting = np.zeros(4, bool)
    for action in np.random.default_rng(0).integers(4, size=(50, 4)):
        _, _, terminated, truncated, info = envs.step(action)
        paths = [
            [int(state)] if rests else [*path, int(state)]
            for path, state, rests in zip(paths, info["state"], resting, strict=True)
        ]
        resting = terminated | truncated
        assert [envs._record.episode(env).states.tolist() for env in range(4)] == paths


def test_zone_colours_cover_the_zones() -> None:
    assert list(colours.ZONE_COLOURS) == [zone.name.lower() for zone in Zone]
