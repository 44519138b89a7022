"""The shell of a room: floor, ceiling, walls, partitions to the ceiling, skirting boards and cornices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from clearway.rooms.frame import Frame
from clearway.rooms.groups import CEILING_GROUP, SEEN_GROUP, SHELL_NAME
from clearway.rooms.room import ORIGIN, WALL_THICKNESS_M, Room
from clearway.rooms.surfaces import Surface, pixels

SIDES = ("south", "north", "west", "east")


@dataclass(frozen=True)
class Column:
    """A piece of wall from floor to ceiling: a partition, a chimney breast, the corner that makes the room an L.

    Attributes:
        x_min_m, y_min_m, x_max_m, y_max_m: its rectangle on the floor.
        top_m: its height; None reaches the ceiling.
    """

    x_min_m: float
    y_min_m: float
    x_max_m: float
    y_max_m: float
    top_m: float | None = None

    def face(self, side: str, along_m: float, z_m: float = 0.0) -> Frame:
        """A frame on one of its sides, facing away from it; `along_m` is the room's x or y there."""
        return {
            "south": Frame(along_m, self.y_min_m, 180.0, z_m),
            "north": Frame(along_m, self.y_max_m, 0.0, z_m),
            "west": Frame(self.x_min_m, along_m, 90.0, z_m),
            "east": Frame(self.x_max_m, along_m, -90.0, z_m),
        }[side]


@dataclass(frozen=True)
class Face:
    """A face of a wall inside the room, as far as it goes straight on.

    Attributes:
        at: the middle of its lower edge on the floor, facing away from the wall.
        length_m: how long it is.
        bottom_m: where it begins; above 0 over a door.
        ends: how boards along it end at the frame's -x and +x: 1 beyond it, over the end of the next face's board, -1
            before the next face's board, 0 at its end.
    """

    at: Frame
    length_m: float
    bottom_m: float = 0.0
    ends: tuple[int, int] = (0, 0)


@dataclass(frozen=True, eq=False)
class Finish:
    """What the shell is covered with; every picture is (height, width, 3), row 0 at the bottom.

    Pixels are as of `surfaces.pixels` with the detail's `texture_step`.

    Attributes:
        floor: as large as the floor.
        ceiling: colour of the ceiling.
        walls: the picture of each side, as wide and high as the wall.
        partitions: one picture for all columns, at least as wide as their widest side.
        faces: a picture for each face, at least as wide as the room's longest wall.
        skirting: material of the skirting boards, or None for tiles down to the floor.
        cornice: material of the cornices, or None.
    """

    floor: np.ndarray = field(repr=False)
    ceiling: np.ndarray = field(repr=False)
    walls: Mapping[str, np.ndarray] = field(repr=False)
    partitions: np.ndarray | None = field(default=None, repr=False)
    faces: Sequence[np.ndarray] = field(default=(), repr=False)
    skirting: str | None = "trim"
    cornice: str | None = "trim"


def wall_size_m(room: Room, side: str) -> tuple[float, float]:
    """Width and height of a wall."""
    return (room.width_m if side in ("south", "north") else room.depth_m), room.height_m


def add_walls(room: Room, columns: tuple[Column, ...] = ()) -> None:
    """The obstacles of the shell: the four walls and the columns."""
    w, d, h, t = room.width_m, room.depth_m, room.height_m, WALL_THICKNESS_M
    walls = (
        (w / 2, -t / 2, w + 2 * t, t),
        (w / 2, d + t / 2, w + 2 * t, t),
        (-t / 2, d / 2, t, d),
        (w + t / 2, d / 2, t, d),
    )
    for number, (x, y, size_x, size_y) in enumerate(walls):
        room.block(ORIGIN, (x, y, h / 2), (size_x, size_y, h), f"{SHELL_NAME} wall {number}")
    for number, column in enumerate(columns):
        frame, size = _column_box(room, column)
        room.block(frame, (0, 0, size[2] / 2), size, f"{SHELL_NAME} column {number}")


def _column_box(room: Room, column: Column) -> tuple[Frame, tuple[float, float, float]]:
    """The middle of a column on the floor and its full size."""
    middle = Frame((column.x_min_m + column.x_max_m) / 2, (column.y_min_m + column.y_max_m) / 2)
    height = room.height_m if column.top_m is None else column.top_m
    return middle, (column.x_max_m - column.x_min_m, column.y_max_m - column.y_min_m, height)


def add_surfaces(room: Room, finish: Finish, columns: tuple[Column, ...] = ()) -> None:
    """The visible shell; call it with looks only."""
    w, d, h = room.width_m, room.depth_m, room.height_m
    x, y, z = np.eye(3)
    _surface(room, "floor", np.zeros(3), x * w, y * d, finish.floor)
    _surface(room, "ceiling", y * d + z * h, x * w, -y * d, finish.ceiling, CEILING_GROUP)
    for side, corner, right in (
        ("south", x * w, -x * w),
        ("north", y * d, x * w),
        ("west", np.zeros(3), y * d),
        ("east", x * w + y * d, -y * d),
    ):
        _surface(room, f"wall {side}", corner, right, z * h, finish.walls[side])
        _add_boards(room, side, finish)
    for number, column in enumerate(columns):
        _add_column(room, number, column, finish)


def _surface(
    room: Room,
    name: str,
    corner: np.ndarray,
    right: np.ndarray,
    up: np.ndarray,
    albedo: np.ndarray,
    group: int = SEEN_GROUP,
) -> None:
    """One rectangle of the shell, mirrored where the room is."""
    if room.mirrored:
        flip = np.array([-1, 1, 1])
        corner = (corner + right) * flip + np.array([room.width_m, 0, 0])
        right, up, albedo = -right * flip, up * flip, albedo[:, ::-1]
    room.surfaces.append(Surface(name, corner, right, up, albedo, group))


def _add_boards(room: Room, side: str, finish: Finish) -> None:
    """Skirting board and cornice along a wall."""
    width = wall_size_m(room, side)[0]
    middle = room.wall(side, width / 2)
    if finish.skirting:
        room.box(middle, (0, 0.008, 0), (width, 0.016, 0.09), finish.skirting, 0.004)
    if finish.cornice:
        room.box(
            middle, (0, 0.02, room.height_m - 0.06), (width, 0.04, 0.06), finish.cornice, 0.015, group=CEILING_GROUP
        )


def _add_column(room: Room, number: int, column: Column, finish: Finish) -> None:
    """The faces of a column that show, each with its skirting board."""
    assert finish.partitions is not None, "columns need a finish"
    frame, (width, depth, height) = _column_box(room, column)
    room.shadow_box(frame, (width, depth, height))
    at_wall = {
        0: column.y_max_m >= room.depth_m,
        90: column.x_min_m <= 0,
        180: column.y_min_m <= 0,
        270: column.x_max_m >= room.width_m,
    }
    up = np.array([0.0, 0.0, height])
    for yaw, hidden in at_wall.items():
        if hidden:
            continue
        length, reach = (width, depth / 2) if yaw % 180 == 0 else (depth, width / 2)
        face = Frame(frame.x_m, frame.y_m, yaw)  # its y points away from the column
        corner, other = face.point(length / 2, reach, 0), face.point(-length / 2, reach, 0)
        albedo = _piece_of(finish.partitions, length, height, 97 * number + 2 * yaw, room.detail.texture_step)
        _surface(room, f"column {number} face {yaw}", corner, other - corner, up, albedo)
        if finish.skirting:
            room.box(face, (0, reach + 0.008, 0), (length + 0.032, 0.016, 0.09), finish.skirting, 0.004)
    if height < room.height_m:
        room.box(frame, (0, 0, height), (width + 0.04, depth + 0.04, 0.03), "trim", 0.008)


def add_faces(
    room: Room, faces: Sequence[Face], cornices: Sequence[Face], columns: Sequence[Column], finish: Finish
) -> None:
    """The visible walls inside the room, where faces show that columns make together; call it with looks only.

    Args:
        room: where to.
        faces: that show.
        cornices: faces as they are under the ceiling.
        columns: what stops light.
        finish: with a picture for each face.
    """
    for column in columns:
        room.shadow_box(*_column_box(room, column))
    step = room.detail.texture_step
    for number, (face, picture) in enumerate(zip(faces, finish.faces, strict=True)):
        tall_m = room.height_m - face.bottom_m
        corner, other = (face.at.point(x_m, 0, face.bottom_m) for x_m in (face.length_m / 2, -face.length_m / 2))
        along = (other - corner) / face.length_m
        start_m = float(corner @ along) if along.sum() > 0 else float(corner @ along) + _extent_m(room, along)
        broad, low = pixels(face.length_m, step), pixels(face.bottom_m, step) if face.bottom_m else 0
        first = max(0, min(pixels(start_m, step), picture.shape[1] - broad))
        albedo = picture[low:, first : first + broad]
        group = CEILING_GROUP if face.bottom_m else SEEN_GROUP  # the view from above shows the way through
        _surface(room, f"face {number}", corner, other - corner, np.array([0, 0, tall_m]), albedo, group)
        if finish.skirting and not face.bottom_m:
            _add_board(room, face, (0.016, 0.09), 0.0, finish.skirting, 0.004, SEEN_GROUP)
    for face in cornices if finish.cornice else ():
        _add_board(room, face, (0.04, 0.06), room.height_m - 0.06, str(finish.cornice), 0.015, CEILING_GROUP)


def _extent_m(room: Room, along: np.ndarray) -> float:
    """Length of the room along a horizontal axis."""
    return room.width_m if abs(along[0]) > 0.5 else room.depth_m


def _add_board(
    room: Room, face: Face, size_m: tuple[float, float], z_m: float, material: str, bevel_m: float, group: int
) -> None:
    """A board (thick, high) along a face."""
    thick_m, high_m = size_m
    left_m, right_m = (end * thick_m for end in face.ends)
    length_m = face.length_m + left_m + right_m
    if length_m > thick_m:
        place = ((right_m - left_m) / 2, thick_m / 2, z_m)
        room.box(face.at, place, (length_m, thick_m, high_m), material, bevel_m, group=group)


def _piece_of(picture: np.ndarray, width_m: float, height_m: float, shift_px: int, step: int) -> np.ndarray:
    """A piece of a wall's picture, cut out at a place that depends on `shift_px`."""
    broad = pixels(width_m, step)
    spare = max(picture.shape[1] - broad, 0)
    first = shift_px % (spare * step + 1) // step
    return picture[: pixels(height_m, step), first : first + broad]
