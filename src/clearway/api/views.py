"""`take_views`, `open_views`: pictures of rooms from random free poses, for what learns to see."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from clearway.api.arguments import as_path, as_paths, as_size, as_truth, as_whole
from clearway.errors import ArgumentError
from clearway.scenes.scene_files import scene_files
from clearway.scenes.sensors import RGB, check_names

if TYPE_CHECKING:
    from clearway.views.stream import Views


def take_views(
    scenes: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    *,
    out: str | os.PathLike[str],
    poses: int = 400,
    takes: int | None = None,
    perturb: Sequence[str] = ("geometry",),
    sensors: Sequence[str] = (RGB,),
    size: Sequence[int] = (96, 128),
    seed: int = 0,
    held_out: bool = False,
    scene_headings: bool = False,
    compress: bool = False,
    workers: int | None = None,
    ray: str | None = None,
    show_progress: bool = False,
) -> list[Path]:
    """Pictures of rooms from random free poses, a file a room; the files, made or there. `open_views` reads them.

    What is in the folder already is checked and not made again, so an interrupted call goes on.

    Args:
        scenes: scene files of generated rooms, of floor plans or of our own rooms; a file, a folder, or several.
        out: folder for the files, each named after its scene.
        poses: of each room, where the body touches nothing.
        takes: pictures of each pose, each perturbed in its own way; None: 2, and 1 without perturbations.
        perturb: what differs between takes, and how strongly: "all", "geometry" (all but light and pixel noise, which
            can be added to pictures later), "none", names such as "light", or "light=0.2".
        sensors: what takes the pictures: ("rgb",), or ("rgb", "depth") for depth in metres beside them.
        size: height and width of the pictures.
        seed: another one gives other poses and perturbations.
        held_out: poses at held-out cells alone, for evaluation; else at all others.
        scene_headings: the headings of the scene alone; else any.
        compress: files of half the size, which are read at some quarter of the speed.
        workers: processes, each of which does whole rooms; None: one a core.
        ray: a Ray cluster that makes them: "local", "auto" or an address. Its nodes see all files under their paths.
        show_progress: draw a progress bar, if standard error is a terminal.

    Raises:
        ArgumentError: an argument is of the wrong kind or out of range.
        ClearwayError: a scene is no room that can be built again, a file in the folder is damaged or not what is asked
            for, the disk is full, or rendering cannot be had here.
    """
    from clearway.live.conditions import Perturbations
    from clearway.live.words import perturbations_named
    from clearway.progress import work_progress
    from clearway.ray_cluster import kept_connected
    from clearway.views.files import shard_path, take_missing
    from clearway.views.settings import ViewSettings

    perturbations = perturbations_named(perturb)
    check_names(sensors)
    often = 1 if perturbations == Perturbations() else 2
    settings = ViewSettings(
        poses=as_whole("poses", poses),
        takes=often if takes is None else as_whole("takes", takes),
        seed=as_whole("seed", seed),
        perturbations=perturbations,
        sensors=tuple(sensors),
        size_px=as_size("size", size),
        held_out=as_truth("held_out", held_out),
        scene_headings=as_truth("scene_headings", scene_headings),
        compress=as_truth("compress", compress),
    )
    settings.check()
    folder = as_path("out", out)
    if folder.exists() and not folder.is_dir():
        raise ArgumentError(f"out={str(folder)!r}: a file. Give a folder")
    crew = None if workers is None else as_whole("workers", workers, 1)
    files = scene_files(as_paths("scenes", scenes))
    with (
        kept_connected(ray, crew),
        work_progress("taking views", len(files), show_progress, unit="rooms") as show_done,
    ):
        take_missing(files, folder, settings, workers=crew, ray=ray, done=show_done)
    return [shard_path(file, folder) for file in files]


def open_views(views: str | os.PathLike[str] | Iterable[str | os.PathLike[str]]) -> Views:
    """The pictures that `take_views` took, to be read in shuffled batches: `Views.batches`.

    Args:
        views: a folder, a file of it, or several of either.

    Raises:
        ArgumentError: it is no path.
        ClearwayError: there is no such file, a file holds no views or is damaged, or they do not belong together.
    """
    from clearway.views.stream import views_in

    return views_in(as_paths("views", views))
