"""The taking of pictures: MuJoCo's renderer over the shots of a view."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import nullcontext

import mujoco
import numpy as np

from clearway.rooms.camera import Shot, View
from clearway.rooms.frustum import Frustum
from clearway.scenes import sensors

SPARE_GEOMS = 100  # the renderer adds a few of its own to the model's
TWO_OF_THREE = np.array([[2, 1, 0], [0, 1, 2]], np.float32)
"""How much of each of three pixels in a column lies in each of two, as shares of their thirds."""
TWO_OF_THREE_COLOURS = np.kron(TWO_OF_THREE.T, np.eye(3, dtype=np.float32))
"""The same in a row, each colour by itself."""


def take_pictures(model: mujoco.MjModel, view: View, shots: Iterable[Shot]) -> Iterator[np.ndarray]:
    """The pictures of some shots one by one, as `View.empty_pictures` has them; the array may be used again.

    Sets the lens of `view` in `model`; the view's own shots do not count. Needs a process with a working MUJOCO_GL
    backend (see `render`), which opens before the first shot is asked for.
    """
    depth = view.sensor == sensors.DEPTH
    finer = view.fast and not depth
    height_px, width_px = (px * 3 // 2 if finer else px for px in (view.height_px, view.width_px))
    lens = model.vis.global_
    lens.offheight, lens.offwidth = height_px, width_px
    lens.fovy = view.vertical_extent
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    shown = mujoco.MjvOption()
    shown.geomgroup[:] = 0
    shown.geomgroup[list(view.groups)] = 1
    frustum = Frustum(model, data, view) if view.fast else None
    sensor = sensors.SENSORS[view.sensor](view.height_px, view.width_px)
    picture = np.empty((height_px, width_px, *sensor.shape[2:]), sensor.dtype)
    if depth or finer:
        model.vis.quality.offsamples = 0  # of depth, several samples a pixel might be blended over an edge
    max_geom = model.ngeom + model.nsite + SPARE_GEOMS
    with mujoco.Renderer(model, height_px, width_px, max_geom=max_geom) as renderer:
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0  # the rooms' light is baked
        if depth:
            renderer.enable_depth_rendering()
        elif view.fast:
            _take_nearest_mipmaps(renderer)
        for shot in shots:
            if shot.moved_m:
                data.mocap_pos[:] = shot.moved_m
                mujoco.mj_forward(model, data)
            camera = _free_camera(shot, view.orthographic)
            mujoco.mjv_updateCamera(model, data, camera, renderer.scene)  # endless planes are laid out around the last
            with frustum.of(shot) if frustum is not None else nullcontext():
                renderer.update_scene(data, camera, shown)
            taken = renderer.render(out=picture)
            yield sensor.kept(two_thirds(taken) if finer else taken)


def _take_nearest_mipmaps(renderer: mujoco.Renderer) -> None:
    """Read flat textures at the nearest mipmap level, not between two: that saves a sixth of a small picture's time."""
    from OpenGL import GL  # once a context is open: it asks for the platform's library

    context = renderer._mjr_context
    for number in range(context.ntexture):
        if context.textureType[number] == mujoco.mjtTexture.mjTEXTURE_2D:
            GL.glBindTexture(GL.GL_TEXTURE_2D, int(context.texture[number]))
            GL.glTexParameteri(GL.GL_TEXTURE_2D, GL.GL_TEXTURE_MIN_FILTER, GL.GL_LINEAR_MIPMAP_NEAREST)


def two_thirds(picture: np.ndarray) -> np.ndarray:
    """A (3 h, 3 w, 3) uint8 picture at two thirds of its size: the mean of each pixel's area, rounded."""
    height, width, _ = picture.shape
    rows = TWO_OF_THREE @ picture.reshape(height // 3, 3, width * 3).astype(np.float32)
    ninths = rows.reshape(-1, 9) @ TWO_OF_THREE_COLOURS
    rounded = (ninths + 4.5) * np.float32(1 / 9)  # sums are whole, so that no mean lies on the edge between two numbers
    return rounded.astype(np.uint8).reshape(height * 2 // 3, width * 2 // 3, 3)


def _free_camera(shot: Shot, orthographic: bool) -> mujoco.MjvCamera:
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = shot.look_at_m
    camera.distance = shot.distance_m
    camera.azimuth = shot.azimuth_deg
    camera.elevation = shot.elevation_deg
    camera.orthographic = int(orthographic)
    return camera
