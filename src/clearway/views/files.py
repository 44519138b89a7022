"""A folder of shards: what is there is checked and kept, the rest is made, a room at a time in each worker."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from clearway.errors import RenderError, SceneError
from clearway.rooms.build import check_mujoco
from clearway.rooms.render_worker import renderer_environment
from clearway.scenes.thor_v1 import read_scene
from clearway.spread.workers import ATTEMPTS, Work, core_count, workers_for
from clearway.views.settings import ViewSettings, differing
from clearway.views.shard import is_shard, read_shard, room_key, write_shard
from clearway.views.take import room_views

OTHER_FOLDER = "Remove it, or give another folder with --out"
THREADS = 1  # of each worker


def shard_path(scene_file: Path, folder: Path) -> Path:
    """Where the views of a scene file's room are kept in a folder."""
    return folder / f"{scene_file.stem}.h5"


def take_missing(
    scene_files: Sequence[Path],
    folder: Path,
    settings: ViewSettings,
    *,
    workers: int | None = None,
    ray: str | None = None,
    done: Callable[[int], object] = lambda count: None,
) -> list[Path]:
    """Make those shards of some scenes that are not there; give those that were made, in order.

    Args:
        scene_files: of rooms that can be built again.
        folder: of the shards; made where it is not there.
        settings: which pictures are taken.
        workers: processes, a room at a time each; None: one a core. Under Ray's "local" processors, None for all.
        ray: a Ray cluster that makes them, see `ray_cluster.connected`; its nodes must see files and folder under
            their paths.
        done: is told how many of the scenes have their shard.

    Raises:
        ArgumentError: the settings are none.
        SceneError: two scenes have one name, a shard that is there is damaged or not what is asked for, a scene is no
            room that can be built again, or a file cannot be written.
        RenderError: rendering is not possible here, or a worker died.
        RunError: Ray is not installed, or the cluster cannot be reached.
    """
    settings.check()
    _check_names(scene_files, folder)
    missing = [path for path in scene_files if not shard_path(path, folder).exists()]
    for path in scene_files:
        if shard_path(path, folder).exists():
            check_kept(shard_path(path, folder), path, settings)
    there = len(scene_files) - len(missing)
    done(there)
    if not missing:
        return []
    check_mujoco()
    folder.mkdir(parents=True, exist_ok=True)
    environment = {**renderer_environment(THREADS), "OMP_NUM_THREADS": str(THREADS)}
    maker = partial(_Maker, folder.resolve(), settings)
    work = Work(maker, _make, _died, attempts=ATTEMPTS, environment=environment, keeps_messages=True)
    count = workers if ray is not None else min(workers or core_count(), len(missing))
    with workers_for(work, workers=count, ray=ray) as crew:
        for number, _ in enumerate(crew.results([path.resolve() for path in missing]), there + 1):
            done(number)
    return [shard_path(path, folder) for path in missing]


def check_kept(path: Path, scene_file: Path, settings: ViewSettings) -> None:
    """Check that a shard that is there is what is asked for; single pictures are checked when they are looked at.

    Raises:
        SceneError: it is damaged, or not what is asked for; the error says what to do.
    """
    try:
        shard = read_shard(path) if is_shard(path) else None
        assert shard is None or len(shard.table) == len(shard)  # which reads it
    except SceneError as fault:
        again = "Remove it, and the same command makes it again"
        raise SceneError(path, fault.problem, again, fault.dataset) from fault
    if shard is None:
        raise SceneError(path, "is there, and holds no views", "Give another folder with --out")
    if other := differing(shard.settings, settings):
        raise SceneError(path, f"has {other}", OTHER_FOLDER)
    if shard.room_key != room_key(read_scene(scene_file, features_in_file=True)):
        raise SceneError(path, f"shows another room than {scene_file}", OTHER_FOLDER)


@dataclass(frozen=True)
class _Maker:
    """What a worker makes shards with."""

    folder: Path
    settings: ViewSettings


def _make(maker: _Maker, scene_file: Path) -> str:
    """Make the shard of a scene file; gives the scene's name."""
    scene = read_scene(scene_file, features_in_file=True)
    views = room_views(scene, maker.settings)
    write_shard(shard_path(scene_file, maker.folder), scene, maker.settings, views)
    return scene.name


def _died(scene_file: Path, how: str) -> RenderError:
    remedy = "Give the same command again: what is made stays. Fewer --workers need less memory"
    return RenderError(f"{scene_file}: the process that took its views {how}. {remedy}")


def _check_names(scene_files: Sequence[Path], folder: Path) -> None:
    first: dict[str, Path] = {}
    for path in scene_files:
        if shard_path(path, folder).resolve() == path.resolve():
            raise SceneError(path, "its views would be written over it", "Give another folder with --out")
        if path.stem in first:
            problem = f"has the same name as {first[path.stem]}, and views are named after scenes"
            raise SceneError(path, problem, "Give each folder of scenes a folder of views of its own")
        first[path.stem] = path
