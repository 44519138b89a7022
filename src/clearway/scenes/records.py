"""What our scene files hold beyond `thor_v1`: what made the scene, which encoder was used, the view from above, depth.

Each sensor but the colour camera has a dataset in the group `sensors`, with what it is (`Sensor`) as attributes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np

from clearway.errors import SceneError
from clearway.scenes import hdf5
from clearway.scenes.file_pictures import BLOCK_PICTURES, FilePictures, file_stamp
from clearway.scenes.scene import EncoderRecord, Provenance, TopView
from clearway.scenes.sensors import Readings, Sensor
from clearway.scenes.validate import MAX_COORDINATE_M, MAX_PICTURE_SIDE, check_sensor

TOP_VIEW_EXTENT = ("x_min_m", "x_max_m", "z_min_m", "z_max_m")
FILE_ENCODER = "from file"
SENSORS = "sensors"
SENSOR_NUMBERS = ("low", "high", "step")
LARGEST = 1e9  # of a sensor's values
SENSOR_GZIP_LEVEL = 2  # as of pictures; a room's depth takes 0.02 of its raw size, 6 kB a picture of 400x300


def read_provenance(file: h5py.File, path: Path) -> Provenance:
    """What made the scene; for a file that does not say, the format's name."""
    kept = hdf5.read_record(file, "made_by", path)
    if kept is None:
        return Provenance("thor_v1")
    room, seed = kept.get("room"), kept.get("seed")
    return Provenance(
        source=_kept_text(kept, "source", path, "made_by"),
        room=None if room is None else str(room),
        seed=seed if isinstance(seed, int) else None,
        versions={key: str(value) for key, value in _kept_object(kept, "versions", path, "made_by").items()},
        notes=_kept_object(kept, "notes", path, "made_by"),
    )


def read_encoder(file: h5py.File, path: Path, feature_count: int) -> EncoderRecord:
    """What made the features; a published dump does not say, so all of one feature size count as one encoder."""
    kept = hdf5.read_record(file, "encoder", path)
    if kept is None:
        return EncoderRecord(f"{FILE_ENCODER} ({feature_count} features)", f"thor_v1-{feature_count}")
    return EncoderRecord(
        name=_kept_text(kept, "name", path, "encoder"),
        identity=_kept_text(kept, "identity", path, "encoder"),
        settings=_kept_object(kept, "settings", path, "encoder"),
        arrays=hdf5.read_group_arrays(file, "encoder", path),
    )


def read_top_view(file: h5py.File, path: Path) -> TopView | None:
    """The picture from above, None where the file has none."""
    dataset = hdf5.find_dataset(file, "top_view", path)
    if dataset is None:
        return None
    limit = MAX_PICTURE_SIDE * MAX_PICTURE_SIDE * 3
    hdf5.check_layout(dataset, path, shape=(None, None, 3), kinds="u", limit=limit)
    extent = {}
    for side in TOP_VIEW_EXTENT:
        value = hdf5.read_number(dataset, side, path, -MAX_COORDINATE_M, MAX_COORDINATE_M)
        if value is None:
            raise SceneError(path, f"lacks the attribute '{side}'", hdf5.MAKE_AGAIN, "top_view")
        extent[side] = value
    return TopView(hdf5.read_values(dataset, path).astype(np.uint8), **extent)


def read_readings(file: h5py.File, path: Path, count: int) -> tuple[Readings, ...]:
    """What sensors besides the colour camera measured in `count` states, left in the file; () where it has none.

    Raises:
        SceneError: what a dataset says of its sensor is missing or does not fit it.
    """
    found = []
    for name, dataset in hdf5.group_datasets(file, SENSORS, path).items():
        sensor = _read_sensor(dataset, name, path)
        kept = np.dtype(sensor.kept_dtype)
        hdf5.check_layout(dataset, path, shape=(count, *sensor.shape), kinds=kept.kind)
        if dataset.dtype != kept:
            raise SceneError(path, f"holds {dataset.dtype}, expected {kept}", hdf5.MAKE_AGAIN, f"{SENSORS}/{name}")
        whole = path.resolve()
        raw = FilePictures(whole, f"{SENSORS}/{name}", tuple(dataset.shape), file_stamp(whole), kept.name)
        found.append(Readings(sensor, raw, str(path)))
    return tuple(found)


def write_readings(file: h5py.File, readings: Readings) -> None:
    """Store what a sensor measured, a pose a chunk and a block of them in memory at a time, and what the sensor is.

    Raises:
        SceneError: a value is out of the sensor's range.
    """
    sensor, raw = readings.sensor, readings.raw
    dataset = file.require_group(SENSORS).create_dataset(
        sensor.name,
        shape=raw.shape,
        dtype=sensor.kept_dtype,
        chunks=(1, *sensor.shape),
        shuffle=np.dtype(sensor.kept_dtype).itemsize > 1,
        compression="gzip",
        compression_opts=SENSOR_GZIP_LEVEL,
        fletcher32=True,
    )
    write_sensor(dataset, sensor)
    for start in range(0, raw.shape[0], BLOCK_PICTURES):
        dataset[start : start + BLOCK_PICTURES] = readings.checked(slice(start, start + BLOCK_PICTURES))


def write_sensor(dataset: h5py.Dataset, sensor: Sensor) -> None:
    """Keep what a sensor is as attributes of what it measured."""
    hdf5.write_text(dataset, "dtype", sensor.dtype)
    hdf5.write_text(dataset, "unit", sensor.unit)
    for key in SENSOR_NUMBERS:
        if getattr(sensor, key) is not None:
            dataset.attrs[key] = float(getattr(sensor, key))


def write_provenance(file: h5py.File, made_by: Provenance) -> None:
    """Keep what made the scene as one JSON attribute."""
    hdf5.write_text(file, "made_by", json.dumps(made_by.to_json()))


def write_encoder(file: h5py.File, encoder: EncoderRecord) -> None:
    """Keep an encoder's record as a JSON attribute and its statistics as a group of arrays."""
    kept = {"name": encoder.name, "identity": encoder.identity, "settings": dict(encoder.settings)}
    hdf5.write_text(file, "encoder", json.dumps(kept))
    group = file.create_group("encoder")
    for name, values in encoder.arrays.items():
        hdf5.write_array(group, name, values)


def write_top_view(file: h5py.File, view: TopView) -> None:
    """Store the picture from above, with its extent as attributes."""
    dataset = hdf5.write_array(file, "top_view", view.image)
    for side in TOP_VIEW_EXTENT:
        dataset.attrs[side] = getattr(view, side)


def _read_sensor(dataset: h5py.Dataset, name: str, path: Path) -> Sensor:
    """What a dataset says of its sensor."""
    where = f"{SENSORS}/{name}"
    texts = {key: hdf5.read_attribute(dataset, key, path) for key in ("dtype", "unit")}
    numbers = {key: hdf5.read_number(dataset, key, path, -LARGEST, LARGEST) for key in SENSOR_NUMBERS}
    for key, value in {**texts, "low": numbers["low"], "high": numbers["high"]}.items():
        if value is None:
            raise SceneError(path, f"lacks the attribute '{key}'", hdf5.MAKE_AGAIN, where)
    with hdf5.faults_named(path, where):
        shape = tuple(dataset.shape[1:])
    sensor = Sensor(name, shape, str(texts["dtype"]), str(texts["unit"]), **numbers)  # type: ignore[arg-type]
    check_sensor(sensor, path)
    return sensor


def _kept_text(kept: Mapping[str, object], key: str, path: Path, attribute: str) -> str:
    value = kept.get(key)
    if not isinstance(value, str):
        raise SceneError(path, f"attribute '{attribute}' lacks the text '{key}'", hdf5.MAKE_AGAIN)
    return value


def _kept_object(kept: Mapping[str, object], key: str, path: Path, attribute: str) -> dict[str, object]:
    value = kept.get(key, {})
    if not isinstance(value, dict):
        raise SceneError(path, f"attribute '{attribute}' has no object as '{key}'", hdf5.MAKE_AGAIN)
    return value
