"""`load_scene`, `load_scenes`, `build_room`, `encode_scenes`."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Protocol, TypeAlias

import numpy as np

from clearway.api.arguments import as_choice, as_path, as_seed, as_whole
from clearway.errors import ArgumentError
from clearway.perception.encoder import Encoder, sensor_of
from clearway.perception.plugged import own_encoder
from clearway.regular_files import read_ahead
from clearway.remote.address import addresses_without_secrets
from clearway.remote.passing import in_turn
from clearway.rooms import ROOM_NAMES
from clearway.scenes.scene import Scene
from clearway.scenes.scene_files import SCENE_SUFFIXES, scene_files_of_each
from clearway.scenes.sensors import RGB, check_names
from clearway.scenes.targets import possible_targets
from clearway.scenes.thor_v1 import read_scene, write_scene
from clearway.spread.many import of_each

SceneSource: TypeAlias = Scene | str | os.PathLike[str]
Scenes: TypeAlias = SceneSource | Iterable[SceneSource]
"""A scene, a scene file, a folder of them, or several of these."""
BATCH_PICTURES = 32  # that an encoder of the user's own is given together


class OwnEncoder(Protocol):
    """An encoder of your own.

    A `name` beside these is what tables call it; a `sensor` such as "depth" says whose pictures it takes.
    """

    identity: str
    """Another one whenever the features change; scenes trained together must agree in it."""
    feature_count: int
    """F."""

    def encode(self, pictures: np.ndarray) -> np.ndarray:
        """Features (B, F) of pictures (B, height, width, 3) uint8; equal for equal pictures."""


def load_scene(source: SceneSource) -> Scene:
    """The scene in a file. Its pictures stay in the file until they are looked at.

    Args:
        source: a scene file, or a folder with one; a `Scene` is given back as it is.

    Raises:
        ArgumentError: it is no path.
        ClearwayError: there is no such file, several lie in the folder, or the file is no sound scene.
    """
    scene, *others = load_scenes(source)
    if others:
        named = addresses_without_secrets(str(source))
        raise ArgumentError(f"{named}: {1 + len(others)} scenes. Name one, or use load_scenes")
    return scene


def load_scenes(sources: Scenes) -> list[Scene]:
    """The scenes in some files, in the order given, those of a folder by name.

    Args:
        sources: a scene file, a folder of them, or several of either; a `Scene` is taken as it is.

    Raises:
        ArgumentError: something in `sources` is neither a path nor a scene.
        ClearwayError: there is no such file, a folder holds none, or a file is no sound scene.
    """
    return [scene for scene, _ in scenes_and_files(sources)]


def scenes_and_files(sources: Scenes, *, features_in_file: bool = False) -> list[tuple[Scene, Path | None]]:
    """As `load_scenes`, each with its file, None of a scene in memory; `features_in_file` as of `read_scene`."""
    given = [one if isinstance(one, Scene) else as_path("scenes", one) for one in _each(sources)]
    files_of_each = iter(scene_files_of_each([one for one in given if not isinstance(one, Scene)]))
    named: list[tuple[Scene | None, Path | None]] = []
    for one in given:
        named += [(one, None)] if isinstance(one, Scene) else [(None, file) for file in next(files_of_each)]
    if not named:
        raise ArgumentError("scenes: none given. Give at least one scene or scene file")
    files = [file for _, file in named if file is not None]
    many = features_in_file  # else they are large messages
    loaded = iter(list(of_each(_explored, files, _soon) if many else map(read_scene, in_turn(files))))
    return [(next(loaded) if scene is None else scene, file) for scene, file in named]


def _soon(files: Sequence[Path]) -> Iterator[Path]:
    """Files that are read one after the other, of which the next ones are fetched together."""
    read_ahead(files)
    yield from in_turn(files)


def _explored(file: Path) -> Scene:
    """The scene in a file that is one of many; what choosing targets takes is found by the process that reads it."""
    scene = read_scene(file, features_in_file=True)
    possible_targets(scene)
    return scene


def _each(sources: Scenes) -> Iterator[SceneSource]:
    if isinstance(sources, Scene | str | os.PathLike):
        yield sources
    elif isinstance(sources, Iterable):
        yield from sources
    else:
        problem = f"scenes={sources!r:.80}: expected a scene, a scene file, a folder of them, or several"
        raise ArgumentError(f"{problem}. Give one of these")


def encode_scenes(
    scenes: Scenes,
    encoder: str | OwnEncoder = "auto",
    *,
    encoder_seed: int = 0,
    workers: int | None = None,
    show_progress: bool = False,
) -> list[Scene]:
    """The scenes with features of their pictures, all by one encoder.

    Args:
        scenes: with pictures; those to be trained together are encoded together.
        encoder: "auto" or "clearway" (the shipped eyes), "resnet50", "random-resnet50" (calibrated on the
            scenes), a folder of eyes, a plugin's or a Hugging Face model's name; or an encoder of your own
            (`OwnEncoder`).
        encoder_seed: of "random-resnet50".
        workers: processes that share the encoding; None: this process alone. An encoder of your own takes none.
        show_progress: draw a progress bar, if standard error is a terminal.

    Raises:
        ArgumentError: an argument is of the wrong kind or out of range.
        ClearwayError: a scene has no pictures, or the encoder cannot be had or used.
    """
    from clearway.perception import encode

    loaded, seed = load_scenes(scenes), as_seed("encoder_seed", encoder_seed)
    count = None if workers is None else as_whole("workers", workers, 1)
    if isinstance(encoder, str):
        return encode.encode_scenes(loaded, encoder, seed=seed, workers=count, progress=show_progress)
    if count is not None:
        raise ArgumentError(f"workers={count}: an encoder of your own runs in this process. Leave workers out")
    own = own_encoder(encoder)
    return [scene.with_features(_features(scene, own), own.record) for scene in loaded]


def _features(scene: Scene, encoder: Encoder) -> np.ndarray:
    """Features (S, F) float32 of a scene's pictures by the encoder's sensor."""
    from clearway.perception.encode import pictures_of

    pictures = pictures_of(scene, sensor_of(encoder.record))
    starts = range(0, scene.state_count, BATCH_PICTURES)
    return np.concatenate([encoder.encode(pictures[start : start + BATCH_PICTURES]) for start in starts])


def build_room(
    name: str,
    seed: int = 0,
    *,
    sensors: Sequence[str] = (RGB,),
    encoder: str | OwnEncoder = "auto",
    encoder_seed: int = 0,
    out: str | os.PathLike[str] | None = None,
    workers: int | None = None,
    show_progress: bool = False,
) -> Scene:
    """A furnished room as a scene: every view rendered and encoded. The first time takes half a minute or more.

    Pictures and features are kept in the user's cache folder, so that a second call takes a second.

    Args:
        name: "bathroom", "bedroom", "living_room" or "kitchen".
        seed: 0 gives the default room, another one other colours, textures, pictures and small furniture.
        sensors: what takes the pictures: ("rgb",), or ("rgb", "depth") for depth in metres beside them
            (`scene.seen_by("depth")`).
        encoder: see `encode_scenes`. "random-resnet50" is calibrated on this room alone: encode rooms that are to be
            trained together once more, together.
        encoder_seed: of "random-resnet50".
        out: scene file to write as well, .h5 or .hdf5.
        workers: processes that render; None: one a core.
        show_progress: draw progress bars, if standard error is a terminal.

    Raises:
        ArgumentError: there is no such room, or a number or path is none.
        ClearwayError: there is no such sensor, rendering is not possible here, or the encoder cannot be had.
    """
    from clearway.perception.encode import check_encoder, check_rendered
    from clearway.rooms.library import cached_room_scene

    room, room_seed = as_choice("name", name, ROOM_NAMES), as_seed("seed", seed)
    path = None if out is None else as_path("out", out)
    if path is not None and path.suffix.lower() not in SCENE_SUFFIXES:
        raise ArgumentError(f"out={str(path)!r}: expected a name that ends in {' or '.join(SCENE_SUFFIXES)}. Rename it")
    count = None if workers is None else as_whole("workers", workers, 1)
    as_seed("encoder_seed", encoder_seed)  # before the minute that building takes
    check_names(sensors)
    if isinstance(encoder, str):
        check_encoder(encoder, sensors)
    else:
        check_rendered(own_encoder(encoder).record, sensors)
    scene = cached_room_scene(room, room_seed, sensors=tuple(sensors), workers=count, progress=show_progress)
    (encoded,) = encode_scenes(scene, encoder, encoder_seed=encoder_seed, show_progress=show_progress)
    if path is None:
        return encoded
    write_scene(encoded, path)
    return read_scene(path)


def by_name(pairs: Sequence[tuple[Scene, Path | None]]) -> dict[str, Path]:
    """File of each scene by its name, where it has one."""
    return {scene.name: file for scene, file in pairs if file is not None}
