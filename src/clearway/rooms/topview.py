"""A picture of a room from straight above, without its ceiling, for maps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from clearway.rooms.camera import Shot, View
from clearway.rooms.groups import SEEN_GROUP
from clearway.rooms.render import render
from clearway.scenes.scene import TopView

if TYPE_CHECKING:
    import mujoco

PIXELS_PER_M = 100
ABOVE_M = 10.0  # where the camera hangs; the picture is orthographic, so the height does not matter


def render_top_view(
    model: mujoco.MjModel,
    width_m: float,
    depth_m: float,
    moved_m: tuple[tuple[float, float, float], ...] = (),
    *,
    here: bool = False,
) -> TopView:
    """The floor from x = 0 to `width_m` and z = 0 to `depth_m`, rounded to whole pixels, seen from above.

    Args:
        model: the compiled room.
        width_m, depth_m: size of the floor.
        moved_m: where its loose pieces stand, see `camera.Shot`.
        here: see `render`.

    Raises:
        RenderError: this machine has no OpenGL backend that works.
    """
    size_m, groups = (width_m, depth_m), (SEEN_GROUP,)
    return render_from_above(model, (0.0, 0.0), size_m, ABOVE_M, PIXELS_PER_M, groups, moved_m, here=here)


def render_from_above(
    model: mujoco.MjModel,
    low_m: tuple[float, float],
    high_m: tuple[float, float],
    camera_m: float,
    pixels_per_m: float,
    groups: tuple[int, ...],
    moved_m: tuple[tuple[float, float, float], ...] = (),
    *,
    here: bool = False,
) -> TopView:
    """A rectangle of floor, rounded to whole pixels, seen from straight above.

    Args:
        model: the world.
        low_m: smallest x and z.
        high_m: largest x and z.
        camera_m: height of the camera, above all that is to be seen.
        pixels_per_m: scale.
        groups: the geom groups that show.
        moved_m: where loose pieces stand, see `camera.Shot`.
        here: see `render`.

    Raises:
        RenderError: this machine has no OpenGL backend that works.
    """
    width_px, height_px = (max(1, round((high - low) * pixels_per_m)) for low, high in zip(low_m, high_m, strict=True))
    middle_x_m, middle_z_m = ((low + high) / 2 for low, high in zip(low_m, high_m, strict=True))
    half_x_m, half_z_m = width_px / pixels_per_m / 2, height_px / pixels_per_m / 2
    view = View(
        shots=(Shot((middle_x_m, middle_z_m, 0.0), camera_m, azimuth_deg=90.0, elevation_deg=-90.0, moved_m=moved_m),),
        height_px=height_px,
        width_px=width_px,
        vertical_extent=2 * half_z_m,
        orthographic=True,
        groups=groups,
    )
    return TopView(
        image=render(model, view, workers=1, here=here)[0],
        x_min_m=middle_x_m - half_x_m,
        x_max_m=middle_x_m + half_x_m,
        z_min_m=middle_z_m - half_z_m,
        z_max_m=middle_z_m + half_z_m,
    )
