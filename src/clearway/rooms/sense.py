"""What all sensors see of a room: one view, taken by each sensor in turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from clearway.rooms.render import render
from clearway.scenes.sensors import RGB, SENSORS, Readings

if TYPE_CHECKING:
    import mujoco

    from clearway.rooms.camera import View


def sense(
    model: mujoco.MjModel,
    view: View,
    sensors: Sequence[str],
    *,
    title: str,
    workers: int | None = None,
    ray: str | None = None,
    progress: bool = False,
    here: bool = False,
) -> tuple[np.ndarray, tuple[Readings, ...]]:
    """What the sensors see from every shot of a view.

    Args:
        model: the compiled room.
        view: the shots and the lens, the same for all sensors.
        sensors: names that passed `sensors.check_names`.
        title: of the room, for progress bars.
        workers, ray, progress, here: see `render`.

    Returns:
        pictures: (shots, height_px, width_px, 3) uint8 RGB.
        further: what each sensor but the colour camera measured, in the order asked for.

    Raises:
        RenderError, RunError: as of `render`.
    """
    taken = {}
    for name in (RGB, *(name for name in sensors if name != RGB)):
        label = f"rendering {title}" if name == RGB else f"rendering {title}, {name}"
        one = replace(view, sensor=name)
        taken[name] = render(model, one, workers=workers, ray=ray, progress=progress, label=label, here=here)
    pictures = taken.pop(RGB)
    further = (Readings(SENSORS[name](view.height_px, view.width_px), raw) for name, raw in taken.items())
    return pictures, tuple(further)
