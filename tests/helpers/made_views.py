"""Shards with made-up pictures, for tests that render nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from clearway.scenes.sensors import RGB, Readings
from clearway.views.settings import ViewSettings
from clearway.views.shard import write_shard
from clearway.views.table import COLUMNS, ViewTable, table_of
from clearway.views.take import RoomViews
from helpers.made import corridor_scene

SETTINGS = ViewSettings(poses=10, takes=2, sensors=("rgb", "depth"), size_px=(16, 16))


def made_table(settings: ViewSettings, seed: int = 0) -> ViewTable:
    """Poses and takes as they stand in a shard, everything else random."""
    rng, count = np.random.default_rng(seed), settings.picture_count
    values = rng.uniform(0, 5, (count, len(COLUMNS)))
    values[:, COLUMNS.index("pose")] = np.arange(count) // settings.takes
    values[:, COLUMNS.index("take")] = np.arange(count) % settings.takes
    values[:, COLUMNS.index("arrangement")] = rng.integers(5, size=count)
    values[:, COLUMNS.index("zone")] = rng.integers(3, size=count)
    return table_of(values)


def made_views(settings: ViewSettings = SETTINGS, seed: int = 0) -> RoomViews:
    """Random pictures; the first two colours of the first pixel say pose and take."""
    rng, table = np.random.default_rng(seed), made_table(settings, seed)
    sensors = {sensor.name: sensor for sensor in settings.all_sensors}
    rgb = rng.integers(256, size=(len(table), *sensors[RGB].shape), dtype=np.uint8)
    rgb[:, 0, 0, 0], rgb[:, 0, 0, 1] = table.pose, table.take
    further = tuple(
        Readings(sensor, rng.integers(20_001, size=(len(table), *sensor.shape)).astype(sensor.kept_dtype))
        for name, sensor in sensors.items()
        if name != RGB
    )
    return RoomViews(table, rgb, further)


def write_made(folder: Path, name: str, settings: ViewSettings = SETTINGS, seed: int = 0) -> Path:
    """A shard of a corridor of that name."""
    path = folder / f"{name}.h5"
    write_shard(path, replace(corridor_scene(), name=name), settings, made_views(settings, seed))
    return path
