"""The example that comes along: `data/card.json` says what it is, how it was made, and the SHA-256 of all its files.

card.json             name, commands, figures, sums
scene.h5              a scene file (`scenes.thor_v1`) with features and without pictures
pictures.h5           its pictures as JPEG, one behind the other: `jpeg` (bytes,) uint8, `ends` (S,) int64
runs/NAME/            run folders (`learn.run_folder`), each with one checkpoint to act from, not to train on from
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from clearway.errors import RunError
from clearway.files import read_json
from clearway.regular_files import sha256_of
from clearway.scenes import hdf5
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import read_scene

SHIPPED = Path(__file__).parent / "data"
FORMAT_VERSION = 1
CARD_FILE, SCENE_FILE, PICTURES_FILE, RUNS = "card.json", "scene.h5", "pictures.h5", "runs"
MOST_BYTES = 10 * 1000**2  # of all files together


@dataclass(frozen=True)
class Example:
    """A scene and agents trained in it.

    Attributes:
        scene: with pictures and features.
        runs: run folders by the agents' names, in the order in which they are shown.
        episode: of the viewer, that it opens with; its query string.
        card: all that is known of them, as JSON values.
    """

    scene: Scene
    runs: Mapping[str, Path]
    episode: str
    card: Mapping[str, Any]


def read_card(folder: Path = SHIPPED) -> dict[str, Any]:
    """What an example is, without a look at its other files.

    Raises:
        RunError: there is none, or it cannot be read.
    """
    try:
        card = read_json(folder / CARD_FILE)
        if card["format_version"] != FORMAT_VERSION:
            raise ValueError(f"format version {card['format_version']}, expected {FORMAT_VERSION}")
        wanted = {"name": str, "episode": str, "sha256": dict, "agents": dict}
        wrong = [name for name, kind in wanted.items() if not isinstance(card[name], kind)]
        if wrong:
            raise ValueError(f"{wrong[0]} is {card[wrong[0]]!r:.40}")
        return card
    except (OSError, ValueError, KeyError, TypeError) as fault:
        raise _spoilt(folder / CARD_FILE, f"cannot be read ({fault})") from fault


def load_example(folder: Path = SHIPPED) -> Example:
    """The example, once all its files are found to be as they were made.

    Raises:
        RunError: a file is missing or was altered.
        SceneError: the scene is not sound.
    """
    card = read_card(folder)
    for name, digest in card["sha256"].items():
        if not (folder / name).is_file():
            raise _spoilt(folder / name, "is missing")
        if file_sum(folder / name) != digest:
            raise _spoilt(folder / name, f"was altered: its SHA-256 differs from that in {CARD_FILE}")
    bare = read_scene(folder / SCENE_FILE, name=str(card["name"]))
    scene = replace(bare, observations=_pictures(folder / PICTURES_FILE, bare.state_count))
    return Example(scene, {name: folder / RUNS / name for name in card["agents"]}, card["episode"], card)


def file_sum(path: Path) -> str:
    """SHA-256 of a file. Raises OSError."""
    return sha256_of(path)


def write_pictures(path: Path, jpegs: list[bytes]) -> None:
    """Keep JPEG files one behind the other."""
    with hdf5.written(path) as file:
        hdf5.write_array(file, "jpeg", np.frombuffer(b"".join(jpegs), np.uint8))
        hdf5.write_array(file, "ends", np.cumsum([len(jpeg) for jpeg in jpegs]))


def decoded(jpeg: bytes) -> np.ndarray:
    """The picture (h, w, 3) uint8 in a JPEG file."""
    return np.asarray(Image.open(io.BytesIO(jpeg)).convert("RGB"))


def _pictures(path: Path, count: int) -> np.ndarray:
    """The pictures (S, h, w, 3) uint8 that `write_pictures` kept."""
    with hdf5.opened(path) as file:
        content, ends = file["jpeg"][:].tobytes(), file["ends"][:].tolist()
    assert len(ends) == count, "the sums agree, and the pictures are of another scene"
    return np.stack([decoded(content[start:end]) for start, end in zip([0, *ends], ends, strict=False)])


def _spoilt(path: Path, problem: str) -> RunError:
    return RunError(f"{path}: {problem}. Install clearway again, or make the example: clearway examples --remake DIR")
