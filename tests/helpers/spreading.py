"""Files for commands that spread their work over processes: enough of it that they can be met while they work."""

from __future__ import annotations

import subprocess
import sys
from itertools import product
from pathlib import Path

import numpy as np
from PIL import Image

from clearway.scenes.thor_v1 import write_scene
from clearway.views.settings import ViewSettings
from helpers.made import grid_scene
from helpers.made_views import write_made
from helpers.small_setting import small_rooms


def rooms(folder: Path) -> list[str]:
    """Two scene files."""
    for scene in small_rooms():
        write_scene(scene, folder / f"{scene.name}.h5")
    return [str(path) for path in sorted(folder.glob("*.h5"))]


def folder_of(files: list[str]) -> str:
    return str(Path(files[0]).parent)


def model(folder: Path) -> str:
    """A MuJoCo model that takes a while."""
    boxes = "".join(f'<geom type="box" size=".1 .1 .1" pos="{i * 0.3} 3 .1"/>' for i in range(20))
    path = folder / "hall.xml"
    path.write_text(
        f'<mujoco><worldbody><geom type="plane" size="4 4 .1"/>{boxes}<light pos="0 0 4"/></worldbody></mujoco>'
    )
    return str(path)


def generated(folder: Path) -> str:
    """A generated room, which views can be taken of."""
    command = [sys.executable, "-m", "clearway", "scenes", "generate", "--encoder", "none"]
    subprocess.run([*command, "--workers", "1", "--out", str(folder / "rooms")], check=True, capture_output=True)
    return str(folder / "rooms")


def exported(folder: Path) -> str:
    """An exported agent, whose graph runs in a process of its own."""
    path = str(folder / "generalist.onnx")
    command = [sys.executable, "-m", "clearway", "export", "generalist", "--out", path]
    subprocess.run(command, check=True, capture_output=True)
    return path


def textured(folder: Path) -> str:
    """A model whose texture takes a second to make and compile."""
    path = folder / "bomb.xml"
    texture = '<texture name="t" type="2d" builtin="checker" width="10000" height="10000"/>'
    path.write_text(f"<mujoco><asset>{texture}</asset></mujoco>")
    return str(path)


def unencoded(folder: Path) -> list[str]:
    """Two scenes with many pictures."""
    for number in range(2):
        write_scene(grid_scene(number, width=8, depth=8, picture_size=(96, 128)), folder / f"{number}.h5")
    return [str(path) for path in sorted(folder.glob("*.h5"))]


def plan(folder: Path) -> str:
    """A floor plan of a hall."""
    path = folder / "hall.txt"
    path.write_text("......\n" * 6)
    return str(path)


def photographs(folder: Path) -> str:
    """A table of a grid of places, four photographs each."""
    noise, lines = np.random.default_rng(0), ["file,x,z,heading"]
    for x, z, heading in product(range(12), range(12), (0, 90, 180, 270)):
        name = f"{x}-{z}-{heading}.png"
        Image.fromarray(noise.integers(0, 256, (96, 128, 3), np.uint8)).save(folder / name)
        lines.append(f"{name},{x / 2},{z / 2},{heading}")
    path = folder / "office.csv"
    path.write_text("\n".join(lines))
    return str(path)


def views(folder: Path) -> str:
    """A folder of views of three rooms, of the size that eyes are taught on."""
    kept = ViewSettings(poses=40, takes=2, sensors=("rgb", "depth"))
    for room in range(3):
        write_made(folder / "views", f"room{room}", kept, seed=room)
    return str(folder / "views")
