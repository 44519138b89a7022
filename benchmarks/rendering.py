"""What rooms and pictures cost: seconds to build and light a floor plan's room, pictures a second, and what they go to.

    export MUJOCO_GL=egl LP_NUM_THREADS=1 OMP_NUM_THREADS=1
    python benchmarks/rendering.py
    python benchmarks/rendering.py --sizes 96x128 --json

Milliseconds and seconds are processor time, of processes of one thread each, the median of `--repeats` measured in
turn with the others: other programs disturb them less than they disturb a clock. So are the pictures a second, of one
process and of two that run side by side (the sum). MiniWorld is measured where it is installed
(`pip install 'clearway[miniworld]'`), else left out.

    build        layout, textures, furniture
    bake         the light: rays, light maps, colours of furniture
    compile      MuJoCo's compiler
    hall         a plan of 85 cells; a room, a flat: the first ones of `clearway scenes generate --split train --seed 0`
    full, small  the room's `Detail`;  fast: `View.fast`
    update, render, read, rest   mjv_updateScene, mjr_render, mjr_readPixels (Mesa's software rasteriser fills triangles
                 only when somebody asks for pixels: "read" is most of the drawing), Python and numpy
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from multiprocessing import Queue, get_context
from multiprocessing.synchronize import Barrier
from typing import Any

import mujoco
import numpy as np

from clearway.choices import PlanKind
from clearway.generation.plans import generated_plan
from clearway.generation.request import Request
from clearway.rooms import camera
from clearway.rooms.camera import View, first_person_view
from clearway.rooms.detail import FULL, SMALL, Detail
from clearway.rooms.plans import plan_room
from clearway.rooms.plans.plan_room import build_plan_room
from clearway.rooms.render_worker import binary_model, model_of_binary
from clearway.rooms.taking import SPARE_GEOMS, _free_camera, take_pictures
from clearway.scenes.floor_plans import FloorPlan

HALL = (
    "..........####",
    "..........####",
    "..##......####",
    "..##......####",
    "..............",
    "......###.....",
    "......###.....",
    "#.............",
)
DETAILS = {"full": FULL, "small": SMALL}
WAYS = (("full", False), ("full", True), ("small", False), ("small", True))
CUBE_HEADINGS = 12
Row = dict[str, float]


def hall() -> FloorPlan:
    """85 cells of half a metre."""
    reachable = (np.array([list(line) for line in HALL]) == ".")[::-1].T
    return FloorPlan.of_map("hall", reachable, np.empty((0, 2, 2), np.int64), cell_size_m=0.5)


def used(work: Callable[[], object]) -> float:
    """Processor seconds of some work."""
    begun = time.process_time()
    work()
    return time.process_time() - begun


def medians(rows: Sequence[Row]) -> Row:
    return {key: statistics.median(row[key] for row in rows) for key in rows[0]}


def plans_of(number: int) -> dict[str, FloorPlan]:
    """The hall, and a generated room and flat."""
    kinds: tuple[PlanKind, ...] = ("room", "flat")
    return {"hall": hall(), **{f"a {kind}": generated_plan(Request(kind, "train", 0, number)) for kind in kinds}}


def build_costs(detail: Detail, plan: FloorPlan, seed: int) -> Row:
    """Seconds of each stage of one room."""
    spent, bake = [], plan_room.bake
    plan_room.bake = lambda room, **options: spent.append(used(lambda: bake(room, **options)))
    made = []
    try:
        whole = used(lambda: made.append(build_plan_room(plan, seed, detail=detail)))
    finally:
        plan_room.bake = bake
    compiled = used(lambda: made[0][0].spec.compile())
    return {"build": whole - spent[0], "bake": spent[0], "compile": compiled, "all": whole + compiled}


def rooms_of(seed: int) -> dict[str, bytes]:
    return {
        name: binary_model(build_plan_room(hall(), seed, detail=d)[0].spec.compile()) for name, d in DETAILS.items()
    }


def view_of(size: tuple[int, int], count: int, seed: int = 1, fast: bool = False) -> View:
    """Pictures from random cells, headings in steps of 90 degrees."""
    rng, plan = np.random.default_rng(seed), hall()
    origin_m = np.array(build_plan_room(plan, seed, looks=False)[1].origin_m)
    places_m = (plan.cells * plan.cell_size_m - origin_m)[rng.integers(len(plan.cells), size=count)]
    return first_person_view(
        places_m, rng.choice([0, 90, 180, 270], count), height_px=size[0], width_px=size[1], fast=fast
    )


def picture_ms(room: bytes, view: View) -> float:
    """Processor milliseconds a picture; the first, which compiles shaders, does not count."""
    taking = pictures_of(room, view)
    next(taking)
    return 1000 * used(lambda: [None for _ in taking]) / len(view.shots)


class Stages:
    """A picture as `take_pictures` takes it, with the time of each step, and one thing changed."""

    def __init__(self, room: bytes, view: View, samples: int = 4, flags: dict | None = None, **change: float) -> None:
        self.model, self.view, self.change = model_of_binary(room), view, change
        self.model.vis.quality.offsamples = samples
        lens = self.model.vis.global_
        lens.offheight, lens.offwidth, lens.fovy = view.height_px, view.width_px, view.vertical_extent
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self.shown = mujoco.MjvOption()
        self.shown.geomgroup[:] = 0
        self.shown.geomgroup[list(view.groups)] = 1
        if change.get("textures") == 0:
            self.shown.flags[mujoco.mjtVisFlag.mjVIS_TEXTURE] = 0
        if "shrink" in change:
            shrink_textures(self.model, int(change["shrink"]))
        self.flags = {mujoco.mjtRndFlag.mjRND_SHADOW: 0, **(flags or {})}

    def costs(self) -> Row:
        """Milliseconds a picture."""
        view, spent = self.view, np.zeros(4)
        box = mujoco.MjrRect(0, 0, view.width_px, view.height_px)
        out = np.empty((view.height_px, view.width_px, 3), np.uint8)
        spare = self.model.ngeom + SPARE_GEOMS
        with mujoco.Renderer(self.model, view.height_px, view.width_px, max_geom=spare) as renderer:
            for flag, value in self.flags.items():
                renderer.scene.flags[flag] = value
            context = renderer._mjr_context
            for number, shot in enumerate((view.shots[0], *view.shots)):
                times = [time.process_time()]
                renderer.update_scene(self.data, _free_camera(shot, False), self.shown)
                renderer.scene.nlight = min(renderer.scene.nlight, int(self.change.get("lights", 99)))
                times.append(time.process_time())
                mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, context)
                mujoco.mjr_render(box, renderer.scene, context)
                times.append(time.process_time())
                mujoco.mjr_readPixels(out, None, box, context)
                times.append(time.process_time())
                np.flipud(out).copy()
                times.append(time.process_time())
                spent += np.diff(times) * (number > 0)
        update, drawn, read, rest = (1000 * spent / len(view.shots)).tolist()
        return {"update": update, "render": drawn, "read": read, "rest": rest, "all": update + drawn + read + rest}


def shrink_textures(model: mujoco.MjModel, by: int) -> None:
    """Every texture at 1 / by of its width and height."""
    for number in range(model.ntex):
        rows, columns, first = model.tex_height[number], model.tex_width[number], model.tex_adr[number]
        image = model.tex_data[first : first + rows * columns * 3].reshape(rows, columns, 3)[::by, ::by].copy()
        model.tex_height[number], model.tex_width[number] = image.shape[:2]
        model.tex_data[first : first + image.size] = image.ravel()


def what_costs(rooms: dict[str, bytes], view: View, repeats: int) -> dict[str, Row]:
    """One picture's stages, with one thing changed at a time."""
    no_walls = replace(view, groups=(camera.CEILING_GROUP,))
    ways: dict[str, Callable[[], Row]] = {
        "as it is": Stages(rooms["full"], view).costs,
        "1 sample a pixel": Stages(rooms["full"], view, 0).costs,
        "2 samples": Stages(rooms["full"], view, 2).costs,
        "no shadows anyway; with": Stages(rooms["full"], view, flags={mujoco.mjtRndFlag.mjRND_SHADOW: 1}).costs,
        "no reflections": Stages(rooms["full"], view, flags={mujoco.mjtRndFlag.mjRND_REFLECTION: 0}).costs,
        "headlight only": Stages(rooms["full"], view, lights=1).costs,
        "no textures": Stages(rooms["full"], view, textures=0).costs,
        "textures a quarter": Stages(rooms["full"], view, shrink=4).costs,
        "coarse meshes, blocks": Stages(rooms["small"], view).costs,
        "ceiling and lamps only": Stages(rooms["full"], no_walls).costs,
    }
    taken = defaultdict(list)
    for _ in range(repeats):
        for name, costs in ways.items():
            taken[name].append(costs())
    return {name: medians(rows) for name, rows in taken.items()}


def cube_costs(room: bytes, size: tuple[int, int], places: int = 12) -> Row:
    """Pictures cut from four square pictures of 90 degrees all around a place, beside those rendered one by one."""
    side = round(size[0] / np.tan(np.radians(camera.VERTICAL_FOV_DEG / 2)))  # as many pixels a degree, ahead
    side += side % 2
    some = view_of(size, places)
    around = [camera.Shot(shot.look_at_m, 1.0, azimuth, 0.0) for shot in some.shots for azimuth in (90, 0, -90, -180)]
    around = [
        replace(shot, look_at_m=ahead_of(eye_of(one), shot.azimuth_deg))
        for one, shot in ((some.shots[n // 4], shot) for n, shot in enumerate(around))
    ]
    turned = [
        camera.Shot(ahead_of(eye_of(shot), 90 - heading), 1.0, 90 - heading, 0.0)
        for shot in some.shots
        for heading in np.arange(CUBE_HEADINGS) * 360 / CUBE_HEADINGS
    ]
    faces_view = View(tuple(around), side, side, 90.0, False, some.groups)
    direct_view = replace(some, shots=tuple(turned))
    faces = np.array([p.copy() for p in take_pictures(model_of_binary(room), faces_view, around)])
    direct = np.array([p.copy() for p in take_pictures(model_of_binary(room), direct_view, turned)])
    cuts = [cut_of(heading, size, side) for heading in np.arange(CUBE_HEADINGS) * 360 / CUBE_HEADINGS]
    cut = np.array([cut_out(faces[4 * p : 4 * p + 4], where) for p in range(places) for where in cuts])
    per_place = picture_ms(room, faces_view) * 4
    cutting = 1000 * used(lambda: [cut_out(faces[:4], where) for where in cuts]) / len(cuts)
    return {
        "four faces": per_place,
        "a cut": cutting,
        "12 headings": per_place / CUBE_HEADINGS + cutting,
        "one by one": picture_ms(room, direct_view),
        "difference": float(np.abs(cut.astype(int) - direct).mean()),
    }


def eye_of(shot: camera.Shot) -> np.ndarray:
    azimuth = np.radians(shot.azimuth_deg)
    return np.array(shot.look_at_m) - np.array([np.cos(azimuth), np.sin(azimuth), 0.0])


def ahead_of(eye_m: np.ndarray, azimuth_deg: float) -> tuple[float, float, float]:
    azimuth = np.radians(azimuth_deg)
    x, y, z = eye_m + np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    return float(x), float(y), float(z)


def cut_of(heading_deg: float, size: tuple[int, int], side: int) -> tuple[np.ndarray, ...]:
    """Face, row, column (float) of each pixel of a level picture; faces look along 0, 90, 180 and 270 degrees."""
    rows, columns = size
    slope = np.tan(np.radians(camera.VERTICAL_FOV_DEG / 2))
    across = ((np.arange(columns) + 0.5) / columns * 2 - 1) * slope * columns / rows
    down = ((np.arange(rows) + 0.5) / rows * 2 - 1)[:, None] * slope
    angle = np.radians(heading_deg) + np.arctan(across)
    face = np.round(angle / (np.pi / 2)).astype(int)
    off = angle - face * np.pi / 2
    depth = np.cos(off) * np.hypot(1, across)
    x = np.broadcast_to((np.tan(off) + 1) / 2 * side - 0.5, (rows, columns))
    y = (down / depth + 1) / 2 * side - 0.5
    return np.broadcast_to(face % 4, (rows, columns)), np.clip(y, 0, side - 1.001), np.clip(x, 0, side - 1.001)


def cut_out(faces: np.ndarray, where: tuple[np.ndarray, ...]) -> np.ndarray:
    """A picture from its places in the faces, linear between pixels."""
    face, y, x = where
    top, left = y.astype(int), x.astype(int)
    v, u = (y - top)[..., None].astype(np.float32), (x - left)[..., None].astype(np.float32)
    above = faces[face, top, left] * (1 - u) + faces[face, top, left + 1] * u
    below = faces[face, top + 1, left] * (1 - u) + faces[face, top + 1, left + 1] * u
    return (above * (1 - v) + below * v + 0.5).astype(np.uint8)


def take_all(taking: Callable[[], Iterator[object]], ready: Barrier, seconds: Queue) -> None:
    """One of the processes that render side by side; sends its pictures a processor second."""
    pictures = taking()
    next(pictures)  # compiles shaders
    ready.wait()
    begun = time.process_time()
    count = sum(1 for _ in pictures)
    seconds.put(count / (time.process_time() - begun))


def two_processes(taking: Callable[[], Iterator[object]]) -> float:
    """Pictures a second of two processes that begin together, by what each uses of the processor."""
    context = get_context("spawn")
    ready, seconds = context.Barrier(2), context.Queue()
    crew = [context.Process(target=take_all, args=(taking, ready, seconds), daemon=True) for _ in range(2)]
    for process in crew:
        process.start()
    rates = [seconds.get(timeout=300) for _ in crew]
    for process in crew:
        process.join(30)
    return sum(rates)


def pictures_of(room: bytes, view: View) -> Iterator[object]:
    """A room's pictures one by one, the first of them twice."""
    return take_pictures(model_of_binary(room), view, (view.shots[0], *view.shots))


def miniworld_pictures(size: tuple[int, int], count: int) -> Iterator[object]:
    """MiniWorld's pictures of its four rooms, and one more before them."""
    import pyglet

    pyglet.options["headless"] = True
    import gymnasium
    import miniworld  # noqa: F401

    world = gymnasium.make("MiniWorld-FourRooms-v0", obs_height=size[0], obs_width=size[1])
    world.reset(seed=0)
    shoot: Any = world.unwrapped
    for number in range(count + 1):
        shoot.agent.dir = number * 0.7
        yield shoot.render_obs()


def miniworld_row(size: tuple[int, int], count: int) -> Row | None:
    """What MiniWorld's pictures cost; None where it is not installed."""
    try:
        taking = miniworld_pictures(size, count)
        next(taking)
    except Exception as error:
        print(f"MiniWorld left out: {type(error).__name__}", file=sys.stderr)
        return None
    ms = 1000 * used(lambda: [None for _ in taking]) / count
    many = two_processes(partial(miniworld_pictures, size, count))
    return {"ms": ms, "pictures/s": 1000 / ms, "2 processes/s": many}


def sizes(words: Sequence[str]) -> Iterator[tuple[int, int]]:
    for word in words:
        rows, columns = word.split("x")
        yield int(rows), int(columns)


def table(title: str, rows: dict[str, Row], digits: int) -> str:
    heads = list(next(iter(rows.values())))
    lines = [title, " " * 28 + "".join(f"{head:>13}" for head in heads)]
    lines += [f"{name:28}" + "".join(f"{row[head]:>13.{digits}f}" for head in heads) for name, row in rows.items()]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", nargs="+", default=["96x128", "150x200", "300x400"], help="rows x columns")
    parser.add_argument("--pictures", type=int, default=100, help="of a measurement")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1, help="of the room")
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")
    options = parser.parse_args()
    if missing := [name for name in ("LP_NUM_THREADS", "OMP_NUM_THREADS") if os.environ.get(name) != "1"]:
        parser.error(f"set {' and '.join(missing)} to 1, or processes disturb each other")
    built = defaultdict(list)
    build_costs(FULL, hall(), options.seed)
    for number in range(options.repeats):
        for title, plan in plans_of(number).items():
            for name, detail in DETAILS.items():
                built[f"{title}, {name}"].append(build_costs(detail, plan, options.seed + number))
    rooms = rooms_of(options.seed)
    pictures: dict[str, Row] = {}
    for size in sizes(options.sizes):
        views = {fast: view_of(size, options.pictures, fast=fast) for fast in (False, True)}
        taken = defaultdict(list)
        for _ in range(options.repeats):
            for room, fast in WAYS:
                ms = picture_ms(rooms[room], views[fast])
                taken[room, fast].append({"ms": ms, "pictures/s": 1000 / ms})
        for room, fast in WAYS:
            label = f"{size[0]} x {size[1]} {room}{', fast' if fast else ''}"
            many = two_processes(partial(pictures_of, rooms[room], views[fast]))
            pictures[label] = {**medians(taken[room, fast]), "2 processes/s": many}
        worlds = miniworld_row(size, options.pictures)
        if worlds is not None:
            pictures[f"{size[0]} x {size[1]} MiniWorld"] = worlds
    smallest = next(sizes(options.sizes))
    report = {
        "seconds": {name: medians(rows) for name, rows in built.items()},
        "pictures": pictures,
        "what costs": what_costs(rooms, view_of(smallest, options.pictures), options.repeats),
        "cut from a cube": {f"{smallest[0]} x {smallest[1]}": cube_costs(rooms["full"], smallest)},
    }
    machine = {"cores": os.cpu_count(), "load": os.getloadavg()[0], "mujoco": mujoco.__version__}
    if options.json:
        print(json.dumps({**machine, **report}, indent=2))
        return
    print(f"{machine['cores']} cores, load {machine['load']:.1f} at the end, MuJoCo {machine['mujoco']}\n")
    print(table("seconds of the processor, a hall of 85 cells, rooms and flats as generated", report["seconds"], 2))
    print(table("pictures", report["pictures"], 2))
    print(table(f"milliseconds of a picture of {smallest[0]} x {smallest[1]}", report["what costs"], 2))
    print(table("milliseconds, pictures cut from four faces", report["cut from a cube"], 2))


if __name__ == "__main__":
    main()
