"""Shards: HDF5 files with the views of one room, written whole or not at all, every part under a checksum.

`rgb` (N, height, width, 3) uint8; `sensors/depth` and the like as in scene files; `table` (N, columns) float64 with
what is known of each picture (`table.COLUMNS`); and as attributes what the file is, of which room, and its settings.
A few pictures make a chunk, so that neighbours are read fast.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import h5py
import numpy as np

from clearway.errors import ArgumentError, SceneError
from clearway.remote.address import file_bytes
from clearway.rooms.camera import VERTICAL_FOV_DEG
from clearway.scenes import hdf5
from clearway.scenes.file_pictures import FilePictures, file_stamp
from clearway.scenes.memory_limits import array_limit, memory_limit
from clearway.scenes.records import SENSORS, read_readings, write_sensor
from clearway.scenes.scene import Scene
from clearway.scenes.sensors import RGB, Readings, Sensor
from clearway.scenes.storage import check_written
from clearway.version import __version__
from clearway.views.settings import ViewSettings, settings_of
from clearway.views.table import COLUMNS, WHOLE, ViewTable, table_of
from clearway.views.take import RoomViews

FORMAT = "clearway views"
FORMAT_VERSION = 2
TABLE = "table"
CHUNK_BYTES = 512 * 1024
LARGEST = 1e6  # of what the table holds
COMPRESSION = {"compression": "lzf", "shuffle": True}  # half the size, and some five times as long to read


@dataclass(frozen=True, eq=False)
class Shard:
    """A shard; pictures and table stay in the file until they are looked at.

    Attributes:
        path: the file.
        room: name of the scene whose room it shows.
        room_key: of that scene, see `room_key`.
        settings: which pictures of it these are.
        rgb: (N, height, width, 3) uint8.
        further: what other sensors measured.
    """

    path: Path
    room: str
    room_key: str
    settings: ViewSettings
    rgb: FilePictures
    further: tuple[Readings, ...]

    def __len__(self) -> int:
        """N."""
        return self.rgb.shape[0]

    @property
    def takes(self) -> int:
        """Pictures of a pose."""
        return self.settings.takes

    @property
    def sensors(self) -> tuple[Sensor, ...]:
        """What took the pictures, colour first."""
        return self.settings.all_sensors

    @cached_property
    def table(self) -> ViewTable:
        """What is known of the pictures. Raises SceneError where the file is gone, damaged, or another than before."""
        values = FilePictures(self.path, TABLE, (len(self), len(COLUMNS)), self.rgb.stamp, "float64")[:]
        whole = values[:, [COLUMNS.index(name) for name in WHOLE]]
        if not (np.abs(values) <= LARGEST).all() or (whole != np.rint(whole)).any() or (whole < 0).any():
            raise SceneError(self.path, "holds something else than numbers of poses", hdf5.MAKE_AGAIN, TABLE)
        return table_of(values)

    def seen(self, name: str, rows: slice | np.ndarray) -> np.ndarray:
        """Some pictures of a sensor as they are kept (`Sensor.kept`).

        Raises:
            SceneError: as of `table`, or a value is out of the sensor's range.
        """
        if name == RGB:
            return self.rgb[rows]
        return next(readings for readings in self.further if readings.sensor.name == name).checked(rows)


def room_key(scene: Scene) -> str:
    """A hash of what a room is: its poses, the moves between them, and what made it."""
    digest = hashlib.sha256()
    made = {key: value for key, value in scene.made_by.to_json().items() if key != "versions"}
    digest.update(json.dumps([scene.name, scene.cell_size_m, made], sort_keys=True, default=str).encode())
    for array in (scene.graph, scene.locations_m, scene.headings_deg):
        digest.update(str((array.shape, array.dtype.str)).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:16]


def write_shard(path: Path, scene: Scene, settings: ViewSettings, views: RoomViews) -> None:
    """Write the views of a scene's room, whole or not at all. Raises SceneError where the file cannot be written."""
    with hdf5.written(path) as file:
        hdf5.write_text(file, "format", FORMAT)
        file.attrs["format_version"] = FORMAT_VERSION
        hdf5.write_text(file, "clearway_version", __version__)
        hdf5.write_text(file, "room", json.dumps({"name": scene.name, "key": room_key(scene)}))
        hdf5.write_text(file, "made_by", json.dumps(scene.made_by.to_json()))
        hdf5.write_text(file, "settings", json.dumps(settings.to_json()))
        file.attrs["vertical_fov_deg"] = VERTICAL_FOV_DEG
        table = hdf5.write_array(file, TABLE, views.table.to_array())
        hdf5.write_text(table, "columns", json.dumps(COLUMNS))
        _write_pictures(file, RGB, views.rgb, settings.compress)
        for readings in views.further:
            name, kept = readings.sensor.name, readings.checked(slice(None))
            write_sensor(_write_pictures(file, f"{SENSORS}/{name}", kept, settings.compress), readings.sensor)


def _write_pictures(file: h5py.File, name: str, pictures: np.ndarray, compress: bool) -> h5py.Dataset:
    chunks = (max(1, min(len(pictures), CHUNK_BYTES // pictures[0].nbytes)), *pictures.shape[1:])
    packing = COMPRESSION if compress else {}
    return file.create_dataset(name, data=pictures, chunks=chunks, fletcher32=True, **packing)


def is_shard(path: Path) -> bool:
    """Whether a file says that it is a shard. Raises SceneError where it is no HDF5 file."""
    with hdf5.opened(path) as file:
        return hdf5.read_attribute(file, "format", path) == FORMAT


def read_shard(path: Path) -> Shard:
    """The shard in a file, whose pictures and table stay there.

    Raises:
        SceneError: the file is no shard, of a newer format, cut short, or says of itself what cannot be.
    """
    with hdf5.opened(path) as file:
        if hdf5.read_attribute(file, "format", path) != FORMAT:
            raise SceneError(path, "holds no views", "Give a file that clearway scenes views made")
        version = hdf5.read_number(file, "format_version", path, 1, 1e9)
        if version != FORMAT_VERSION:
            problem = f"has version {version} of the format, this clearway ({__version__}) reads {FORMAT_VERSION}"
            raise SceneError(path, problem, "Take them again, or use the clearway that made them")
        room, record = (hdf5.read_record(file, name, path) or {} for name in ("room", "settings"))
        settings = _settings(record, path)
        count = settings.picture_count
        limit = memory_limit(file_bytes(path))
        for name in (RGB, TABLE):
            if (dataset := hdf5.find_dataset(file, name, path)) is None:
                raise SceneError(path, "is missing", "Give a whole file of clearway scenes views", name)
            with hdf5.faults_named(path, name, "is damaged"):
                check_written(dataset)
        colour = settings.all_sensors[0]
        hdf5.check_layout(file[RGB], path, shape=(count, *colour.shape), kinds="u", limit=limit)
        if file[RGB].dtype != np.uint8:
            raise SceneError(path, f"holds {file[RGB].dtype}, expected uint8", hdf5.MAKE_AGAIN, RGB)
        hdf5.check_layout(file[TABLE], path, shape=(count, len(COLUMNS)), kinds="f", limit=array_limit(path))
        further = read_readings(file, path, count)
    found = {colour, *(readings.sensor for readings in further)}
    if found != set(settings.all_sensors):
        shown = ", ".join(sorted(sensor.described() for sensor in found))
        raise SceneError(path, f"has other sensors than its settings say: {shown}", hdf5.MAKE_AGAIN)
    if {"name", "key"} != set(room) or not all(isinstance(text, str) for text in room.values()):
        raise SceneError(path, "does not say which room it shows", hdf5.MAKE_AGAIN)
    rgb = FilePictures(path.resolve(), RGB, (count, *colour.shape), file_stamp(path.resolve()))
    return Shard(path, str(room["name"]), str(room["key"]), settings, rgb, further)


def _settings(record: Mapping[str, object], path: Path) -> ViewSettings:
    try:
        return settings_of(record)
    except ArgumentError as fault:
        raise SceneError(path, f"attribute 'settings': {str(fault).rpartition('. ')[0]}", hdf5.MAKE_AGAIN) from fault
