"""Checks of what users hand to the live environments: room, sensors, perturbations, numbers, actions, poses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path

import numpy as np

from clearway.choices import MODEL_SUFFIXES
from clearway.envs.arguments import as_array, check_switch, scene_of_file
from clearway.errors import EnvError
from clearway.live.conditions import MOST, Perturbations
from clearway.live.live_room import LiveRoom, live_room, live_room_named
from clearway.rooms import ROOM_NAMES
from clearway.scenes.floor_plan_files import SUFFIXES as PLAN_SUFFIXES
from clearway.scenes.scene import Scene
from clearway.scenes.sensors import RGB, SENSORS, Sensor
from clearway.spelling import did_you_mean

RoomSource = str | Path | Scene | LiveRoom
PerturbationSource = Perturbations | Mapping[str, float] | None
LIVE_RENDER_MODES = ("rgb_array",)
CLEARANCE = "clearance"
CLEARANCE_REACH_M = 5.0
LEAST_PX, MOST_PX = 8, 4_096


def opened_room(room: RoomSource, seed: int, *, small: bool, loose: bool) -> LiveRoom:
    """The room of a name, a scene, a scene's file or a MuJoCo model's, in some seconds; a `LiveRoom` as it is.

    Args:
        room: the name, the scene, the file or the room.
        seed: of a room by name.
        small: for small pictures, see `live_room`.
        loose: things in it can be moved.

    Raises:
        EnvError: there is no such room.
        SceneError: the file is no scene, or its room cannot be built.
    """
    if isinstance(room, LiveRoom):
        return room
    if isinstance(room, Scene):
        return live_room(room, small=small, loose=loose)
    if isinstance(room, str) and room in ROOM_NAMES:
        if not isinstance(seed, (int, np.integer)) or seed < 0:
            raise EnvError(f"room_seed={seed!r}: expected a whole number from 0 on")
        return live_room_named(room, int(seed), small=small, loose=loose)
    if not isinstance(room, (str, Path)):
        kinds = "a room's name, a scene file or a scene, or a MuJoCo model's file"
        raise EnvError(f"room={room!r:.80}: expected {kinds}. Rooms: {', '.join(ROOM_NAMES)}")
    if isinstance(room, str) and not Path(room).suffix and not Path(room).exists():
        told = f"room={room!r:.80} is unknown.{did_you_mean(room, ROOM_NAMES)}"
        raise EnvError(f"{told} Use one of {', '.join(ROOM_NAMES)}, or a scene file")
    if Path(room).suffix.lower() in MODEL_SUFFIXES:
        from clearway.live.model_room import live_model

        return live_model(Path(room))
    if Path(room).suffix.lower() in PLAN_SUFFIXES:
        remedy = f"Import it with clearway scenes import floor-plan {room} --out scenes, and name the file in scenes"
        raise EnvError(f"room='{room}': a floor plan, no scene yet. {remedy}")
    return live_room(scene_of_file(room), small=small, loose=loose)


def checked_sensors(names: Sequence[str], height_px: int, width_px: int) -> tuple[Sensor, ...]:
    """What the agent sees by: cameras, and the clearance.

    Raises:
        EnvError: a name is unknown or occurs twice, there is no camera, or the size is none.
    """
    for name, pixels in (("height_px", height_px), ("width_px", width_px)):
        if not isinstance(pixels, (int, np.integer)) or not LEAST_PX <= pixels <= MOST_PX:
            raise EnvError(f"{name}={pixels!r}: expected a whole number from {LEAST_PX} to {MOST_PX}")
    if isinstance(names, str) or not isinstance(names, Sequence) or not names:
        raise EnvError(f"sensors={names!r:.80}: expected names, each once, such as ('rgb', 'depth')")
    known = (*SENSORS, CLEARANCE)
    for name in names:
        if name not in known:
            raise EnvError(f"sensors: there is no {name!r:.40}. Choose among {', '.join(known)}")
    if len(set(names)) < len(names) or set(names) <= {CLEARANCE}:
        raise EnvError(f"sensors={tuple(names)!r}: expected each once, and a camera among them, such as ('rgb',)")
    clearance = Sensor(CLEARANCE, (1,), "float32", "m", 0, CLEARANCE_REACH_M)
    return tuple(clearance if name == CLEARANCE else SENSORS[name](height_px, width_px) for name in names)


def checked_perturbations(wanted: PerturbationSource) -> Perturbations:
    """The perturbations themselves, or those of a mapping; none for None.

    Raises:
        EnvError: a name is unknown, or a strength is no number or too large.
    """
    if wanted is None:
        return Perturbations()
    if not isinstance(wanted, (Perturbations, Mapping)):
        raise EnvError(f"perturbations={wanted!r:.80}: expected strengths by name, such as {{'angle_noise': 5.0}}")
    known = {field.name for field in fields(Perturbations)}
    values = wanted.to_json() if isinstance(wanted, Perturbations) else dict(wanted)
    for name, value in values.items():
        if name not in known:
            raise EnvError(f"perturbations: there is no {name!r:.40}. Choose among {', '.join(sorted(known))}")
        if name in MOST and not (_is_number(value) and 0 <= value <= MOST[name]):
            raise EnvError(f"perturbations: {name}={value!r:.40}, expected a number from 0 to {MOST[name]:g}")
        if name not in MOST and not isinstance(value, (bool, np.bool_)):
            raise EnvError(f"perturbations: {name}={value!r:.40}, expected True or False")
    return Perturbations(**values)


def checked_number(name: str, value: float, most: float) -> float:
    """A number above 0 and at most `most`; EnvError where it is none."""
    if not _is_number(value) or not 0 < value <= most:
        raise EnvError(f"{name}={value!r:.40}: expected a number above 0, at most {most:g}")
    return float(value)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def checked_drives(actions: np.ndarray, env_count: int) -> np.ndarray:
    """Speeds and turn rates, (env_count, 2) float64 within -1 and 1; EnvError where they are none."""
    drives = as_array(actions)
    if drives.dtype.kind not in "fiu" or drives.shape != (env_count, 2):
        found = f"{drives.dtype} of shape {drives.shape}"
        raise EnvError(f"actions: expected speed and turn rate, shape ({env_count}, 2), found {found}")
    if not np.isfinite(drives).all():
        raise EnvError("actions: expected finite numbers, found NaN or Inf")
    return np.clip(drives.astype(np.float64), -1, 1)


def checked_ends(option: str, value: object, env_count: int) -> list[int | tuple[float, float, float]]:
    """A start or target for each environment: states of the scene, or poses (x, z in metres, heading in degrees).

    Raises:
        EnvError: the option is neither, for all environments or for each.
    """
    ends = as_array(value)
    whole = np.issubdtype(ends.dtype, np.integer)
    if whole and ends.shape in ((), (env_count,)):
        return [int(state) for state in np.broadcast_to(ends, env_count)]
    if ends.dtype.kind in "iuf" and ends.shape in ((3,), (env_count, 3)) and np.isfinite(ends).all():
        poses = np.broadcast_to(ends.astype(float), (env_count, 3))
        return [(x_m, z_m, math.fmod(heading_deg, 360) % 360) for x_m, z_m, heading_deg in poses.tolist()]
    expected = f"a state or a pose (x, z, heading), or one for each of the {env_count}"
    raise EnvError(f"options['{option}']: expected {expected}, got {value!r:.80}")


def check_switches(continuous: bool, stop: bool, render_mode: str | None, sensors: Sequence[Sensor]) -> None:
    """Raise EnvError where one of them is of another kind, or two do not go together."""
    check_switch("continuous", continuous)
    check_switch("stop", stop)
    if continuous and stop:
        raise EnvError("stop=True is a fifth discrete action. Leave out stop or continuous")
    if render_mode is not None and render_mode not in LIVE_RENDER_MODES:
        raise EnvError(f"render_mode={render_mode!r:.40} is unknown. Use {LIVE_RENDER_MODES[0]!r}, or None")
    if render_mode is not None and RGB not in [sensor.name for sensor in sensors]:
        raise EnvError(f"render_mode={render_mode!r} shows colour pictures. Name {RGB!r} among the sensors")


def check_workers(workers: int | None) -> None:
    """Raise EnvError where it is no number of renderer processes."""
    if workers is not None and (isinstance(workers, bool) or not isinstance(workers, (int, np.integer)) or workers < 1):
        raise EnvError(f"workers={workers!r:.40}: expected a whole number from 1 on, or None for one a core")


def checked_targets(targets: Sequence[int] | str | None) -> np.ndarray | None:
    """State ids, (T,) int64, or None as it is; EnvError where they are none."""
    if targets is None:
        return None
    found = as_array(targets)
    if found.ndim != 1 or not len(found) or not np.issubdtype(found.dtype, np.integer):
        raise EnvError(f"targets={targets!r:.80}: expected state ids, such as [26, 37]")
    return found.astype(np.int64)
