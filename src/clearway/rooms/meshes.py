"""Meshes of furniture parts, as pure functions: bevelled boxes, turned (lathed) shapes, panels, curtains.

Every mesh is symmetric in its local x, so that a room can be mirrored by moving its parts.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

CREASE_COS = 0.6
"""Profile corners sharper than this cosine keep a hard edge."""

PANEL_THICKNESS_M = 0.002


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh; triangles wind counter-clockwise seen from outside.

    Attributes:
        vertices_m: (V, 3) float64.
        faces: (F, 3) int64 vertex indices.
        normals: (V, 3) unit vectors.
        uvs: (V, 2) texture coordinates, metres (panels: fractions of the picture).
    """

    vertices_m: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    uvs: np.ndarray

    @cached_property
    def half_extents_m(self) -> np.ndarray:
        """(3,) half the size of the bounding box."""
        return np.ptp(self.vertices_m, axis=0) / 2

    @cached_property
    def centre_m(self) -> np.ndarray:
        """(3,) the middle of the bounding box."""
        return (self.vertices_m.max(axis=0) + self.vertices_m.min(axis=0)) / 2


@lru_cache(maxsize=2048)
def bevelled_box(size_m: tuple[float, float, float], bevel_m: float, segments: int = 1, grain_up: bool = False) -> Mesh:
    """A box centred at the origin with rounded edges.

    Args:
        size_m: full size along x, y, z.
        bevel_m: radius of the edges, cut to fit the smallest side.
        segments: roundness; 0 gives a plain box of 12 triangles, 1 flat faces joined by one strip along every
            edge (44 triangles), n > 1 edges of 2 n strips.
        grain_up: keep u horizontal on every face; otherwise u runs along the longer side, as wood grain does.
    """
    half = np.array(size_m) / 2
    if not segments:
        return _plain_box(half, grain_up)
    if segments == 1:
        return _chamfered_box(half, min(bevel_m, float(half.min()) * 0.9), grain_up)
    bevel = min(bevel_m, float(half.min()) * 0.98)
    parts = [_box_face(half, bevel, segments, axis, sign, grain_up) for axis in range(3) for sign in (-1.0, 1.0)]
    return _joined(parts)


def _plain_box(half: np.ndarray, grain_up: bool) -> Mesh:
    """Six flat faces: those of the cube, stretched."""
    cube = _cube()
    vertices = cube.vertices_m * half
    uvs = [
        vertices[4 * face : 4 * face + 4, [v, u] if not grain_up and half[v] > half[u] else [u, v]]
        for face, (u, v) in enumerate(axes for axes in FACE_AXES for _ in range(2))
    ]
    return Mesh(vertices, cube.faces, cube.normals, np.concatenate(uvs))


@lru_cache(maxsize=1)
def _cube() -> Mesh:
    """The plain box that reaches from -1 to 1."""
    return _joined([_box_face(np.ones(3), 0.0, 0, axis, sign, False) for axis in range(3) for sign in (-1.0, 1.0)])


def _chamfered_box(half: np.ndarray, bevel: float, grain_up: bool) -> Mesh:
    """Six flat faces, twelve strips and eight corners between them; the strips blend the faces' normals."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    vertices, normals, uvs = [], [], []
    for axis in range(3):
        inset = np.where(np.arange(3) == axis, half, half - bevel)
        points = signs * inset
        u_axis, v_axis = FACE_AXES[axis]
        swap = not grain_up and half[v_axis] > half[u_axis]
        vertices.append(points)
        normals.append(signs * np.eye(3)[axis])
        uvs.append(points[:, [v_axis, u_axis] if swap else [u_axis, v_axis]])
    points, outward = np.concatenate(vertices), np.concatenate(normals)
    faces = np.concatenate([CHAMFER_QUADS[:, [0, 1, 2]], CHAMFER_QUADS[:, [0, 2, 3]]])
    faces = faces[(faces[:, 0] != faces[:, 2]) & (faces[:, 1] != faces[:, 2])]
    corners = points[faces]
    winding = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inwards = np.einsum("ij,ij->i", winding, outward[faces].sum(axis=1)) < 0
    faces[inwards] = faces[inwards][:, ::-1]
    return Mesh(points, faces, outward, np.concatenate(uvs))


def _chamfer_quads() -> np.ndarray:
    """Corner indices of the quads of a chamfered box; vertex 8 axis + corner lies on the face across that axis.

    A corner is a number whose bits 4, 2 and 1 say whether x, y and z are high. A triangle repeats its last index.
    """
    bit = {0: 4, 1: 2, 2: 1}
    quads = []
    for axis in range(3):
        u, v = (bit[a] for a in range(3) if a != axis)
        for base in (0, bit[axis]):
            quads.append([8 * axis + base + k for k in (0, u, u + v, v)])
        first, second = ((axis + 1) % 3, (axis + 2) % 3)
        for corner in (0, bit[first], bit[second], bit[first] + bit[second]):
            ends = (corner, corner + bit[axis])
            quads.append([8 * first + ends[0], 8 * first + ends[1], 8 * second + ends[1], 8 * second + ends[0]])
    quads += [[corner, 8 + corner, 16 + corner, 16 + corner] for corner in range(8)]
    return np.array(quads)


FACE_AXES = ((1, 2), (0, 2), (0, 1))
"""The axes along u and v of the face across each axis."""

CHAMFER_QUADS = _chamfer_quads()


def _box_face(half: np.ndarray, bevel: float, segments: int, axis: int, sign: float, grain_up: bool) -> Mesh:
    """One face of a bevelled box, up to the middle of its rounded edges."""
    u_axis, v_axis = FACE_AXES[axis]
    lines = [_face_lines(half[a], bevel, segments) for a in (u_axis, v_axis)]
    u, v = np.meshgrid(*lines, indexing="ij")
    flat = np.zeros((*u.shape, 3))
    flat[..., u_axis], flat[..., v_axis], flat[..., axis] = u, v, sign * half[axis]
    core = np.clip(flat, -(half - bevel), half - bevel) if bevel else flat - sign * np.eye(3)[axis]
    outward = flat - core
    normals = outward / np.linalg.norm(outward, axis=-1, keepdims=True)
    vertices = core + normals * bevel if bevel else flat
    swap = not grain_up and half[v_axis] > half[u_axis]
    uvs = np.stack([v, u] if swap else [u, v], axis=-1)
    keeps_order = np.cross(np.eye(3)[u_axis], np.eye(3)[v_axis])[axis] * sign > 0
    faces = _grid_faces(*u.shape)
    return Mesh(
        vertices.reshape(-1, 3),
        faces if keeps_order else faces[:, ::-1],
        normals.reshape(-1, 3),
        uvs.reshape(-1, 2),
    )


def _face_lines(half: float, bevel: float, segments: int) -> np.ndarray:
    """Where the grid lines of a face run along one axis."""
    if not segments:
        return np.array([-half, half])
    low = np.linspace(-half, -half + bevel, segments + 1)
    return np.concatenate([low, -low[::-1]])


@lru_cache(maxsize=2048)
def lathe(
    profile_m: tuple[tuple[float, float], ...], slices: int = 20, scale_xy: tuple[float, float] = (1.0, 1.0)
) -> Mesh:
    """A shape turned about the z axis.

    Args:
        profile_m: (radius, height) points; outer walls run upwards, inner walls downwards.
        slices: flat sides around the axis.
        scale_xy: stretches the circle to an ellipse.
    """
    angles = np.linspace(0, 2 * np.pi, slices + 1)
    rings = _smooth_rings(np.array(profile_m, float))
    widest = max(radius for radius, _ in profile_m)
    return _joined([_turned(ring, angles, scale_xy, widest) for ring in rings])


def _smooth_rings(profile: np.ndarray) -> list[np.ndarray]:
    """Cuts a profile at its sharp corners; each run is (n, 5): radius, height, normal (r, z), length so far."""
    steps = np.diff(profile, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    outward = np.stack([steps[:, 1], -steps[:, 0]], axis=1) / lengths[:, None]
    travelled = np.concatenate([[0.0], np.cumsum(lengths)])
    runs, first = [], 0
    for corner in range(1, len(profile)):
        last = corner == len(steps)
        if not last and outward[corner - 1] @ outward[corner] > CREASE_COS:
            continue
        segment = outward[first:corner]
        normals = np.concatenate([segment[:1], segment[1:] + segment[:-1], segment[-1:]])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        rows = slice(first, corner + 1)
        runs.append(np.column_stack([profile[rows], normals, travelled[rows]]))
        first = corner
    return runs


def _turned(run: np.ndarray, angles: np.ndarray, scale_xy: tuple[float, float], widest_m: float) -> Mesh:
    """One smooth run of a profile, turned about z."""
    radius, height, normal_r, normal_z, travelled = run.T
    around = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    scale = np.array(scale_xy)
    circle = radius[:, None, None] * around * scale
    sideways = normal_r[:, None, None] * around / scale
    shape = (len(run), len(angles))
    vertices = np.concatenate([circle, np.broadcast_to(height[:, None, None], (*shape, 1))], axis=-1)
    normals = np.concatenate([sideways, np.broadcast_to(normal_z[:, None, None], (*shape, 1))], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    uvs = np.stack(np.broadcast_arrays(angles[None] * widest_m, travelled[:, None]), axis=-1)
    faces = _grid_faces(*shape)[:, ::-1]
    points = vertices.reshape(-1, 3)
    corners = points[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return Mesh(points, faces[area > 1e-12], normals.reshape(-1, 3), uvs.reshape(-1, 2))


@lru_cache(maxsize=256)
def panel(width_m: float, height_m: float) -> Mesh:
    """A flat picture that faces +y, centred at the origin, u and v from 0 to 1; its back is a shallow pyramid."""
    w, h = width_m / 2, height_m / 2
    front = np.array([[-w, 0, -h], [w, 0, -h], [w, 0, h], [-w, 0, h]])
    back = np.array([[0, -PANEL_THICKNESS_M, 0]])
    uvs = np.array([[1, 0], [0, 0], [0, 1], [1, 1], [0.5, 0.5]], float)
    faces = np.array([[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    normals = np.array([[0, 1.0, 0]] * 4 + [[0, -1.0, 0]])
    return Mesh(np.concatenate([front, back]), faces, normals, uvs)


@lru_cache(maxsize=64)
def curtain(width_m: float, height_m: float, folds: int, depth_m: float = 0.05) -> Mesh:
    """A hanging cloth in waves, seen from both sides, centred at the origin, broad in x."""
    columns = folds * 8 + 1
    x = np.linspace(-width_m / 2, width_m / 2, columns)
    phase = 2 * np.pi * folds * x / width_m
    y, slope = depth_m / 2 * np.cos(phase), -np.pi * folds * depth_m / width_m * np.sin(phase)
    z = np.array([-height_m / 2, height_m / 2])
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    front = np.stack([slope, -np.ones(columns), np.zeros(columns)], axis=1)
    front /= np.linalg.norm(front, axis=1, keepdims=True)
    vertices = np.stack(
        [np.repeat(x, 2), np.repeat(y, 2), np.tile(z, columns)],
        axis=1,
    )
    uvs = np.stack([np.repeat(length, 2), np.tile(z, columns)], axis=1)
    faces = _grid_faces(columns, 2)
    normals = np.repeat(front, 2, axis=0)
    behind = vertices + np.array([0, PANEL_THICKNESS_M, 0])
    return _joined([Mesh(vertices, faces, normals, uvs), Mesh(behind, faces[:, ::-1], -normals, uvs)])


def rectangle(origin_m: np.ndarray, right_m: np.ndarray, up_m: np.ndarray) -> Mesh:
    """A flat piece of the room's shell; faces along right x up, u and v run from 0 to 1 along right and up."""
    normal = np.cross(right_m, up_m)
    normal /= np.linalg.norm(normal)
    corners = np.array([origin_m, origin_m + right_m, origin_m + right_m + up_m, origin_m + up_m])
    back = origin_m + (right_m + up_m) / 2 - normal * PANEL_THICKNESS_M
    faces = np.array([[0, 1, 2], [0, 2, 3], [1, 0, 4], [2, 1, 4], [3, 2, 4], [0, 3, 4]])
    uvs = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]], float)
    return Mesh(np.vstack([corners, back]), faces, np.vstack([[normal] * 4, [-normal]]), uvs)


def _grid_faces(rows: int, columns: int) -> np.ndarray:
    """Two triangles a cell of a (rows, columns) vertex grid; they turn from rows towards columns."""
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    a = (i * columns + j).ravel()
    quads = np.stack([a, a + columns, a + columns + 1, a + 1], axis=1)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _joined(parts: list[Mesh]) -> Mesh:
    """One mesh of several."""
    starts = np.cumsum([0] + [len(part.vertices_m) for part in parts[:-1]])
    return Mesh(
        np.concatenate([part.vertices_m for part in parts]),
        np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=True)]),
        np.concatenate([part.normals for part in parts]),
        np.concatenate([part.uvs for part in parts]),
    )
