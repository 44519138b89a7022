"""What the page is made of and asks for, whoever gives it: its files, the stage, maps and pictures."""

from __future__ import annotations

import io
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from clearway.scenes.scene import Scene
from clearway.scenes.sensors import Sensor
from clearway.view.stage import Stage
from clearway.viz.maps import map_extent
from clearway.zones import scene_zones

PAGE = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}
"""Kinds of the page's files, by ending."""
GREY_BEND = 20  # how much better near is told apart than far; depth in metres up to 20 becomes log(1 + depth)
QUALITY = 90  # of JPEG


def page_files() -> dict[str, tuple[bytes, str]]:
    """The page's files by name: content and kind."""
    folder = resources.files("clearway.view") / "page"
    found = {}
    for file in folder.iterdir():
        kind = PAGE.get(Path(file.name).suffix)
        if kind:
            found[file.name] = (file.read_bytes(), kind)
    return found


def stage_json(stage: Stage) -> dict[str, Any]:
    """Who walks, and where."""
    return {
        "agents": [
            {"name": shown.name, "values": shown.tells_values, "map": not shown.tells_values} for shown in stage.agents
        ],
        "scenes": [scene.name for scene in stage.scenes],
    }


def map_json(stage: Stage, index: int) -> dict[str, Any]:
    """One of the stage's scenes: its poses, zones, targets and sensors."""
    scene = stage.scenes[index]
    left, right, low, high = map_extent(scene)
    return {
        "name": scene.name,
        "extent_m": [left, right, low, high],
        "cell_size_m": scene.cell_size_m,
        "turn_deg": scene.turn_deg,
        "locations_m": np.round(scene.locations_m, 4).tolist(),
        "headings_deg": scene.headings_deg.tolist(),
        "cells": scene.cells.tolist(),
        "zones": scene_zones(scene, stage.zone_level).tolist(),
        "targets": list(stage.targets[scene.name]),
        "has_pictures": scene.observations is not None,
        "picture_shape": None if scene.observations is None else list(scene.observations.shape[1:3]),
        "has_above": scene.top_view is not None,
        "sensors": [sensor.to_json() for sensor in shades(scene)],
    }


def grey(values: np.ndarray, sensor: Sensor) -> np.ndarray:
    """A sensor's values as a picture of their shape, uint8: white for the lowest, black for the highest.

    Steps near the lowest are told apart better than steps near the highest: depth of a room, where the range goes far.
    """
    share = (values.astype(np.float64) - sensor.low) / (sensor.high - sensor.low)
    return np.rint(255 * (1 - np.log1p(GREY_BEND * share) / np.log1p(GREY_BEND))).astype(np.uint8)


def shades(scene: Scene) -> list[Sensor]:
    """The sensors of a scene whose observations are one number a pixel."""
    return [sensor for sensor in scene.sensors if len(sensor.shape) == 2]


def jpeg(image: np.ndarray, quality: int = QUALITY) -> bytes:
    """A picture, uint8, in colour or in grey, as a JPEG file."""
    content = io.BytesIO()
    Image.fromarray(np.asarray(image)).convert("RGB").save(content, "JPEG", quality=quality, subsampling=0)
    return content.getvalue()
