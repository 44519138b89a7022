"""The offline iTHOR data of SAVN (Wortsman et al., CVPR 2019) and of all who build on it.

A folder a scene: `graph.json`, a node-link graph of poses "x|z|rotation|horizon" on a 0.25 m grid with 8 headings and
several camera pitches, where a link is a free step; `images.hdf5`, a picture a pose; and features in files of the same
layout, of which `resnet50_fc.hdf5` is taken where it is there.

What is kept: level camera, four headings, and of the grid every `step_m`; a longer step is free where all the short
ones are. A move backward is free where the same step is free for an agent that looks the other way.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np

from clearway.errors import SceneError
from clearway.importers.json_files import read_json
from clearway.scenes import hdf5
from clearway.scenes.actions import ACTION_COUNT, BLOCKED, Action
from clearway.scenes.file_pictures import file_stamp
from clearway.scenes.grid import HEADING_COUNT, HEADING_STEPS
from clearway.scenes.memory_limits import array_limit
from clearway.scenes.scene import EncoderRecord, Observations, Provenance, Scene
from clearway.scenes.validate import MAX_COORDINATE_M, MAX_FEATURES, MAX_STATES, check_scene
from clearway.version import __version__

SOURCE = "savn"
GRAPH, PICTURES, FEATURES = "graph.json", "images.hdf5", "resnet50_fc.hdf5"
GRID_M = 0.25
GET_WHOLE = "Give a folder of the SAVN data, for example FloorPlan1_physics"

Pose = tuple[int, int, int]
"""Column and row on the 0.25 m grid, and heading / 90."""


@dataclass(frozen=True)
class NamedPictures:
    """Pictures (S, height, width, 3) uint8 that lie in an HDF5 file as a dataset each, read when they are looked at.

    Attributes:
        path: the file.
        names: S datasets.
        shape: (S, height, width, 3).
        stamp: what the file was like when the scene was read, see `file_stamp`.
    """

    path: Path
    names: tuple[str, ...]
    shape: tuple[int, ...]
    stamp: tuple[int | str, ...]

    def __getitem__(self, index: int | slice | np.ndarray) -> np.ndarray:
        """The pictures asked for.

        Raises:
            SceneError: the file is gone, damaged, or another than when the scene was read.
        """
        wanted = np.arange(self.shape[0])[index]
        if file_stamp(self.path) != self.stamp:
            raise SceneError(self.path, "has changed since the scene was read", "Read the scene again")
        pictures = np.empty((wanted.size, *self.shape[1:]), np.uint8)
        with hdf5.opened(self.path) as file:
            for place, state in enumerate(wanted.reshape(-1).tolist()):
                dataset = hdf5.need_dataset(file, self.names[state], self.path)
                hdf5.check_layout(dataset, self.path, shape=self.shape[1:], kinds="u")
                pictures[place] = hdf5.read_values(dataset, self.path)
        return pictures.reshape(*wanted.shape, *self.shape[1:])


def read_savn(folder: Path, *, step_m: float = 0.5, name: str | None = None) -> Scene:
    """A folder of the data as a scene, with the features of `resnet50_fc.hdf5` where it is there.

    Args:
        folder: of one scene.
        step_m: length of a move, a multiple of 0.25.
        name: of the scene; the folder's where it is not given.

    Raises:
        SceneError: a file is missing or damaged, or no location has all headings.
    """
    stride = round(step_m / GRID_M)
    if stride < 1 or not math.isclose(stride * GRID_M, step_m):
        raise SceneError(folder, f"a step of {step_m} m", f"Give a multiple of {GRID_M}")
    keys, links = _poses_and_links(folder / GRAPH)
    cells = _kept_cells(keys, stride, folder / GRAPH)
    names = tuple(keys[column, row, heading] for column, row in cells for heading in range(HEADING_COUNT))
    features, encoder = _features(folder / FEATURES, names)
    pictures = _pictures(folder / PICTURES, names)
    if pictures is None and features is None:
        raise SceneError(folder, f"has neither {PICTURES} nor {FEATURES}", GET_WHOLE)
    scene = Scene(
        name=name or folder.resolve().name,
        observations=pictures,
        features=features,
        locations_m=np.repeat(np.array(cells) * GRID_M, HEADING_COUNT, axis=0),
        headings_deg=np.tile(np.arange(HEADING_COUNT) * 90, len(cells)),
        graph=_graph(cells, links, stride),
        made_by=Provenance(SOURCE, versions={"clearway": __version__}, notes={"step_m": step_m}),
        encoder=encoder,
        cell_size_m=step_m,
    )
    check_scene(scene, folder)
    return scene


def _poses_and_links(path: Path) -> tuple[dict[Pose, str], set[tuple[Pose, Pose]]]:
    """Level poses with four headings, by their keys in the files, and the free steps between them."""
    content = read_json(path)
    try:
        nodes = [str(node["id"]) for node in content["nodes"]]
        ends = [(str(link["source"]), str(link["target"])) for link in content["links"]]
    except (KeyError, TypeError) as fault:
        raise SceneError(path, f"is no node-link graph ({fault!r})", GET_WHOLE) from fault
    poses: dict[str, Pose] = {}
    for key in nodes:
        pose = _pose(key, path)
        if pose is not None:
            poses[key] = pose
    links = {(poses[near], poses[far]) for near, far in ends if near in poses and far in poses}
    return {pose: key for key, pose in poses.items()}, links


def _pose(key: str, path: Path) -> Pose | None:
    """The pose of a key; None where the camera is not level or the heading no multiple of 90 degrees."""
    try:
        x, z, heading_deg, horizon_deg = (float(part) for part in key.split("|"))
        if max(abs(x), abs(z)) > MAX_COORDINATE_M:
            raise ValueError("too far away")
        column, row = round(x / GRID_M), round(z / GRID_M)
    except (ValueError, OverflowError) as fault:
        raise SceneError(path, f"holds the pose {key[:60]!r}, expected x|z|rotation|horizon", GET_WHOLE) from fault
    if horizon_deg != 0 or heading_deg % 90 != 0:
        return None
    return column, row, int(heading_deg // 90) % HEADING_COUNT


def _kept_cells(keys: dict[Pose, str], stride: int, path: Path) -> list[tuple[int, int]]:
    """Cells with all headings, every so many columns and rows: of the ways to begin the one that keeps the most."""
    headings = Counter((column, row) for column, row, _ in keys)
    whole = [cell for cell, count in headings.items() if count == HEADING_COUNT]
    if not whole:
        raise SceneError(path, "no location has all four headings with a level camera", GET_WHOLE)
    begins = Counter((column % stride, row % stride) for column, row in whole)
    begin = max(sorted(begins), key=lambda key: begins[key])
    cells = sorted(cell for cell in whole if (cell[0] % stride, cell[1] % stride) == begin)
    if len(cells) * HEADING_COUNT > MAX_STATES:
        problem = f"has {len(cells) * HEADING_COUNT} poses, expected up to {MAX_STATES}"
        raise SceneError(path, problem, "Give a longer step")
    return cells


def _graph(cells: list[tuple[int, int]], links: set[tuple[Pose, Pose]], stride: int) -> np.ndarray:
    """(4 C, A) int32; state 4 c + h is cell c at 90 h degrees."""
    number = {cell: index for index, cell in enumerate(cells)}
    graph = np.full((len(cells) * HEADING_COUNT, ACTION_COUNT), BLOCKED, np.int32)
    for (column, row), index in number.items():
        for heading, (right, up) in enumerate(HEADING_STEPS):
            state = HEADING_COUNT * index + heading
            graph[state, Action.TURN_RIGHT] = HEADING_COUNT * index + (heading + 1) % HEADING_COUNT
            graph[state, Action.TURN_LEFT] = HEADING_COUNT * index + (heading - 1) % HEADING_COUNT
            end = number.get((column + stride * right, row + stride * up))
            if end is not None and _free(column, row, heading, stride, links):
                graph[state, Action.MOVE_FORWARD] = HEADING_COUNT * end + heading
                opposite = (heading + 2) % HEADING_COUNT
                graph[HEADING_COUNT * index + opposite, Action.MOVE_BACKWARD] = HEADING_COUNT * end + opposite
    return graph


def _free(column: int, row: int, heading: int, stride: int, links: set[tuple[Pose, Pose]]) -> bool:
    """All short steps ahead are free."""
    right, up = HEADING_STEPS[heading]
    way = [(column + k * right, row + k * up, heading) for k in range(stride + 1)]
    return all(step in links for step in pairwise(way))


def _features(path: Path, names: tuple[str, ...]) -> tuple[np.ndarray | None, EncoderRecord | None]:
    """(S, F) float32 and what made them; None without the file."""
    if not path.exists():
        return None, None
    with hdf5.opened(path) as file:
        rows, left = [], array_limit(path)
        for name in names:
            rows.append(_feature(file, name, path))
            left -= rows[-1].nbytes
            if left < 0:
                raise SceneError(path, "its features would take too much memory for its size", "Get another copy", name)
    if len({len(row) for row in rows}) > 1:
        raise SceneError(path, "holds features of different lengths", "Get another copy")
    count = len(rows[0])
    return np.stack(rows), EncoderRecord(f"{path.stem} of SAVN ({count} features)", f"savn-{path.stem}-{count}")


def _feature(file: h5py.File, name: str, path: Path) -> np.ndarray:
    dataset = hdf5.need_dataset(file, name, path)
    shape: tuple[int | None, ...] = (None,) * len(dataset.shape or (0,))
    hdf5.check_layout(dataset, path, shape=shape, kinds="f", limit=MAX_FEATURES * 8)
    return np.asarray(hdf5.read_values(dataset, path), np.float32).reshape(-1)


def _pictures(path: Path, names: tuple[str, ...]) -> Observations | None:
    if not path.exists():
        return None
    with hdf5.opened(path) as file:
        shapes = {tuple(shape) for shape in _picture_shapes(file, names, path)}
    if len(shapes) > 1:
        raise SceneError(path, "holds pictures of different sizes", "Get another copy")
    return NamedPictures(path.resolve(), names, (len(names), *shapes.pop()), file_stamp(path.resolve()))


def _picture_shapes(file: h5py.File, names: tuple[str, ...], path: Path) -> Iterator[tuple[int, ...]]:
    for name in names:
        dataset = hdf5.need_dataset(file, name, path)
        hdf5.check_layout(dataset, path, shape=(None, None, 3), kinds="u")
        if dataset.dtype != np.uint8:
            raise SceneError(path, f"holds {dataset.dtype}, expected uint8", "Get another copy", name)
        yield dataset.shape
