"""Generated rooms and flats in the user's cache folder: made the first time that somebody asks for them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path

from clearway import files, generation
from clearway.generation.files import NO_ENCODER, Seen, generate_scenes, scene_path
from clearway.generation.request import Request
from clearway.rooms.build import shaping_versions
from clearway.rooms.library import KEY_LENGTH, sources_hash
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import read_scene


def cached_requests(
    requests: Sequence[Request],
    seen: Seen | None = None,
    encoder: str = NO_ENCODER,
    *,
    encoder_seed: int = 0,
    workers: int | None = None,
    ray: str | None = None,
    done: Callable[[int], object] = lambda count: None,
) -> list[Path]:
    """The scene files of some requests in the user's cache; who asks while another process makes them waits for it.

    Args and errors: those of `generate_scenes`; by default small colour pictures, and no features.
    """
    looks = seen or Seen()
    folder = _folder(looks, encoder, encoder_seed)
    with files.locked(folder / "scenes"):
        generate_scenes(
            requests, folder, looks, encoder, encoder_seed=encoder_seed, workers=workers, ray=ray, done=done
        )
    return [scene_path(request, folder) for request in requests]


def room_of_seed(seed: int, done: Callable[[int], object] = lambda count: None) -> Scene:
    """A room that a user chooses by a seed, one of `validation`, which no training sees; built the first time.

    Kitchen, living room, bedroom and bathroom in turn.

    Raises:
        ClearwayError: the seed is out of range, or rendering is not possible here.
    """
    (path,) = cached_requests([Request.of_seed(seed)], done=done)
    return read_scene(path)


def _folder(seen: Seen, encoder: str, encoder_seed: int) -> Path:
    """A folder whose name holds a hash of all that shapes its files."""
    asked = {"sensors": sorted(seen.sensors), "size_px": seen.size_px, "encoder": encoder, "encoder_seed": encoder_seed}
    shaped_by = {**asked, "versions": shaping_versions(), "sources": sources_hash(generation)}
    key = hashlib.sha256(json.dumps(shaped_by, sort_keys=True).encode()).hexdigest()[:KEY_LENGTH]
    return files.cache_dir() / "generated" / key
