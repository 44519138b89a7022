"""A picture of a room from straight above, without its ceiling, for maps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from clearway.scenes.rooms.camera import Shot, View
from clearway.scenes.rooms.groups import SEEN_GROUP
from clearway.scenes.rooms.render import render
from clearway.scenes.scene import TopView

if TYPE_CHECKING:
    import mujoco

PIXELS_PER_M = 100
ABOVE_M = 10.0  # where the camera hangs; the picture is orthographic, so the height does not matter


def render_top_view(
    model: mujoco.MjModel, width_m: float, depth_m: float, moved_m: tuple[tuple[float, float, float], ...] = ()
) -> TopView:
    """The floor from x = 0 to `width_m` and z = 0 to `depth_m`, rounded to whole pixels, seen from above.

    Args:
        model: the compiled room.
        width_m, depth_m: size of the floor.
        moved_m: where its loose pieces stand, see `camera.Shot`.

    Raises:
        RenderError: this machine has no OpenGL backend that works.
    """
    width_px, height_px = round(width_m * PIXELS_PER_M), round(depth_m * PIXELS_PER_M)
    middle_x_m, middle_z_m = width_m / 2, depth_m / 2
    half_x_m, half_z_m = width_px / PIXELS_PER_M / 2, height_px / PIXELS_PER_M / 2
    view = View(
        shots=(Shot((middle_x_m, middle_z_m, 0.0), ABOVE_M, azimuth_deg=90.0, elevation_deg=-90.0, moved_m=moved_m),),
        height_px=height_px,
        width_px=width_px,
        vertical_extent=2 * half_z_m,
        orthographic=True,
        groups=(SEEN_GROUP,),
    )
    return TopView(
        image=render(model, view, workers=1)[0],
        x_min_m=middle_x_m - half_x_m,
        x_max_m=middle_x_m + half_x_m,
        z_min_m=middle_z_m - half_z_m,
        z_max_m=middle_z_m + half_z_m,
    )
