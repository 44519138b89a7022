"""Small scenes made on the spot for tests: `corridor_scene`, `grid_scene` and `scene_of_cells` below them.

State numbering: state = 4 * cell + heading / 90, so the four headings of a cell stand together.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clearway.scenes.actions import BLOCKED
from clearway.scenes.scene import EncoderRecord, Provenance, Scene, TopView
from clearway.scenes.sensors import Readings, depth

CELL_SIZE_M = 0.5
STEP_OF_HEADING = np.array([[0, 1], [1, 0], [0, -1], [-1, 0]])  # x and z, for headings 0 to 270


def corridor_scene(length: int = 5, *, feature_count: int = 16, name: str = "corridor") -> Scene:
    """A straight corridor along +z of `length` cells: cell 0 at z = 0, states 4 * cell + heading / 90.

    Looking along the corridor (heading 0), forward leads from state 4 * c to 4 * (c + 1); looking across
    it (headings 90 and 270) every move is blocked.
    """
    cells = np.stack([np.zeros(length, np.int64), np.arange(length)], axis=1)
    return scene_of_cells(cells, feature_count=feature_count, name=name)


def grid_scene(
    seed: int = 0,
    *,
    width: int = 6,
    depth: int = 5,
    obstacle_share: float = 0.2,
    feature_count: int = 32,
    picture_size: tuple[int, int] = (12, 16),
    name: str = "grid",
) -> Scene:
    """A random room: `width` x `depth` cells, some of them obstacles, the largest connected part kept."""
    rng = np.random.default_rng(seed)
    free = rng.random((width, depth)) >= obstacle_share
    free[width // 2, depth // 2] = True
    return scene_of_cells(
        largest_part(free), seed=seed, feature_count=feature_count, picture_size=picture_size, name=name
    )


def scene_of_cells(
    cells: np.ndarray,
    *,
    seed: int = 0,
    feature_count: int = 16,
    picture_size: tuple[int, int] = (12, 16),
    name: str = "cells",
) -> Scene:
    """A scene whose free cells are given, (C, 2) int x and z on the grid; neighbours are joined.

    Features and pictures are smooth random functions of the pose: near poses look alike, no two the
    same. The functions depend on the sizes alone, so that several scenes share one made-up encoder.
    """
    locations_m = np.repeat(cells, 4, axis=0) * CELL_SIZE_M
    headings_deg = np.tile(np.arange(4) * 90, len(cells))
    return Scene(
        name=name,
        observations=made_up_pictures(locations_m, headings_deg, picture_size),
        features=made_up_features(locations_m, headings_deg, feature_count),
        locations_m=locations_m,
        headings_deg=headings_deg,
        graph=graph_of_cells(cells),
        made_by=Provenance("test", room=name, seed=seed, versions={"clearway": "test"}),
        encoder=EncoderRecord("made-up", f"made-up-{feature_count}", {"feature_count": feature_count}),
        cell_size_m=CELL_SIZE_M,
        top_view=made_up_top_view(cells),
    )


def with_depth(scene: Scene) -> Scene:
    """The scene with made-up depth of the size of its pictures: red as a share of 8 m, in whole millimetres."""
    sensor = depth(*scene.observations.shape[1:3])
    return replace(scene, further=(Readings(sensor, sensor.kept(scene.observations[..., 0] * (8 / 255))),))


def graph_of_cells(cells: np.ndarray) -> np.ndarray:
    """The (4 * C, 4) int32 graph of all poses on the given cells."""
    number = {tuple(cell): index for index, cell in enumerate(cells.tolist())}
    graph = np.full((4 * len(cells), 4), BLOCKED, np.int32)
    for cell, index in number.items():
        for heading, (dx, dz) in enumerate(STEP_OF_HEADING.tolist()):
            state = 4 * index + heading
            ahead = number.get((cell[0] + dx, cell[1] + dz))
            behind = number.get((cell[0] - dx, cell[1] - dz))
            graph[state, 0] = BLOCKED if ahead is None else 4 * ahead + heading
            graph[state, 1] = 4 * index + (heading + 1) % 4
            graph[state, 2] = 4 * index + (heading - 1) % 4
            graph[state, 3] = BLOCKED if behind is None else 4 * behind + heading
    return graph


def made_up_features(locations_m: np.ndarray, headings_deg: np.ndarray, count: int) -> np.ndarray:
    """Smooth features of poses, (S, count) float32, about zero mean and unit variance."""
    return _waves(locations_m, headings_deg, count, seed=1234).astype(np.float32)


def made_up_pictures(locations_m: np.ndarray, headings_deg: np.ndarray, size: tuple[int, int] = (12, 16)) -> np.ndarray:
    """Tiny smooth pictures of poses, (S, height, width, 3) uint8."""
    height, width = size
    coarse = _waves(locations_m, headings_deg, 4 * 4 * 3, seed=4321).reshape(-1, 4, 4, 3)
    rows, columns = np.arange(height) * 4 // height, np.arange(width) * 4 // width
    return np.clip(128 + 60 * coarse[:, rows][:, :, columns], 0, 255).astype(np.uint8)


def _waves(locations_m: np.ndarray, headings_deg: np.ndarray, count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    turn = np.deg2rad(headings_deg)
    poses = np.stack([locations_m[:, 0], locations_m[:, 1], np.sin(turn), np.cos(turn)], axis=1)
    frequency = rng.normal(size=(4, count)) * 1.2
    return np.sqrt(2) * np.cos(poses @ frequency + rng.uniform(0, 2 * np.pi, count))


def made_up_top_view(cells: np.ndarray) -> TopView:
    """A map of 8 pixels a cell: light where the floor is free, dark elsewhere."""
    low, high = cells.min(axis=0), cells.max(axis=0)
    floor = np.zeros(high - low + 1, bool)
    floor[tuple((cells - low).T)] = True
    rows_from_top = np.kron(floor.T[::-1], np.ones((8, 8), bool))
    image = np.where(rows_from_top[..., None], 220, 60).astype(np.uint8).repeat(3, axis=2)
    x_min, z_min = (low - 0.5) * CELL_SIZE_M
    x_max, z_max = (high + 0.5) * CELL_SIZE_M
    return TopView(image, float(x_min), float(x_max), float(z_min), float(z_max))


def largest_part(free: np.ndarray) -> np.ndarray:
    """The cells, (C, 2) int, of the largest 4-connected part of a (width, depth) bool array."""
    from scipy.ndimage import label

    labels, _ = label(free)
    return np.argwhere(labels == 1 + np.bincount(labels[labels > 0] - 1).argmax())
