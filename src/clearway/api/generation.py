"""`generate`: scene files of rooms and flats drawn from a kind, a split and a seed."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import cast

from clearway.api.arguments import as_choice, as_path, as_size, as_whole, as_word
from clearway.choices import PlanKind, SplitName
from clearway.errors import ArgumentError
from clearway.generation.request import KINDS, MAX_NUMBER, MAX_SEED, SIZE_PX, SPLITS, Request
from clearway.scenes.sensors import RGB, check_names


def generate(
    kind: PlanKind = "room",
    count: int = 1,
    *,
    split: SplitName = "train",
    seed: int = 0,
    out: str | os.PathLike[str] | None = None,
    sensors: Sequence[str] = (RGB,),
    size: Sequence[int] = SIZE_PX,
    encoder: str = "auto",
    encoder_seed: int = 0,
    workers: int | None = None,
    ray: str | None = None,
    show_progress: bool = False,
) -> list[Path]:
    """Furnished rooms or flats as scene files, one after the other the same for everyone; the files, made or there.

    What is in the folder already is checked and not made again, so an interrupted call goes on.

    Args:
        kind: "room" (kitchens, living rooms, bedrooms and bathrooms in turn) or "flat" (two to six rooms, a corridor).
        count: number of files: the first so many of this kind, split and seed.
        split: "train", "validation" or "test", which never share a plan.
        seed: another one gives other rooms.
        out: folder for the scene files; None: one in the user's cache folder, which is kept from call to call.
        sensors: what takes the pictures: ("rgb",), or ("rgb", "depth") for depth in metres beside them.
        size: height and width of the pictures.
        encoder: as of `encode_scenes`, or "none" for scenes without features, which are trained on once they are
            encoded. "random-resnet50" is calibrated on the first four training rooms, whatever is generated.
        encoder_seed: of "random-resnet50".
        workers: processes, each of which makes whole rooms; None: one a core.
        ray: a Ray cluster that makes them: "local", "auto" or an address. Its nodes see `out` under the same path.
        show_progress: draw a progress bar, if standard error is a terminal.

    Raises:
        ArgumentError: an argument is of the wrong kind or out of range.
        ClearwayError: a file in the folder is damaged or not what is asked for, the disk is full, or rendering or the
            encoder cannot be had here.
    """
    from clearway.generation.cached import cached_requests
    from clearway.generation.files import NO_ENCODER, Seen, generate_scenes, scene_path
    from clearway.perception.encode import check_encoder
    from clearway.progress import work_progress
    from clearway.ray_cluster import kept_connected

    chosen_kind = cast(PlanKind, as_choice("kind", kind, KINDS))
    chosen_split = cast(SplitName, as_choice("split", split, SPLITS))
    wanted = as_whole("count", count, 1, MAX_NUMBER + 1)
    chosen_seed = as_whole("seed", seed, 0, MAX_SEED)
    folder = None if out is None else as_path("out", out)
    if folder is not None and folder.exists() and not folder.is_dir():
        raise ArgumentError(f"out={str(folder)!r}: a file. Give a folder")
    check_names(sensors)
    seen = Seen(tuple(sensors), as_size("size", size))
    seen.check()
    name = as_word("encoder", encoder)
    if name != NO_ENCODER:
        check_encoder(name, sensors)
    crew = None if workers is None else as_whole("workers", workers, 1)
    encoder_seed = as_whole("encoder_seed", encoder_seed, 0, MAX_SEED)
    requests = [Request(chosen_kind, chosen_split, chosen_seed, number) for number in range(wanted)]
    with (
        kept_connected(ray, crew),
        work_progress(f"making {kind}s", wanted, show_progress, unit=f"{kind}s") as show_done,
    ):
        if folder is None:
            return cached_requests(
                requests, seen, name, encoder_seed=encoder_seed, workers=crew, ray=ray, done=show_done
            )
        generate_scenes(requests, folder, seen, name, encoder_seed=encoder_seed, workers=crew, ray=ray, done=show_done)
    return [scene_path(request, folder) for request in requests]
