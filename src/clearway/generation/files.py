"""Scene files of generated plans: what is there is checked and kept, the rest is made, a room at a time in each worker.

A file is written whole or not at all, so that an interrupted generation goes on where it was.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from clearway.errors import ClearwayError, RenderError, SceneError
from clearway.generation.plans import generated_plan
from clearway.generation.request import GENERATOR_VERSION, SIZE_PX, Request, other_version
from clearway.rooms.build import build_floor_plan, check_mujoco
from clearway.rooms.library import cached_plan_scene
from clearway.rooms.render_worker import renderer_environment
from clearway.scenes.contents import check_contents
from clearway.scenes.floor_plans import GENERATED
from clearway.scenes.scene import EncoderRecord, Provenance, Scene
from clearway.scenes.thor_v1 import read_scene, write_scene
from clearway.spread.workers import ATTEMPTS, Work, core_count, workers_for

if TYPE_CHECKING:
    from clearway.perception.encoder import Encoder

SIDES_PX = (16, 1024)  # least and most of a picture's height and width
NO_ENCODER = "none"
CALIBRATION_ROOMS = 4  # the first of "train", seed 0
OTHER_FOLDER = "Remove it, or give another folder with --out"
THREADS = 1  # of each worker, so that features are the same bits however many share the work


@dataclass(frozen=True)
class Seen:
    """What is seen of a plan.

    Attributes:
        sensors: what takes the pictures, names of `clearway.scenes.sensors.SENSORS`.
        size_px: height and width of the pictures.
    """

    sensors: tuple[str, ...] = ("rgb",)
    size_px: tuple[int, int] = SIZE_PX

    def check(self) -> None:
        """Raises ClearwayError where the pictures would have an impossible size."""
        least, most = SIDES_PX
        if len(self.size_px) != 2 or not all(least <= side <= most for side in self.size_px):
            shown = " x ".join(map(str, self.size_px))
            raise ClearwayError(f"pictures of {shown} pixels: expected {least} to {most}. Give a height and a width")


def scene_path(request: Request, folder: Path) -> Path:
    """Where the scene of a request is kept in a folder."""
    return folder / f"{request.name}.h5"


def generate_scenes(
    requests: Sequence[Request],
    folder: Path,
    seen: Seen,
    encoder: str,
    *,
    encoder_seed: int = 0,
    workers: int | None = None,
    ray: str | None = None,
    done: Callable[[int], object] = lambda count: None,
) -> list[Path]:
    """Make those scene files of some requests that are not there; give those that were made, in order.

    Args:
        requests: the plans.
        folder: of the files; made where it is not there.
        seen: sensors and size of the pictures.
        encoder: a name as of `perception.encode.find_record`, or "none" for scenes without features. What the folder's
            files were encoded with is used again.
        encoder_seed: of "random-resnet50".
        workers: processes, a room at a time each; None: one a core. Under Ray's "local" processors, None for all.
        ray: a Ray cluster that makes them, see `ray_cluster.connected`; its nodes must see the folder under its path.
        done: is told how many of the requests have their file.

    Raises:
        SceneError: a file that is there is damaged, or not what is asked for; or one cannot be written.
        EncoderError: the encoder cannot be had.
        RenderError: rendering is not possible here, or a worker died.
        RunError: Ray is not installed, or the cluster cannot be reached.
    """
    seen.check()
    there = {request: kept for request in requests if (kept := _kept(scene_path(request, folder))) is not None}
    for request, scene in there.items():
        check_kept(scene, scene_path(request, folder), request, seen)
    missing = [request for request in requests if request not in there]
    record = _record_of(there, folder, encoder, encoder_seed)
    for number, (request, scene) in enumerate(there.items(), 1):
        with _remedied(scene_path(request, folder)):
            check_contents(scene)
        done(number)
    if not missing:
        return []
    if record is None and encoder != NO_ENCODER:
        record = find_record(encoder, encoder_seed, seen, workers)
    check_mujoco()
    folder.mkdir(parents=True, exist_ok=True)
    maker = partial(_open_maker, folder.resolve(), seen, record)
    work = Work(maker, _make, _died, attempts=ATTEMPTS, environment=_environment(), keeps_messages=True)
    count = workers if ray is not None else min(workers or core_count(), len(missing))
    with workers_for(work, workers=count, ray=ray) as crew:
        for number, _ in enumerate(crew.results(missing), len(there) + 1):
            done(number)
    return [scene_path(request, folder) for request in missing]


def check_kept(scene: Scene, path: Path, request: Request, seen: Seen) -> None:
    """Check that a file that is there is what is asked for. Raises SceneError, which says what differs."""
    wanted, found = notes_of(request), scene.made_by.notes
    if scene.made_by.source != GENERATED:
        problem = (
            f"was made from {scene.made_by.source}, this clearway has version {GENERATOR_VERSION} of the generator"
        )
        raise SceneError(path, problem, OTHER_FOLDER)
    if problem := other_version(found):
        raise SceneError(path, problem, OTHER_FOLDER)
    if {key: found.get(key) for key in wanted} != wanted or scene.made_by.seed != request.seed:
        raise SceneError(path, f"is no {request.name} of seed {request.seed}", OTHER_FOLDER)
    sensors = {sensor.name: sensor.shape[:2] for sensor in scene.sensors}
    if sensors != dict.fromkeys(seen.sensors, seen.size_px):
        shown = ", ".join(f"{name} ({height} x {width})" for name, (height, width) in sensors.items()) or "no pictures"
        height, width = seen.size_px
        asked = f"asked for {', '.join(seen.sensors)} ({height} x {width})"
        raise SceneError(path, f"has {shown}, {asked}", OTHER_FOLDER)


def find_record(encoder: str, seed: int, seen: Seen, workers: int | None = None) -> EncoderRecord:
    """The record of an encoder; "random-resnet50" is calibrated on the same four rooms whatever is generated.

    So scenes of all splits can be trained and evaluated together. Raises as `perception.encode.find_record`.
    """
    from clearway.perception import encode

    def rooms() -> list[Scene]:
        plans = [generated_plan(Request("room", "train", 0, number)) for number in range(CALIBRATION_ROOMS)]
        return [cached_plan_scene(plan, size_px=seen.size_px, workers=workers) for plan in plans]

    return encode.find_record(encoder, rooms, seed=seed)


def request_of(made_by: Provenance) -> Request | None:
    """The request whose plan a scene is; None where it is no generated one."""
    notes, seed = made_by.notes, made_by.seed
    kind, split, number = notes.get("kind"), notes.get("split"), notes.get("number")
    if made_by.source != GENERATED or seed is None or not isinstance(number, int):
        return None
    return Request(kind, split, seed, number)  # type: ignore[arg-type]  # which it checks


def notes_of(request: Request) -> dict[str, object]:
    """What a scene's `made_by` says of the request, beside its seed."""
    return {"kind": request.kind, "split": request.split, "number": request.number, "generator": GENERATOR_VERSION}


def build_request(request: Request, seen: Seen, *, here: bool = False, workers: int | None = None) -> Scene:
    """The furnished, rendered room or flat of a request, without features; `here` as of `build_floor_plan`."""
    plan = generated_plan(request)
    scene = build_floor_plan(plan, request.seed, sensors=seen.sensors, size_px=seen.size_px, here=here, workers=workers)
    notes = {**scene.made_by.notes, **notes_of(request)}
    return replace(scene, made_by=replace(scene.made_by, source=GENERATED, notes=notes))


def _kept(path: Path) -> Scene | None:
    """The scene in a file, None where there is none. Raises SceneError where it is damaged, with the remedy."""
    if not path.exists():
        return None
    with _remedied(path):
        return read_scene(path, features_in_file=True)


@contextmanager
def _remedied(path: Path) -> Iterator[None]:
    """What is told of a damaged file says how it is made again."""
    try:
        yield
    except SceneError as fault:
        raise SceneError(
            path, fault.problem, "Remove it, and the same command makes it again", fault.dataset
        ) from fault


def _record_of(there: dict[Request, Scene], folder: Path, encoder: str, encoder_seed: int) -> EncoderRecord | None:
    """What the scenes that are there were encoded with, None of none. Raises SceneError where it is not as asked."""
    from clearway.perception import eyes
    from clearway.perception.encode import AUTO, RANDOM

    wanted = eyes.NAME if encoder == AUTO else Path(encoder).name if eyes.is_eyes(Path(encoder)) else encoder
    first = next((scene.encoder for scene in there.values() if scene.encoder is not None), None)
    for request, scene in there.items():
        record = scene.encoder
        found = NO_ENCODER if record is None else record.name
        seeded = record is None or found != RANDOM or record.settings.get("seed") == encoder_seed
        alike = record is None or first is None or record.identity == first.identity
        if found != wanted or not seeded or not alike:
            shown = "no features" if record is None else f"features of {found} ({record.identity})"
            asked = "those of the other files" if found == wanted and seeded else encoder
            raise SceneError(scene_path(request, folder), f"has {shown}, asked for {asked}", OTHER_FOLDER)
    return first


@dataclass(frozen=True)
class _Maker:
    """What a worker makes scenes with."""

    folder: Path
    seen: Seen
    encoder: Encoder | None


def _open_maker(folder: Path, seen: Seen, record: EncoderRecord | None) -> _Maker:
    if record is None:
        return _Maker(folder, seen, None)
    from clearway.perception import encoder_from_record
    from clearway.torch_threads import torch_threads

    with torch_threads(THREADS):
        return _Maker(folder, seen, encoder_from_record(record))


def _make(maker: _Maker, request: Request) -> str:
    """Make the file of a request; gives its name."""
    scene = build_request(request, maker.seen, here=True)
    if maker.encoder is not None:
        from clearway.perception.encode import encoded
        from clearway.torch_threads import torch_threads

        with torch_threads(THREADS):
            scene = encoded(scene, maker.encoder)
    write_scene(scene, scene_path(request, maker.folder))
    return request.name


def _died(request: Request, how: str) -> RenderError:
    remedy = "Give the same command again: what is made stays. Fewer --workers need less memory"
    return RenderError(f"{request.name}: the process that made it {how}. {remedy}")


def _environment() -> dict[str, str]:
    """Of the workers: what a renderer needs, and one thread for all that counts."""
    return {**renderer_environment(THREADS), "OMP_NUM_THREADS": str(THREADS)}
