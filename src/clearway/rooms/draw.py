"""Putting a lit room into its spec: surfaces with their light maps, and furniture merged into few geoms."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import mujoco
import numpy as np

from clearway.rooms.groups import PIECE_NAME
from clearway.rooms.meshes import rectangle
from clearway.rooms.parts import Part
from clearway.rooms.pieces import FIXED
from clearway.rooms.room import Room
from clearway.rooms.spec import add_mesh_geom, add_texture
from clearway.rooms.surfaces import Surface

GLOW = 40.0
BRIGHTNESS_STEP = 0.08
"""Parts of one material whose brightness differs by less are drawn as one geom."""

NOT_SET = (0.5, 0.5, 0.5, 1.0)
"""The colour that MuJoCo takes for "use the material's"."""


def draw_surface(spec: mujoco.MjSpec, surface: Surface, light: np.ndarray) -> None:
    """Add a surface, its picture multiplied by its (rows, columns, 3) light map."""
    rows, columns = surface.albedo.shape[:2]
    lit = surface.albedo * _enlarged(light, rows, columns)
    bright = lit >= 0.7
    lit[bright] = _soft_limit(lit[bright])
    # The light is in the picture already: nearly black to MuJoCo's lights, and shining by itself.
    material = spec.add_material(name=surface.name, emission=GLOW, specular=0.0, shininess=0.0)
    material.rgba[:] = [1 / GLOW, 1 / GLOW, 1 / GLOW, 1]
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = add_texture(spec, surface.name, lit)
    mesh = rectangle(surface.origin_m, surface.right_m, surface.up_m)
    arrays = mesh.vertices_m, mesh.faces, mesh.normals, mesh.uvs
    add_mesh_geom(spec, surface.name, arrays, surface.name, surface.group)


def _enlarged(light: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """A light map at another size, linear between texels, (rows, columns, 3) float32."""
    light = light.astype(np.float32)
    for axis, count in enumerate((rows, columns)):
        size = light.shape[axis]
        place = np.clip((np.arange(count) + 0.5) / count * size - 0.5, 0, size - 1)
        low = np.minimum(place.astype(int), size - 2)
        share = (place - low).astype(np.float32).reshape([-1 if a == axis else 1 for a in range(3)])
        light = np.take(light, low, axis) * (1 - share) + np.take(light, low + 1, axis) * share
    return light


def _soft_limit(bright: np.ndarray) -> np.ndarray:
    """Brightness above 0.7, bent gently towards 1."""
    return 0.7 + 0.3 * np.tanh((bright - 0.7) / 0.3)


def draw_parts(
    room: Room,
    parts: Sequence[Part],
    brightness: np.ndarray,
    pieces: np.ndarray,
    piece_count: int,
) -> None:
    """Add the parts under (N, 3) brightness; those alike in material and brightness become one geom.

    Where the room's detail has blocks, they become one in each block. See-through parts stay single, because MuJoCo
    sorts whole geoms by their distance.

    Args:
        room: where to.
        parts: visible ones.
        brightness: of each part.
        pieces: (N,) int, number of the body that each part hangs on, whose position can be set later (MuJoCo's mocap);
            `pieces.FIXED`: the world's. The colours are the same either way.
        piece_count: number of such bodies.
    """
    alike: dict[tuple, list[int]] = defaultdict(list)
    bodies = {FIXED: room.spec.worldbody}
    for piece in range(piece_count):
        bodies[piece] = room.spec.worldbody.add_body(name=f"{PIECE_NAME} {piece}", mocap=True)
    for number, (part, bright) in enumerate(zip(parts, brightness, strict=True)):
        step = round(bright.mean() / BRIGHTNESS_STEP) if room.is_opaque(part.material) else -number - 1
        alike[part.material, part.group, step].append(number)
    for serial, ((material, group, _), members) in enumerate(alike.items()):
        rgba = room.tint_of(material)
        rgba[:3] *= brightness[members].mean(axis=0)
        if np.abs(rgba - NOT_SET).max() < 1e-3:
            rgba[0] += 0.002
        together: dict[tuple, list[Part]] = defaultdict(list)
        for number in members:
            together[int(pieces[number]), *_block_of(parts[number], room.detail.block_m)].append(parts[number])
        for (piece, *block), some in sorted(together.items(), key=lambda item: item[0]):
            name = " ".join(map(str, ["furniture", serial, *block]))
            name = name if piece == FIXED else f"{name} of {PIECE_NAME} {piece}"
            add_mesh_geom(room.spec, name, _merged(some), material, group, bodies[piece]).rgba[:] = rgba


def _block_of(part: Part, block_m: float | None) -> tuple[int, ...]:
    """Numbers along x and y of the square of floor that a part is drawn with; none where the room is not divided."""
    return () if block_m is None else tuple((part.centre_m[:2] // block_m).astype(int).tolist())


def _merged(parts: list[Part]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, faces, normals and uvs of several parts in room coordinates."""
    starts = np.cumsum([0] + [len(part.mesh.vertices_m) for part in parts[:-1]])
    return (
        np.concatenate([part.mesh.vertices_m @ part.rotation.T + part.position_m for part in parts]),
        np.concatenate([part.mesh.faces + start for part, start in zip(parts, starts, strict=True)]),
        np.concatenate([part.mesh.normals @ part.rotation.T for part in parts]),
        np.concatenate([part.uvs for part in parts]),
    )
