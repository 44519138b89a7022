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

from clearway.rooms.daytime import Daytime
from clearway.rooms.detail import Detail
from clearway.rooms.draw import draw_parts, draw_surface
from clearway.rooms.occupancy import VOXEL_M, Occupancy, occupancy_of
from clearway.rooms.parts import Lamp, Part, Window
from clearway.rooms.pieces import loose_obstacles, piece_count, pieces_of_parts
from clearway.rooms.room import Room
from clearway.rooms.surfaces import Surface

AMBIENT_REACH_M = 0.5
AMBIENT_LIMIT_M = 2.5
DEEPEST_SHADE = 0.22
AMBIENT = 0.6
SUN = 1.5
SUN_SLANT = 0.55
DAYLIGHT = np.array([0.92, 0.97, 1.0])
SUNLIGHT = np.array([1.0, 0.93, 0.8])
MEAN_EXPOSURE = 0.68
FURNITURE_FLOOR, FURNITURE_GAIN = 0.42, 0.95
WEAK_LIGHT = 0.003
RAYS_AT_ONCE = 1_500_000
OFF_SURFACE_M = 0.06
SOURCE_SPARE_M = 0.3  # light that comes so near to its source is not shaded: lamps are solid
SHARES = (-0.66, 0.0, 0.66)  # of half the length of a part, where its long sides are asked for light


@dataclass(frozen=True, eq=False)
class _Source:
    """One point that light comes from: (3,) place, (3,) colour times power, (3,) normal of a window or None."""

    place_m: np.ndarray
    light: np.ndarray
    normal: np.ndarray | None


@dataclass(frozen=True, eq=False)
class _Scene:
    """What light meets (solid parts, sources, windows with sun, the floor's tint), how closely one looks, and when."""

    solid: Occupancy
    sources: Sequence[_Source]
    windows: Sequence[Window]
    sun: np.ndarray | None
    floor_tint: np.ndarray
    detail: Detail
    daytime: Daytime


def bake(room: Room, *, count_hidden: bool = True, loose: bool = False) -> None:
    """Light the room: draw its surfaces with light maps and set the brightness of every furniture part.

    Args:
        room: furnished.
        count_hidden: set the exposure by all of the surfaces; False leaves out what lies within solid parts, for
            rooms with much floor and wall under thick walls.
        loose: hang every piece of furniture on a body of its own (`pieces`).
    """
    scene = _scene_of(room)
    maps = [_light_map(scene, surface, room.rng) for surface in room.surfaces]
    shown = []
    for light, surface in zip(maps, room.surfaces, strict=True):
        if surface.name != "ceiling":
            texels, places_m = light.reshape(-1, 3), _texel_points(surface, room.detail.texel_m)
            shown.append(texels if count_hidden else texels[~scene.solid.is_solid(places_m)])
    exposure = room.daytime.exposure * MEAN_EXPOSURE / float(np.concatenate(shown).mean())
    for surface, light in zip(room.surfaces, maps, strict=True):
        draw_surface(room.spec, surface, light * exposure)
    shown_parts = [part for part in room.parts if part.material]
    brightness = _brightness_of(shown_parts, scene, exposure, room.rng)
    brightness[[not room.is_shaded(part.material) for part in shown_parts]] = 1.0
    obstacles = loose_obstacles(room.spec) if loose else []
    pieces = pieces_of_parts(obstacles, shown_parts, (room.width_m, room.depth_m))
    draw_parts(room, shown_parts, brightness, pieces, piece_count(room.spec) if loose else 0)
    _add_lights(room)


def _scene_of(room: Room) -> _Scene:
    size = (room.width_m, room.depth_m, room.height_m)
    sources = [source for lamp in room.lamps for source in _lamp_sources(lamp)]
    sources += [source for window in room.windows for source in _window_sources(window, room.daytime)]
    floor = next(surface for surface in room.surfaces if surface.name == "floor")
    tint = floor.albedo[::8, ::8].mean(axis=(0, 1))
    return _Scene(
        occupancy_of(size, room.parts),
        sources,
        room.windows,
        _sun_direction(room.windows, room.daytime),
        tint / tint.max(),
        room.detail,
        room.daytime,
    )


def _lamp_sources(lamp: Lamp) -> list[_Source]:
    """Points on the lamp's circle, more for a large lamp."""
    count = 2 if lamp.radius_m < 0.15 else 5
    angles = np.arange(count) * 2 * np.pi / count + 0.4
    around = np.stack([np.cos(angles), np.sin(angles), np.zeros(count)], axis=1) * lamp.radius_m
    return [_Source(lamp.centre_m + offset, lamp.colour * lamp.power / count, None) for offset in around]


def _window_sources(window: Window, daytime: Daytime) -> list[_Source]:
    """Four points on the pane."""
    light = DAYLIGHT * np.array(daytime.sky) * 0.62 * window.width_m * window.height_m / 4
    middle = window.centre_m + window.normal * 0.2
    return [
        _Source(
            middle + window.right * window.width_m * i + np.array([0, 0, window.height_m * j]), light, window.normal
        )
        for i in (-0.3, 0.3)
        for j in (-0.25, 0.25)
    ]


def _sun_direction(windows: Sequence[Window], daytime: Daytime) -> np.ndarray | None:
    """Towards the sun, (3,) unit vector, so that it shines in by the largest window; None without windows or sun."""
    if not windows or not any(daytime.sun):
        return None
    largest = max(windows, key=lambda window: window.width_m * window.height_m)
    sun = -largest.normal + SUN_SLANT * largest.right + np.array([0, 0, daytime.height])
    return sun / np.linalg.norm(sun)


def _light_map(scene: _Scene, surface: Surface, rng: np.random.Generator) -> np.ndarray:
    """Light on a grid of texels, (rows, columns, 3), row 0 at the bottom."""
    rows, columns = _texel_counts(surface, scene.detail.texel_m)
    points = _texel_points(surface, scene.detail.texel_m)
    normals = np.broadcast_to(surface.normal, points.shape)
    light = _irradiance(scene, points, normals, rng)
    if scene.sun is not None:
        light += _sunlight(scene, surface, points, rng)
    return ndimage.gaussian_filter(light.reshape(rows, columns, 3), (0.7, 0.7, 0), mode="nearest")


def _texel_counts(surface: Surface, texel_m: float) -> tuple[int, int]:
    """Rows and columns of a surface's light map, of texels of about that size."""
    return max(4, round(surface.height_m / texel_m)), max(4, round(surface.width_m / texel_m))


def _texel_points(surface: Surface, texel_m: float) -> np.ndarray:
    """The middles of a light map's texels, a little before the surface, (rows x columns, 3), row 0 at the bottom."""
    rows, columns = _texel_counts(surface, texel_m)
    u = (np.arange(columns) + 0.5) / columns
    v = (np.arange(rows) + 0.5) / rows
    v, u = np.meshgrid(v, u, indexing="ij")
    points = surface.origin_m + u[..., None] * surface.right_m + v[..., None] * surface.up_m
    return (points + surface.normal * OFF_SURFACE_M).reshape(-1, 3)


def _irradiance(scene: _Scene, points_m: np.ndarray, normals: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Ambient light and the light of lamps and windows on (N, 3) points that face (N, 3) normals, (N, 3)."""
    per_point = scene.detail.ambient_rays + len(scene.sources)
    chunk = max(1, RAYS_AT_ONCE // per_point)
    parts = [
        _ambient(scene, points_m[i : i + chunk], normals[i : i + chunk], rng)
        + _direct(scene, points_m[i : i + chunk], normals[i : i + chunk])
        for i in range(0, len(points_m), chunk)
    ]
    return np.concatenate(parts)


def _ambient(scene: _Scene, points_m: np.ndarray, normals: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Light from all around, less where something is near; from below it carries the floor's colour."""
    count, ray_count = len(points_m), scene.detail.ambient_rays
    share = (np.arange(ray_count) + 0.5) / ray_count
    angle = np.arange(ray_count) * 2.399963 + rng.uniform(0, 2 * np.pi, (count, 1))
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
    reach = scene.solid.distance_m(np.repeat(points_m, ray_count, axis=0), rays.reshape(-1, 3), AMBIENT_LIMIT_M)
    openness = 1 - (1 - DEEPEST_SHADE) * np.exp(-reach.reshape(count, ray_count, 1) / AMBIENT_REACH_M)
    from_above = rays[..., 2:] / 2 + 0.5
    tint = from_above + (1 - from_above) * (0.35 + 0.65 * scene.floor_tint)
    return AMBIENT * (openness * tint).mean(axis=1)


def _direct(scene: _Scene, points_m: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Light of lamps and windows that nothing shades."""
    light = np.zeros((len(points_m), 3))
    if not scene.sources:
        return light
    reaching = [_unshaded(source, points_m, normals) for source in scene.sources]
    lit = np.concatenate([one.points for one in reaching])
    directions = np.concatenate([one.directions for one in reaching])
    enough_m = np.concatenate([one.distances_m for one in reaching]) - SOURCE_SPARE_M
    # a voxel more than enough, so that rounding decides nothing
    clear = scene.solid.distance_m(points_m[lit], directions, enough_m + VOXEL_M) > enough_m
    ends = np.cumsum([len(one.points) for one in reaching])
    for source, one, unblocked in zip(scene.sources, reaching, np.split(clear, ends[:-1]), strict=True):
        light[one.points] += (one.strengths * unblocked)[:, None] * source.light
    return light


@dataclass(frozen=True, eq=False)
class _Beams:
    """Light of one source on those points that it is not too weak for: their numbers, (N,); and the way back to it."""

    points: np.ndarray
    directions: np.ndarray
    distances_m: np.ndarray
    strengths: np.ndarray


def _unshaded(source: _Source, points_m: np.ndarray, normals: np.ndarray) -> _Beams:
    """What a source sends to (N, 3) points that face (N, 3) normals, whatever is in between."""
    offset = source.place_m - points_m
    distance = np.linalg.norm(offset, axis=1)
    direction = offset / distance[:, None]
    strength = np.maximum(np.einsum("ij,ij->i", direction, normals), 0) / (distance**2 + 0.6)
    if source.normal is not None:
        strength *= np.maximum(-direction @ source.normal, 0)
    lit = np.nonzero(strength * source.light.max() > WEAK_LIGHT)[0]
    return _Beams(lit, direction[lit], distance[lit], strength[lit])


def _sunlight(scene: _Scene, surface: Surface, points_m: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Sun through the windows, (N, 3); four jittered rays a texel soften the edge."""
    assert scene.sun is not None
    slope = float(surface.normal @ scene.sun)
    if slope <= 0:
        return np.zeros((len(points_m), 3))
    hits = np.zeros(len(points_m))
    for _ in range(4):
        jitter = rng.uniform(-0.5, 0.5, (len(points_m), 2)) * scene.detail.texel_m
        right, up = surface.right_m / surface.width_m, surface.up_m / surface.height_m
        start = points_m + jitter[:, :1] * right + jitter[:, 1:] * up
        direction = np.broadcast_to(scene.sun, start.shape)
        reach = scene.solid.distance_m(start, direction)
        hits += _through_window(scene.windows, start + direction * reach[:, None]) / 4
    return hits[:, None] * SUN * slope * SUNLIGHT * np.array(scene.daytime.sun)


def _through_window(windows: Sequence[Window], points_m: np.ndarray) -> np.ndarray:
    """Which (N, 3) points lie on a window pane, (N,) bool."""
    through = np.zeros(len(points_m), bool)
    for window in windows:
        offset = points_m - window.centre_m
        on_wall = np.abs(offset @ window.normal) < 0.1
        in_pane = (np.abs(offset @ window.right) < window.width_m / 2) & (np.abs(offset[:, 2]) < window.height_m / 2)
        through |= on_wall & in_pane
    return through


def _brightness_of(parts: Sequence[Part], scene: _Scene, exposure: float, rng: np.random.Generator) -> np.ndarray:
    """How bright each part is drawn, (N, 3): the light on its open sides, kept between deep shade and bright."""
    owner_of, places, outward, areas = _samples_of(parts)
    open_side = ~scene.solid.is_solid(places)
    light = _irradiance(scene, places[open_side], outward[open_side], rng) * exposure
    weight = areas[open_side, None] + 1e-6
    total, weights = np.zeros((len(parts), 3)), np.zeros((len(parts), 1))
    np.add.at(total, owner_of[open_side], light * weight)
    np.add.at(weights, owner_of[open_side], weight)
    mean_light = np.where(weights > 0, total / np.maximum(weights, 1e-9), 0.3)
    return np.clip(FURNITURE_FLOOR + FURNITURE_GAIN * mean_light, 0.5, 1.3)


def _samples_of(parts: Sequence[Part]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Places just off the six sides of every part's box, one in the middle of its ends, three along other sides.

    Returns:
        Numbers of the parts (N,), points (N, 3), outward normals (N, 3) and areas of the sides (N,); part by part.
    """
    halves_m = np.array([part.half_extents_m for part in parts])  # (P, 3)
    centres_m = np.array([part.centre_m for part in parts])
    axes = np.array([part.rotation for part in parts]).transpose(0, 2, 1)  # (P, axis, 3)
    longest = halves_m.argmax(axis=1)
    numbers = np.arange(len(parts))
    normals = axes[:, :, None] * np.array([-1.0, 1.0])[:, None]  # (P, axis, sign, 3)
    middles_m = centres_m[:, None, None] + normals * (halves_m + OFF_SURFACE_M)[:, :, None, None]
    along_m = axes[numbers, longest] * halves_m[numbers, longest, None]
    points_m = middles_m[:, :, :, None] + along_m[:, None, None, None] * np.array(SHARES)[:, None]
    areas = np.stack(
        [halves_m[:, 1] * halves_m[:, 2], halves_m[:, 0] * halves_m[:, 2], halves_m[:, 0] * halves_m[:, 1]], axis=1
    )
    asked = np.ones(points_m.shape[:-1], bool)
    asked[numbers, longest] = np.array(SHARES) == 0
    owner, axis, sign, _ = np.nonzero(asked)
    return owner, points_m[asked], normals[owner, axis, sign], areas[owner, axis]


def _add_lights(room: Room) -> None:
    """MuJoCo's own lights, without shadows: they only turn the sides of furniture lighter and darker."""
    lights = [((0.1, 0.15, -1.0), 0.34), ((0.3, -0.2, 1.0), 0.06)]
    normals = [window.normal for window in room.windows] or [np.array([0.6, 0.8, 0.0])]
    lights += [((n[0], n[1], -0.4), 0.26 * room.daytime.brightness / len(normals)) for n in normals]
    lights += [((-normals[0][0] + 0.4 * normals[0][1], -normals[0][1] - 0.4 * normals[0][0], -0.3), 0.14)]
    for number, (direction, brightness) in enumerate(lights):
        light = room.spec.worldbody.add_light(
            name=f"light {number}",
            dir=direction,
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            castshadow=False,
            pos=[room.width_m / 2, room.depth_m / 2, room.height_m],
        )
        light.diffuse[:] = [brightness * 1.0, brightness * 0.98, brightness * 0.94]
        light.specular[:] = [0.25 * brightness] * 3
        light.ambient[:] = [0, 0, 0]
