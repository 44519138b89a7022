"""Scene files: reads the published `thor_v1` HDF5 dumps and writes files that their loaders read.

Published: `observation` (S, height, width, 3) uint8, `resnet_feature` (S, 10 or 1, F) of which index 0 is
read, `location` (S, 2) metres, `rotation` (S,) degrees, `graph` (S, 4), `shortest_path_distance` (S, S).
Ours have besides: checksums and compression, attributes (format version, cell size, what made the scene,
which encoder made the features), the group `encoder` with its statistics, `top_view`, and the group `sensors` with what
sensors besides the colour camera saw, for example `sensors/depth` (S, height, width) in whole millimetres.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import h5py
import numpy as np

from clearway.errors import SceneError
from clearway.scenes import hdf5
from clearway.scenes.actions import ACTION_COUNT, BLOCKED, Action
from clearway.scenes.features import DATASET as FEATURES
from clearway.scenes.features import FileFeatures, find_features, read_features
from clearway.scenes.file_pictures import BLOCK_PICTURES, FilePictures, file_stamp
from clearway.scenes.parts import check_records
from clearway.scenes.records import (
    read_encoder,
    read_provenance,
    read_readings,
    read_top_view,
    write_encoder,
    write_provenance,
    write_readings,
    write_top_view,
)
from clearway.scenes.scene import Features, Observations, Scene
from clearway.scenes.validate import (
    MAX_COORDINATE_M,
    MAX_STATES,
    MIN_CELL_SIZE_M,
    SceneWarning,
    check_graph,
    check_poses,
    check_scene,
    pose_quirks,
)
from clearway.version import __version__

FORMAT_VERSION = 1
DISTANCE_TABLE_STATES = 4_096  # beyond it the (S, S) table is neither written nor checked; nothing here reads it
DEFAULT_CELL_SIZE_M = 0.5
PICTURE_GZIP_LEVEL = 2  # 0.42 of the raw size in 8 ms a 400x300 picture; level 4 saves 2 % more, lzf needs 0.58


def read_scene(path: str | Path, *, name: str | None = None, features_in_file: bool = False) -> Scene:
    """The scene in a `thor_v1` file; its pictures stay in the file until they are looked at.

    Args:
        path: the HDF5 file.
        name: name of the scene; the file's stem where it is not given.
        features_in_file: for large sets, which this opens in milliseconds a scene: leave features in the file until
            they are looked at, and check them then; do not look at the file's distances, which nothing uses.

    Raises:
        SceneError: the file is not HDF5, damaged, incomplete, inconsistent, too large or of a newer format.

    Warns:
        SceneWarning: locations or headings are odd, or the file's distances disagree with its graph.
    """
    path = Path(path)
    with hdf5.opened(path) as file:
        _check_version(file, path)
        graph = _read_graph(file, path)
        count = len(graph)
        locations_m, headings_deg = _read_locations(file, path, count), _read_headings(file, path, count)
        check_poses(locations_m, headings_deg, count, path)
        features = _find_features(file, path, count, features_in_file)
        scene = Scene(
            name=name or path.stem,
            observations=_find_pictures(file, path, count),
            features=features,
            locations_m=locations_m,
            headings_deg=headings_deg,
            graph=graph,
            made_by=read_provenance(file, path),
            encoder=None if features is None else read_encoder(file, path, features.shape[1]),
            cell_size_m=hdf5.read_number(file, "cell_size_m", path, MIN_CELL_SIZE_M, MAX_COORDINATE_M)
            or step_length_m(locations_m, graph),
            top_view=read_top_view(file, path),
            further=read_readings(file, path, count),
        )
        check_scene(scene, path)
        if scene.observations is None and features is None:
            raise SceneError(path, "has neither pictures nor features", "Give a complete scene file")
        quirks = pose_quirks(scene) + ([] if features_in_file else _distance_quirks(file, path, scene))
    for quirk in quirks:
        warnings.warn(f"{path}: {quirk}", SceneWarning, stacklevel=2)
    return scene


def write_scene(scene: Scene, path: str | Path) -> None:
    """Write a scene as a `thor_v1` file, whole or not at all. Raises SceneError for a scene that is unsound."""
    path = Path(path)
    check_scene(scene, path)
    check_records(scene, path)
    with hdf5.written(path) as file:
        _write_all(file, scene, path)


def step_length_m(locations_m: np.ndarray, graph: np.ndarray) -> float:
    """Length of most forward moves, metres to the millimetre; 0.5 where no move is open."""
    states = np.flatnonzero(graph[:, Action.MOVE_FORWARD] != BLOCKED)
    ahead = graph[states, Action.MOVE_FORWARD]
    lengths_m = np.linalg.norm(locations_m[ahead] - locations_m[states], axis=1)
    typical_m = round(float(np.median(lengths_m)), 3) if len(states) else 0.0
    return typical_m if typical_m > 0 else DEFAULT_CELL_SIZE_M


def _check_version(file: h5py.File, path: Path) -> None:
    version = hdf5.read_number(file, "format_version", path, 1, 1e9) or 1
    if version > FORMAT_VERSION:
        problem = f"has format version {version:g}, this clearway ({__version__}) reads up to {FORMAT_VERSION}"
        raise SceneError(path, problem, "Upgrade clearway")


def _read_graph(file: h5py.File, path: Path) -> np.ndarray:
    """The (S, A) int32 graph; whole floats are accepted."""
    dataset = hdf5.need_dataset(file, "graph", path)
    limit = MAX_STATES * ACTION_COUNT * 8
    hdf5.check_layout(dataset, path, shape=(None, ACTION_COUNT), kinds="iuf", limit=limit)
    values = hdf5.read_values(dataset, path)
    whole = values.dtype.kind != "f" or bool(np.all(values == np.floor(values)))
    if not whole or not np.all((values >= BLOCKED) & (values < len(values))):
        problem = f"holds something else than whole numbers from {BLOCKED} to {len(values) - 1}"
        raise SceneError(path, problem, hdf5.MAKE_AGAIN, "graph")
    graph = values.astype(np.int32)
    check_graph(graph, path)
    return graph


def _read_locations(file: h5py.File, path: Path, count: int) -> np.ndarray:
    dataset = hdf5.need_dataset(file, "location", path)
    hdf5.check_layout(dataset, path, shape=(count, 2), kinds="iuf")
    return hdf5.read_values(dataset, path).astype(np.float64)


def _read_headings(file: h5py.File, path: Path, count: int) -> np.ndarray:
    """Headings, (S,) int64 from 0 to 359; (S, 1) and floats are accepted."""
    dataset = hdf5.need_dataset(file, "rotation", path)
    column = (count, 1) if len(dataset.shape or ()) == 2 else (count,)
    hdf5.check_layout(dataset, path, shape=column, kinds="iuf")
    values = hdf5.read_values(dataset, path).reshape(count).astype(np.float64)
    if not np.all(np.abs(values) <= 360):
        raise SceneError(path, "holds no headings from 0 to 360 degrees", hdf5.MAKE_AGAIN, "rotation")
    return np.round(values).astype(np.int64) % 360


def _find_features(file: h5py.File, path: Path, count: int, in_file: bool) -> Features | None:
    """The features of a file, or where they are to be found in it; None where it has none."""
    dataset = find_features(file, path, count)
    if dataset is None:
        return None
    if in_file:
        return FileFeatures(path.resolve(), (count, dataset.shape[-1]), file_stamp(path.resolve()))
    return read_features(dataset, path)


def _find_pictures(file: h5py.File, path: Path, count: int) -> FilePictures | None:
    dataset = hdf5.find_dataset(file, "observation", path)
    if dataset is None:
        return None
    hdf5.check_layout(dataset, path, shape=(count, None, None, 3), kinds="u")
    if dataset.dtype != np.uint8:
        raise SceneError(path, f"holds {dataset.dtype}, expected uint8", hdf5.MAKE_AGAIN, "observation")
    return FilePictures(path.resolve(), "observation", tuple(dataset.shape), file_stamp(path.resolve()))


def _distance_quirks(file: h5py.File, path: Path, scene: Scene) -> list[str]:
    """One sentence where the file's distances disagree with the graph; unreachable may be -1 or 1000 there."""
    dataset = hdf5.find_dataset(file, "shortest_path_distance", path)
    count = scene.state_count
    if dataset is None or count > DISTANCE_TABLE_STATES:
        return []
    hdf5.check_layout(dataset, path, shape=(count, count), kinds="iuf", limit=hdf5.MAX_ARRAY_BYTES)
    kept, true = hdf5.read_values(dataset, path), scene.distances
    no_path = (true < 0) & ((kept < 0) | (kept >= 1000))
    wrong = np.argwhere((kept != true) & ~no_path)
    if not len(wrong):
        return []
    start, end = wrong[0].tolist()
    example = f"{kept[start, end]} steps from state {start} to {end}, the graph says {true[start, end]}"
    return [f"shortest_path_distance is wrong for {len(wrong)} pairs (first: {example}); it is not used"]


def _write_all(file: h5py.File, scene: Scene, path: Path) -> None:
    file.attrs["format_version"] = FORMAT_VERSION
    hdf5.write_text(file, "clearway_version", __version__)
    file.attrs["cell_size_m"] = scene.cell_size_m
    write_provenance(file, scene.made_by)
    hdf5.write_array(file, "graph", scene.graph.astype(np.int32))
    hdf5.write_array(file, "location", scene.locations_m)
    hdf5.write_array(file, "rotation", scene.headings_deg)
    if scene.state_count <= DISTANCE_TABLE_STATES:
        hdf5.write_array(file, "shortest_path_distance", scene.distances)
    if scene.features is not None:
        hdf5.write_array(file, FEATURES, np.asarray(scene.features, np.float32)[:, None])
    if scene.encoder is not None:
        write_encoder(file, scene.encoder)
    if scene.top_view is not None:
        write_top_view(file, scene.top_view)
    if scene.observations is not None:
        _write_pictures(file, scene.observations, path)
    for readings in scene.further:
        write_readings(file, readings)


def _write_pictures(file: h5py.File, pictures: Observations, path: Path) -> None:
    """Store pictures one a chunk, so that a look at one unpacks one; a block of them is in memory at a time.

    Raises:
        SceneError: they are not uint8, to which HDF5 would round them.
    """
    dataset = file.create_dataset(
        "observation",
        shape=pictures.shape,
        dtype=np.uint8,
        chunks=(1, *pictures.shape[1:]),
        compression="gzip",
        compression_opts=PICTURE_GZIP_LEVEL,
        fletcher32=True,
    )
    for start in range(0, pictures.shape[0], BLOCK_PICTURES):
        block = pictures[start : start + BLOCK_PICTURES]
        if block.dtype != np.uint8:
            raise SceneError(path, f"would hold {block.dtype}, expected uint8", "Give RGB from 0 to 255", "observation")
        dataset[start : start + BLOCK_PICTURES] = block
