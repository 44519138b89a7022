import json
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.importers.savn import read_savn
from clearway.scenes.actions import Action
from clearway.scenes.thor_v1 import read_scene, write_scene
from clearway.scenes.validate import pose_quirks
from helpers.made import graph_of_cells

GRID_M = 0.25
AHEAD = {0: (0, 1), 45: (1, 1), 90: (1, 0), 135: (1, -1), 180: (0, -1), 225: (-1, -1), 270: (-1, 0), 315: (-1, 1)}
ROOM = [(x, z) for x in range(-2, 4) for z in range(5)]  # 6 x 5 locations, 0.25 m apart


def key(x: int, z: int, heading: int, horizon: int) -> str:
    return f"{x * GRID_M:0.2f}|{z * GRID_M:0.2f}|{heading}|{horizon}"


def picture(x: int, z: int, heading: int) -> np.ndarray:
    return np.full((6, 8, 3), (10 * x + 50, 10 * z, heading // 2), np.uint8)


def made_folder(
    folder: Path, cells: list[tuple[int, int]], *, blocked: set[tuple] = frozenset(), features: bool = True
) -> Path:
    """The data of a room; `blocked` holds (cell, heading) of steps that are not free."""
    folder.mkdir(parents=True)
    poses = [(x, z, heading, horizon) for x, z in cells for heading in AHEAD for horizon in (0, 30)]
    links = []
    for x, z, heading, horizon in poses:
        dx, dz = AHEAD[heading]
        if (x + dx, z + dz) in cells and ((x, z), heading) not in blocked:
            ends = key(x, z, heading, horizon), key(x + dx, z + dz, heading, horizon)
            links.append({"source": ends[0], "target": ends[1]})
        links.append({"source": key(x, z, heading, horizon), "target": key(x, z, (heading + 45) % 360, horizon)})
    graph = {"directed": True, "graph": {}, "nodes": [{"id": key(*pose)} for pose in poses], "links": links}
    (folder / "graph.json").write_text(json.dumps(graph))
    with h5py.File(folder / "images.hdf5", "w") as file:
        for x, z, heading, horizon in poses:
            file[key(x, z, heading, horizon)] = picture(x, z, heading)
    if features:
        with h5py.File(folder / "resnet50_fc.hdf5", "w") as file:
            for x, z, heading, horizon in poses:
                file[key(x, z, heading, horizon)] = np.array([x, z, heading, horizon, 0.5], np.float32)
    return folder


def test_half_metre_steps_keep_every_second_location(tmp_path: Path) -> None:
    scene = read_savn(made_folder(tmp_path / "FloorPlan1_physics", ROOM))
    assert scene.name == "FloorPlan1_physics"
    assert pose_quirks(scene) == []
    kept = np.unique(scene.locations_m, axis=0)
    np.testing.assert_allclose(kept, [[x, z] for x in (-0.5, 0.0, 0.5) for z in (0.0, 0.5, 1.0)])
    np.testing.assert_array_equal(scene.graph, graph_of_cells(np.array([[x, z] for x in range(3) for z in range(3)])))
    assert scene.cell_size_m == 0.5


def test_pictures_and_features_are_those_of_the_level_pose(tmp_path: Path) -> None:
    scene = read_savn(made_folder(tmp_path / "room", ROOM))
    for state in (0, 5, 30):
        (x_m, z_m), heading = scene.locations_m[state], int(scene.headings_deg[state])
        x, z = round(x_m / GRID_M), round(z_m / GRID_M)
        np.testing.assert_array_equal(scene.observations[state], picture(x, z, heading))
        np.testing.assert_array_equal(scene.features[state], [x, z, heading, 0, 0.5])
    assert scene.observations[np.array([3, 1, 3])].shape == (3, 6, 8, 3)
    assert scene.encoder.name == "resnet50_fc of SAVN (5 features)"
    write_scene(scene, tmp_path / "room.h5")
    np.testing.assert_array_equal(read_scene(tmp_path / "room.h5").observations[:], scene.observations[:])


def test_the_data_s_own_steps_can_be_kept(tmp_path: Path) -> None:
    scene = read_savn(made_folder(tmp_path / "room", ROOM), step_m=0.25)
    assert scene.cell_count == len(ROOM)
    np.testing.assert_array_equal(scene.graph, graph_of_cells(np.array(sorted(ROOM))))


def test_a_long_step_is_blocked_where_either_short_one_is(tmp_path: Path) -> None:
    """From (0, 0) along +z the second quarter is blocked, and only in that direction."""
    cells = [(0, z) for z in range(3)]
    scene = read_savn(made_folder(tmp_path / "room", cells, blocked={((0, 1), 0)}))
    assert scene.cell_count == 2
    north, south = 0, 2
    assert scene.graph[north, Action.MOVE_FORWARD] == -1
    assert scene.graph[south, Action.MOVE_BACKWARD] == -1  # the same step, looking back
    assert scene.graph[4 + south, Action.MOVE_FORWARD] == south
    assert scene.graph[4 + north, Action.MOVE_BACKWARD] == north


def test_without_features_there_are_none(tmp_path: Path) -> None:
    scene = read_savn(made_folder(tmp_path / "room", ROOM, features=False))
    assert scene.features is None and scene.encoder is None


def test_locations_that_lack_a_heading_are_left_out(tmp_path: Path) -> None:
    folder = made_folder(tmp_path / "room", ROOM)
    graph = json.loads((folder / "graph.json").read_text())
    graph["nodes"] = [node for node in graph["nodes"] if node["id"] != key(0, 2, 90, 0)]
    (folder / "graph.json").write_text(json.dumps(graph))
    scene = read_savn(folder, step_m=0.25)
    assert scene.cell_count == len(ROOM) - 1
    assert [0.0, 0.5] not in scene.locations_m.tolist()
    assert read_savn(folder).cell_count == 9  # half-metre steps begin where no location is lost


def remove(name: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).unlink()


def write(name: str, text: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).write_text(text)


def without_sources(folder: Path) -> None:
    remove("images.hdf5")(folder)
    remove("resnet50_fc.hdf5")(folder)


def lack_a_picture(folder: Path) -> None:
    with h5py.File(folder / "images.hdf5", "r+") as file:
        del file[key(0, 2, 90, 0)]


def link_a_picture(folder: Path) -> None:
    with h5py.File(folder / "images.hdf5", "r+") as file:
        del file[key(0, 2, 90, 0)]
        file[key(0, 2, 90, 0)] = h5py.ExternalLink("/etc/hostname", "/x")


def widen_a_picture(folder: Path) -> None:
    with h5py.File(folder / "images.hdf5", "r+") as file:
        del file[key(0, 2, 90, 0)]
        file[key(0, 2, 90, 0)] = np.zeros((6, 9, 3), np.uint8)


def lengthen_a_feature(folder: Path) -> None:
    with h5py.File(folder / "resnet50_fc.hdf5", "r+") as file:
        del file[key(0, 2, 90, 0)]
        file[key(0, 2, 90, 0)] = np.zeros(7, np.float32)


def spoil_a_feature(folder: Path) -> None:
    with h5py.File(folder / "resnet50_fc.hdf5", "r+") as file:
        file[key(0, 2, 90, 0)][2] = np.nan


def claim_much(folder: Path) -> None:
    with h5py.File(folder / "resnet50_fc.hdf5", "r+") as file:
        del file[key(0, 2, 90, 0)]
        file.create_dataset(key(0, 2, 90, 0), shape=(2**40,), dtype="f4", chunks=(1024,))


@pytest.mark.parametrize(
    ("damage", "parts"),
    [
        (remove("graph.json"), ("graph.json", "no such file")),
        (write("graph.json", "{"), ("graph.json", "cannot be read as JSON")),
        (write("graph.json", "[" * 100_000), ("graph.json", "cannot be read as JSON")),
        (write("graph.json", "[]"), ("graph.json", "no node-link graph")),
        (write("graph.json", '{"nodes": [{"id": "1|2"}], "links": []}'), ("graph.json", "'1|2'")),
        (write("graph.json", '{"nodes": [{"id": "1|inf|0|0"}], "links": []}'), ("graph.json", "1|inf|0|0")),
        (write("graph.json", '{"nodes": [], "links": []}'), ("graph.json", "no location has all four")),
        (without_sources, ("neither images.hdf5 nor resnet50_fc.hdf5",)),
        (write("images.hdf5", "no"), ("images.hdf5", "not an HDF5 file")),
        (lack_a_picture, ("images.hdf5", "0.00|0.50|90|0", "missing")),
        (link_a_picture, ("images.hdf5", "is a link")),
        (widen_a_picture, ("images.hdf5", "different sizes")),
        (lengthen_a_feature, ("resnet50_fc.hdf5", "different lengths")),
        (spoil_a_feature, ("NaN or Inf",)),
        (claim_much, ("resnet50_fc.hdf5", "more than the limit")),
    ],
)
def test_what_is_broken_is_named(damage: Callable, parts: tuple[str, ...], tmp_path: Path) -> None:
    folder = made_folder(tmp_path / "room", ROOM)
    damage(folder)
    with pytest.raises(SceneError) as caught:
        read_savn(folder)
    for part in parts:
        assert part in str(caught.value)


@pytest.mark.parametrize("step_m", [0.0, 0.3, -0.5])
def test_a_step_is_a_multiple_of_the_grid(step_m: float, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"multiple of 0\.25"):
        read_savn(made_folder(tmp_path / "room", ROOM), step_m=step_m)
