"""A small MuJoCo model to walk in: a wall half across, a mesh, what is only seen, and a barrel on a joint."""

from __future__ import annotations

from pathlib import Path

from clearway.importers.mjcf_floor import FloorChoice
from clearway.rooms.obstacles import AgentShape

SPIKE = "v 0 0 0\nv .6 0 0\nv 0 .6 0\nv 0 0 2\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
MODEL = """<mujoco><visual><headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/></visual>
<asset><mesh name="spike" file="spike.obj"/></asset><worldbody>
  <geom name="floor" type="{floor}" size="{size}" pos="0 0 {down}" rgba=".5 .5 .5 1"/>
  <geom type="box" size=".1 1.9 1" pos="0 1.9 2" rgba=".9 .1 .1 1"/>
  <geom type="mesh" mesh="spike" pos="1.1 1.1 1" rgba=".1 .9 .1 1"/>
  <geom type="box" size=".3 .3 1" pos="-1.5 -1.5 2" contype="0" conaffinity="0" rgba=".1 .1 .9 1"/>
  <body pos="-1 2.7 1.5" euler="0 0 30"><freejoint/><geom type="cylinder" size=".25 .5" rgba=".9 .9 .1 1"/></body>
</worldbody></mujoco>"""  # the floor is 1 m up
PLANE = {"floor": "plane", "size": "0 0 1", "down": 1}
SLAB = {"floor": "box", "size": "2.1 3.3 .1", "down": 0.9}
CHOICE = FloorChoice(floor_m=1.0, camera_m=0.8, spawn_m=(-1.0, -2.0), extent_m=(-2.5, 2.5, -3.5, 3.5))
AGENT = AgentShape(step_m=1.0)


def written(folder: Path, floor: dict[str, object]) -> Path:
    """The model's file, with its mesh beside it, on a floor that is a `PLANE` or a `SLAB`."""
    (folder / "spike.obj").write_text(SPIKE)
    path = folder / "hall.xml"
    path.write_text(MODEL.format(**floor))
    return path
