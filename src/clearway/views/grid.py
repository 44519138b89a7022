"""Takes of a scene's grid: several pictures of every pose, each under a perturbation of its own.

The room is built again, and pictures are taken as the scene's own were. Its moves stay those of the grid, wherever a
take shows its furniture. Takes are kept in the user's cache folder, 37 KB a picture of 96 x 128 pixels.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from dataclasses import replace

import numpy as np

from clearway import live, views
from clearway.errors import RenderError
from clearway.live.conditions import Perturbations
from clearway.live.live_room import LiveRoom, check_is_room, live_room
from clearway.perception.cache import Entry, cached, joint_key
from clearway.rooms.build import check_mujoco, shaping_versions
from clearway.rooms.detail import taken_fast
from clearway.rooms.library import sources_hash
from clearway.rooms.render import render
from clearway.rooms.render_worker import renderer_environment
from clearway.scenes.scene import Scene
from clearway.scenes.sensors import RGB
from clearway.spread.workers import Work, core_count, workers_for
from clearway.views.placing import STATES, PlacedTake, TakePlaces, rearranges, stream, take_seeds
from clearway.views.settings import ViewSettings
from clearway.views.shard import room_key

CACHE = "takes"
THREADS = 1  # of each worker
AHEAD = 1  # scenes that wait for each worker, beside the one that it takes

Asked = tuple[Scene, ViewSettings]
"""A scene without its pictures, and which takes of it are asked for."""


def grid_takes(
    scenes: Sequence[Scene],
    perturbations: Perturbations,
    *,
    takes: int,
    seed: int = 0,
    workers: int | None = None,
    done: Callable[[int], object] = lambda count: None,
) -> Iterator[np.ndarray]:
    """Takes of each scene's poses in turn, (S, K, height, width, 3) uint8, of the size of its own pictures.

    A pose's takes follow from the scene, the pose, `perturbations`, `takes` and `seed` alone.

    Args:
        scenes: with colour pictures, of rooms that can be built again.
        perturbations: how strong they are.
        takes: K, of each pose.
        seed: of all chances.
        workers: processes, a room at a time each; None: one a core.
        done: is told how many scenes are taken.

    Raises:
        ArgumentError: there are no such takes.
        SceneError: a scene has no pictures or no room that can be built again, or nothing in it that could be moved.
        RenderError: rendering is not possible here, or a worker died.
        EncoderError: the cache folder cannot be written to.
    """
    asked = [(_bare(scene), grid_settings(scene, perturbations, takes, seed)) for scene in scenes]
    for scene, settings in asked:
        check_is_room(scene)
        settings.check()
    check_mujoco()
    environment = {**renderer_environment(THREADS), "OMP_NUM_THREADS": str(THREADS)}
    work = Work(_shaped_by, _kept, _died, environment=environment, keeps_messages=True)
    count = min(workers or core_count(), len(scenes))
    under_way: deque[Future[np.ndarray]] = deque()
    with workers_for(work, workers=count) as crew:
        for number, part in enumerate(asked):
            under_way.append(crew.submit(part))
            if number >= AHEAD * count:  # what is taken and not yet asked for is in memory
                yield under_way.popleft().result()
                done(number + 1 - len(under_way))
        while under_way:
            yield under_way.popleft().result()
            done(len(asked) - len(under_way))


def grid_settings(scene: Scene, perturbations: Perturbations, takes: int, seed: int) -> ViewSettings:
    """Which pictures the takes of a scene's grid are. Raises SceneError where the scene has no colour pictures."""
    height_px, width_px = scene.seen_by(RGB).shape[1:3]
    size_px = (height_px, width_px)
    return ViewSettings(scene.state_count, takes, seed, perturbations, size_px=size_px, scene_headings=True)


def take_grid(scene: Scene, settings: ViewSettings) -> np.ndarray:
    """Build a scene's room and take its grid here, (S, K, height, width, 3); this process needs `renderer_environment`.

    Raises:
        SceneError: the scene's room cannot be built again, or nothing in it can be moved.
        RenderError: this machine cannot render.
    """
    room = live_room(scene, loose=rearranges(settings.perturbations))
    placed = placed_takes(room, settings)
    lens = room.lens(*settings.size_px, fast=taken_fast(scene.made_by.notes))
    view = replace(lens, shots=tuple(one.shot for one in placed))
    pictures = render(room.model, view, here=True)
    for number, one in enumerate(placed):
        pictures[number] = one.draws.seen(pictures[number])
    return pictures.reshape(-1, settings.takes, *pictures.shape[1:])


def placed_takes(room: LiveRoom, settings: ViewSettings) -> list[PlacedTake]:
    """The takes of a room's grid, pose after pose. Raises SceneError where furniture is to be moved and cannot be."""
    places = TakePlaces(room, np.unique(room.scene.locations_m, axis=0), settings)
    found = []
    for state in range(room.scene.state_count):
        seeds = take_seeds(stream(room, settings, STATES, state), settings)
        found += [places.placed(room.pose_of(state), state, take, seed) for take, seed in enumerate(seeds)]
    return found


def _shaped_by() -> list[object]:
    """What pictures follow from besides scene and settings."""
    return [shaping_versions(), sources_hash(live, views)]


def _kept(shaped_by: list[object], asked: Asked) -> np.ndarray:
    """The takes of a scene from the user's cache, taken where they are not there."""
    scene, settings = asked
    key = joint_key(room_key(scene), settings.to_json(), shaped_by)
    return cached(CACHE, key, lambda: Entry({RGB: take_grid(scene, settings)})).arrays[RGB]


def _bare(scene: Scene) -> Scene:
    """A scene without what a worker that builds its room need not be sent."""
    return replace(scene, observations=None, features=None, encoder=None, top_view=None, further=())


def _died(asked: Asked, how: str) -> RenderError:
    remedy = "Run the command again: what is taken is kept"
    return RenderError(f"scene {asked[0].name}: the process that took its perturbed pictures {how}. {remedy}")
