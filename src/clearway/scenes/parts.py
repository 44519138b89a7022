"""Of what kinds a scene's parts have to be, which others' programs may not know: asked before anything else of them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from clearway.errors import SceneError
from clearway.scenes.scene import EncoderRecord, Provenance, Scene, TopView
from clearway.scenes.sensors import Readings, Sensor

CORRECT = "Correct the program that made it: clearway.scenes.scene.Scene says what each part is"
MOST_LETTERS = 200  # of a scene's name, as UTF-8; names of files are cut at 255


def is_name(name: object) -> bool:
    """Whether a scene may be called so: a printable text that can be part of a file's name."""
    plain = isinstance(name, str) and name.isprintable() and not set(name) & set("/\\")
    return plain and name not in ("", ".", "..") and len(str(name).encode()) <= MOST_LETTERS


def check_name(name: object, source: str | Path) -> None:
    """Raise SceneError where no scene may be called so, see `is_name`; `source` is what the error names."""
    if not is_name(name):
        problem = f"{name!r:.80} cannot be a scene's name, which is part of files' names"
        raise SceneError(source, problem, "Give a short one without slashes and line breaks")


def check_parts(scene: Scene, source: str | Path) -> None:
    """Check that every part of a scene is of the kind that `Scene` says, whatever it holds. Raises SceneError."""
    check_name(scene.name, source)
    for name, found, holds, expected in _parts(scene):
        if not holds:
            raise SceneError(source, f"{name} is {_told(found)}, expected {expected}", CORRECT)


def check_records(scene: Scene, source: str | Path) -> None:
    """Check that what is told of a scene and of its encoder are JSON values, as files keep them. Raises SceneError."""
    told = {f"made_by.{name}": getattr(scene.made_by, name) for name in ("versions", "notes")}
    if scene.encoder is not None:
        told["encoder.settings"] = scene.encoder.settings
    for name, values in told.items():
        try:
            json.dumps(dict(values))
        except (TypeError, ValueError, RecursionError) as fault:
            raise SceneError(source, f"{name} is no JSON ({fault})", "Give texts, numbers, lists and dicts") from fault


def _parts(scene: Scene) -> Iterator[tuple[str, Any, bool, str]]:
    """Of each part its name, what it is, whether that is right, and what is expected; the next once that is seen."""
    for name in ("graph", "locations_m", "headings_deg"):
        values = getattr(scene, name)
        yield name, values, _is_array(values), "a NumPy array of numbers"
    pictures, features = scene.observations, scene.features
    yield (
        "observations",
        pictures,
        pictures is None or _is_indexed(pictures),
        "a NumPy array (S, height, width, 3) uint8",
    )
    yield "features", features, features is None or _is_table(features), "a NumPy array (S, F)"
    yield "cell_size_m", scene.cell_size_m, _is_number(scene.cell_size_m), "a number, int or float"
    yield "made_by", scene.made_by, isinstance(scene.made_by, Provenance), "a Provenance"
    yield from _parts_of_provenance(scene.made_by)
    if scene.encoder is not None:
        yield from _parts_of_encoder(scene.encoder)
    if (view := scene.top_view) is not None:
        yield "top_view", view, isinstance(view, TopView) and _is_array(view.image), "a TopView with a NumPy array"
        extent_m = (view.x_min_m, view.x_max_m, view.z_min_m, view.z_max_m)
        yield "top_view's extent", extent_m, all(map(_is_number, extent_m)), "numbers, int or float"
    further = isinstance(scene.further, tuple) and all(isinstance(one, Readings) for one in scene.further)
    yield "further", scene.further, further, "a tuple of Readings"
    for readings in scene.further:
        yield from _parts_of_readings(readings)


def _parts_of_provenance(made_by: Provenance) -> Iterator[tuple[str, Any, bool, str]]:
    yield "made_by.source", made_by.source, isinstance(made_by.source, str), "a text"
    yield "made_by.room", made_by.room, isinstance(made_by.room, str | None), "a text or None"
    yield "made_by.seed", made_by.seed, isinstance(made_by.seed, int | None), "a whole number or None"
    for name in ("versions", "notes"):
        values = getattr(made_by, name)
        yield f"made_by.{name}", values, isinstance(values, Mapping), "a dict"


def _parts_of_encoder(encoder: EncoderRecord) -> Iterator[tuple[str, Any, bool, str]]:
    yield "encoder", encoder, isinstance(encoder, EncoderRecord), "an EncoderRecord"
    for name in ("name", "identity"):
        value = getattr(encoder, name)
        yield f"encoder.{name}", value, isinstance(value, str), "a text"
    yield "encoder.settings", encoder.settings, isinstance(encoder.settings, Mapping), "a dict"
    arrays = encoder.arrays
    yield "encoder.arrays", arrays, isinstance(arrays, Mapping), "a dict of NumPy arrays"
    for name, values in arrays.items():
        yield "a name in encoder.arrays", name, is_name(name), "a short text without slashes and line breaks"
        yield f"encoder.arrays[{name!r}]", values, _is_array(values, "biuf"), "a NumPy array of numbers"


def _parts_of_readings(readings: Readings) -> Iterator[tuple[str, Any, bool, str]]:
    sensor, raw = readings.sensor, readings.raw
    yield "further: a sensor", sensor, isinstance(sensor, Sensor), "a Sensor"
    for name in ("name", "dtype", "unit"):
        value = getattr(sensor, name)
        yield f"further: a sensor's {name}", value, isinstance(value, str), "a text"
    for name in ("low", "high", *(() if sensor.step is None else ("step",))):
        value = getattr(sensor, name)
        yield f"further: {sensor.name}'s {name}", value, _is_number(value), "a number, int or float"
    sides = isinstance(sensor.shape, tuple | list) and all(isinstance(side, int | np.integer) for side in sensor.shape)
    yield f"further: {sensor.name}'s shape", sensor.shape, sides, "a tuple of whole numbers"
    yield f"further: {sensor.name}'s raw", raw, _is_on_demand(raw), "an array (S, ...)"


def _is_array(values: object, kinds: str = "iuf") -> bool:
    return isinstance(values, np.ndarray) and values.dtype.kind in kinds


def _is_table(features: Any) -> bool:
    """An array, whose shape is checked later, or what gives one of rows."""
    shape = getattr(features, "shape", None)
    rows = hasattr(features, "__array__") and isinstance(shape, tuple) and len(shape) == 2
    return rows or isinstance(features, np.ndarray)


def _is_indexed(pictures: Any) -> bool:
    """An array of bytes, or what is read on demand."""
    if isinstance(pictures, np.ndarray):
        return pictures.dtype == np.uint8
    return _is_on_demand(pictures)


def _is_on_demand(values: Any) -> bool:
    return isinstance(getattr(values, "shape", None), tuple) and hasattr(values, "__getitem__")


def _is_number(value: object) -> bool:
    """One that a file can keep, Python's or NumPy's."""
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)


def _told(found: object) -> str:
    """What was found, shortly."""
    if isinstance(found, np.ndarray):
        return f"an array of {found.dtype}"
    return f"{found!r:.40}" if isinstance(found, str | Real | None) else f"of type {type(found).__name__}"
