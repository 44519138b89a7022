"""The light of a room, worked out once and baked: light maps on the shell, one brightness for each furniture part.

Light on a point is open sky around it (ambient occlusion, tinted by the floor below and the ceiling above), plus the
shadowed light of lamps and windows, plus the sun through the windows of one wall.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy import ndimage

from clearway.scenes.rooms.meshes import rectangle
from clearway.scenes.rooms.occupancy import Occupancy, occupancy_of
from clearway.scenes.rooms.room import Lamp, Part, Room, Window, add_mesh
from clearway.scenes.rooms.surfaces import Surface

TEXEL_M = 0.1
AMBIENT_RAYS = 28
AMBIENT_REACH_M = 0.6
AMBIENT = 0.6
SUN = 0.9
SUN_SLANT = 0.55
DAYLIGHT = np.array([0.92, 0.97, 1.0])
SUNLIGHT = np.array([1.0, 0.93, 0.8])
MEAN_EXPOSURE = 0.84
LAMP_GLOW = 40.0
RAYS_AT_ONCE = 1_500_000
OFF_SURFACE_M = 0.06


@dataclass(frozen=True, eq=False)
class _Source:
    """One point that light comes from: (3,) place, (3,) colour times power, (3,) normal of a window or None."""

    place_m: np.ndarray
    light: np.ndarray
    normal: np.ndarray | None


@dataclass(frozen=True, eq=False)
class _Scene:
    """What light meets: the solid parts, the sources, the windows that the sun shines through, the floor's tint."""

    solid: Occupancy
    sources: Sequence[_Source]
    windows: Sequence[Window]
    sun: np.ndarray | None
    floor_tint: np.ndarray


def bake(room: Room) -> None:
    """Light the room: draw its surfaces with light maps and set the brightness of every furniture part."""
    scene = _scene_of(room)
    maps = [_light_map(scene, surface, room.rng) for surface in room.surfaces]
    shown = [light for light, surface in zip(maps, room.surfaces, strict=True) if surface.name != "ceiling"]
    exposure = MEAN_EXPOSURE / float(np.concatenate([light.reshape(-1, 3) for light in shown]).mean())
    for surface, light in zip(room.surfaces, maps, strict=True):
        _draw_surface(room.spec, surface, light * exposure)
    _shade_parts(room, scene, exposure)
    _add_lights(room)


def _scene_of(room: Room) -> _Scene:
    size = (room.width_m, room.depth_m, room.height_m)
    sources = [source for lamp in room.lamps for source in _lamp_sources(lamp)]
    sources += [source for window in room.windows for source in _window_sources(window)]
    floor = next(surface for surface in room.surfaces if surface.name == "floor")
    tint = floor.albedo[::8, ::8].mean(axis=(0, 1))
    return _Scene(
        occupancy_of(size, room.parts), sources, room.windows, _sun_direction(room.windows), tint / tint.max()
    )


def _lamp_sources(lamp: Lamp) -> list[_Source]:
    angles = np.arange(6) * np.pi / 3
    around = np.stack([np.cos(angles), np.sin(angles), np.zeros(6)], axis=1) * lamp.radius_m
    return [_Source(lamp.centre_m + offset, lamp.colour * lamp.power / 6, None) for offset in around]


def _window_sources(window: Window) -> list[_Source]:
    right = np.cross([0, 0, 1], window.normal)
    power = 0.62 * window.width_m * window.height_m / 6
    return [
        _Source(
            window.centre_m + right * window.width_m * i + np.array([0, 0, window.height_m * j]) + window.normal * 0.2,
            DAYLIGHT * power,
            window.normal,
        )
        for i in (-0.33, 0.0, 0.33)
        for j in (-0.25, 0.25)
    ]


def _sun_direction(windows: Sequence[Window]) -> np.ndarray | None:
    """Towards the sun, (3,) unit vector, so that it shines in through the first window; None without windows."""
    if not windows:
        return None
    normal = windows[0].normal
    sideways = np.cross([0, 0, 1], normal)
    sun = -normal + SUN_SLANT * sideways + np.array([0, 0, 0.8])
    return sun / np.linalg.norm(sun)


def _light_map(scene: _Scene, surface: Surface, rng: np.random.Generator) -> np.ndarray:
    """Light on a grid of texels of about TEXEL_M, (rows, columns, 3), row 0 at the bottom."""
    columns = max(4, round(surface.width_m / TEXEL_M))
    rows = max(4, round(surface.height_m / TEXEL_M))
    u = (np.arange(columns) + 0.5) / columns
    v = (np.arange(rows) + 0.5) / rows
    v, u = np.meshgrid(v, u, indexing="ij")
    points = surface.origin_m + u[..., None] * surface.right_m + v[..., None] * surface.up_m
    points = (points + surface.normal * OFF_SURFACE_M).reshape(-1, 3)
    normals = np.broadcast_to(surface.normal, points.shape)
    light = _irradiance(scene, points, normals, rng)
    if scene.sun is not None:
        light += _sunlight(scene, surface, points, rng)
    return ndimage.gaussian_filter(light.reshape(rows, columns, 3), (0.7, 0.7, 0), mode="nearest")


def _irradiance(scene: _Scene, points_m: np.ndarray, normals: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Ambient light and the light of lamps and windows on (N, 3) points that face (N, 3) normals, (N, 3)."""
    per_point = AMBIENT_RAYS + len(scene.sources)
    chunk = max(1, RAYS_AT_ONCE // per_point)
    parts = [
        _ambient(scene, points_m[i : i + chunk], normals[i : i + chunk], rng)
        + _direct(scene, points_m[i : i + chunk], normals[i : i + chunk])
        for i in range(0, len(points_m), chunk)
    ]
    return np.concatenate(parts)


def _ambient(scene: _Scene, points_m: np.ndarray, normals: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Light from all around, less where something is near; from below it carries the floor's colour."""
    count = len(points_m)
    share = (np.arange(AMBIENT_RAYS) + 0.5) / AMBIENT_RAYS
    angle = np.arange(AMBIENT_RAYS) * 2.399963 + rng.uniform(0, 2 * np.pi, (count, 1))
    flat, up = np.sqrt(share), np.sqrt(1 - share)
    tangent = np.where(np.abs(normals[:, 2:]) > 0.9, [[1.0, 0, 0]], [[0, 0, 1.0]])
    right = np.cross(tangent, normals)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    forward = np.cross(normals, right)
    rays = (
        (flat * np.cos(angle))[..., None] * right[:, None]
        + (flat * np.sin(angle))[..., None] * forward[:, None]
        + up[:, None] * normals[:, None]
    )
    reach = scene.solid.distance_m(np.repeat(points_m, AMBIENT_RAYS, axis=0), rays.reshape(-1, 3))
    openness = 1 - np.exp(-reach.reshape(count, AMBIENT_RAYS, 1) / AMBIENT_REACH_M)
    from_above = rays[..., 2:] / 2 + 0.5
    tint = from_above + (1 - from_above) * (0.35 + 0.65 * scene.floor_tint)
    return AMBIENT * (openness * tint).mean(axis=1)


def _direct(scene: _Scene, points_m: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Light of lamps and windows that nothing shades."""
    light = np.zeros((len(points_m), 3))
    for source in scene.sources:
        offset = source.place_m - points_m
        distance = np.linalg.norm(offset, axis=1)
        direction = offset / distance[:, None]
        strength = np.maximum(np.einsum("ij,ij->i", direction, normals), 0) / (distance**2 + 0.6)
        if source.normal is not None:
            strength *= np.maximum(-direction @ source.normal, 0)
        lit = np.nonzero(strength > 0)[0]
        clear = scene.solid.distance_m(points_m[lit], direction[lit]) > distance[lit] - 0.3
        light[lit] += (strength[lit] * clear)[:, None] * source.light
    return light


def _sunlight(scene: _Scene, surface: Surface, points_m: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Sun through the windows, (N, 3); four jittered rays a texel soften the edge."""
    assert scene.sun is not None
    slope = float(surface.normal @ scene.sun)
    if slope <= 0:
        return np.zeros((len(points_m), 3))
    hits = np.zeros(len(points_m))
    for _ in range(4):
        jitter = rng.uniform(-0.5, 0.5, (len(points_m), 2)) * TEXEL_M
        right, up = surface.right_m / surface.width_m, surface.up_m / surface.height_m
        start = points_m + jitter[:, :1] * right + jitter[:, 1:] * up
        direction = np.broadcast_to(scene.sun, start.shape)
        reach = scene.solid.distance_m(start, direction)
        hits += _through_window(scene.windows, start + direction * reach[:, None]) / 4
    return hits[:, None] * SUN * slope * SUNLIGHT


def _through_window(windows: Sequence[Window], points_m: np.ndarray) -> np.ndarray:
    """Which (N, 3) points lie on a window pane, (N,) bool."""
    through = np.zeros(len(points_m), bool)
    for window in windows:
        offset = points_m - window.centre_m
        right = np.cross([0, 0, 1], window.normal)
        on_wall = np.abs(offset @ window.normal) < 0.1
        in_pane = (np.abs(offset @ right) < window.width_m / 2) & (np.abs(offset[:, 2]) < window.height_m / 2)
        through |= on_wall & in_pane
    return through


def _draw_surface(spec: mujoco.MjSpec, surface: Surface, light: np.ndarray) -> None:
    """Add a surface to the spec, its picture multiplied by its light map."""
    rows, columns = surface.albedo.shape[:2]
    lit = _soft_limit(surface.albedo * _enlarged(light, rows, columns))
    pixels = np.clip(np.round(lit * 255), 0, 255).astype(np.uint8)
    texture = spec.add_texture(
        name=f"{surface.name} texture", type=mujoco.mjtTexture.mjTEXTURE_2D, height=rows, width=columns, nchannel=3
    )
    texture.data = pixels.tobytes()
    # The light is in the picture already: nearly black to MuJoCo's lights, and shining by itself.
    material = spec.add_material(name=surface.name, emission=LAMP_GLOW, specular=0.0, shininess=0.0)
    material.rgba[:] = [1 / LAMP_GLOW, 1 / LAMP_GLOW, 1 / LAMP_GLOW, 1]
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = texture.name
    mesh = rectangle(surface.origin_m, surface.right_m, surface.up_m)
    add_mesh(spec, surface.name, mesh, mesh.uvs)
    spec.worldbody.add_geom(
        name=surface.name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=surface.name, material=surface.name,
        group=surface.group, contype=0, conaffinity=0,
    )  # fmt: skip


def _enlarged(light: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """A light map at another size, linear between texels, (rows, columns, 3)."""
    for axis, count in enumerate((rows, columns)):
        size = light.shape[axis]
        place = np.clip((np.arange(count) + 0.5) / count * size - 0.5, 0, size - 1)
        low = np.minimum(place.astype(int), size - 2)
        share = (place - low).reshape([-1 if a == axis else 1 for a in range(3)])
        light = np.take(light, low, axis) * (1 - share) + np.take(light, low + 1, axis) * share
    return light


def _soft_limit(picture: np.ndarray) -> np.ndarray:
    """Brightness that bends gently towards 1 above 0.75."""
    return np.where(picture < 0.75, picture, 0.75 + 0.25 * np.tanh((picture - 0.75) / 0.25))


def _shade_parts(room: Room, scene: _Scene, exposure: float) -> None:
    """Set the colour of every furniture part to its material's under the light that reaches the part."""
    shaded = [part for part in room.parts if part.geom is not None and room.is_shaded(part.material)]
    points, normals, areas, owners = [], [], [], []
    size = np.array([room.width_m, room.depth_m, room.height_m])
    for owner, part in enumerate(shaded):
        for point, normal, area in _faces_of(part):
            if np.all((point > 0) & (point < size)):
                points.append(point)
                normals.append(normal)
                areas.append(area)
                owners.append(owner)
    light = _irradiance(scene, np.array(points), np.array(normals), room.rng) * exposure
    weight = np.array(areas)[:, None] + 1e-6
    total = np.zeros((len(shaded), 3))
    weights = np.zeros((len(shaded), 1))
    np.add.at(total, owners, light * weight)
    np.add.at(weights, owners, weight)
    mean_light = np.where(weights > 0, total / np.maximum(weights, 1e-9), 0.6)
    for part, light_on_part in zip(shaded, mean_light, strict=True):
        assert part.geom is not None
        part.geom.rgba[:] = _shaded_tint(room.tint_of(part.material), light_on_part)


def _faces_of(part: Part) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Middle, outward normal and area of the six sides of a part's box, a voxel outside it."""
    faces = []
    for axis in range(3):
        area = float(np.prod(np.delete(part.half_extents_m, axis)))
        for sign in (-1.0, 1.0):
            normal = part.rotation[:, axis] * sign
            faces.append((part.centre_m + normal * (part.half_extents_m[axis] + OFF_SURFACE_M), normal, area))
    return faces


def _shaded_tint(tint: np.ndarray, light: np.ndarray) -> np.ndarray:
    """A material's (4,) colour under (3,) light, kept between deep shade and bright."""
    brightness = np.clip(0.34 + 0.8 * light, 0.42, 1.25)
    rgba = tint.copy()
    rgba[:3] *= brightness
    if np.abs(rgba - [0.5, 0.5, 0.5, 1]).max() < 1e-3:
        rgba[0] += 0.002  # MuJoCo takes exactly this colour as "not set"
    return rgba


def _add_lights(room: Room) -> None:
    """MuJoCo's own lights, without shadows: they only turn the sides of furniture lighter and darker."""
    lights = [((0.1, 0.15, -1.0), 0.36), ((0.3, -0.2, 1.0), 0.08)]
    normals = [window.normal for window in room.windows] or [np.array([0.6, 0.8, 0.0])]
    lights += [((n[0], n[1], -0.4), 0.26 / len(normals)) for n in normals]
    lights += [((-normals[0][0] + 0.4 * normals[0][1], -normals[0][1] - 0.4 * normals[0][0], -0.3), 0.14)]
    for number, (direction, brightness) in enumerate(lights):
        light = room.spec.worldbody.add_light(
            name=f"light {number}", dir=direction, type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, castshadow=False,
            pos=[room.width_m / 2, room.depth_m / 2, room.height_m],
        )  # fmt: skip
        light.diffuse[:] = [brightness * 1.0, brightness * 0.98, brightness * 0.94]
        light.specular[:] = [0.25 * brightness] * 3
        light.ambient[:] = [0, 0, 0]
