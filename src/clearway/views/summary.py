"""`summary`: views in figures, for `clearway scenes inspect`."""

from __future__ import annotations

import numpy as np

from clearway.remote.address import file_bytes
from clearway.views.stream import Views
from clearway.views.table import joined
from clearway.zones import Zone

CHECKED_PICTURES = 256  # that are in memory together
NEAR_M = 0.3  # ahead of the body


def summary(views: Views) -> dict[str, object]:
    """The figures of views, every picture of which is read and checked.

    Raises:
        SceneError: something is damaged.
    """
    for shard in views.shards:
        for sensor in shard.sensors:
            for first in range(0, len(shard), CHECKED_PICTURES):
                shard.seen(sensor.name, slice(first, first + CHECKED_PICTURES))
    table = joined([shard.table for shard in views.shards])
    settings = views.settings
    return {
        "rooms": len(views.shards),
        "pictures": len(views),
        "poses": settings.poses,
        "takes": settings.takes,
        "sensors": tuple(sensor.described() for sensor in views.sensors),
        "perturbations": {name: value for name, value in settings.perturbations.to_json().items() if value},
        "seed": settings.seed,
        "held_out": settings.held_out,
        "scene_headings": settings.scene_headings,
        "bytes_a_picture": round(sum(file_bytes(shard.path) for shard in views.shards) / len(views)),
        "zones": {zone.name.lower(): int((table.zone == zone).sum()) for zone in Zone},
        "mean_clearance_m": round(float(table.clearance_m.mean()), 3),
        "mean_free_m": round(float(table.free_m.mean()), 3),
        "near_an_obstacle_ahead": round(float(np.mean(table.free_m[:, 0] < NEAR_M)), 3),
    }
