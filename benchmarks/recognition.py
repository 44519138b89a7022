"""How well the eyes that come along see in rooms, perturbed as off the grid, beside other encoders.

    python benchmarks/recognition.py rooms-test                              # files, or folders of them, with pictures
    python benchmarks/recognition.py rooms-test --rooms 16 --json record.json

*Recognised*: of every pose of a room's grid one picture is taken under perturbations of its own and compared with the
pictures that the scene has of all its poses, by the cosine of features; the share whose nearest is of the same pose,
and of one within half a metre and 30 degrees. Pixels are 18 x 24 colours, less the picture's mean. The random ResNet-50
is calibrated on these rooms; whitened, by the scene's own pictures, as the learner does it.

*Told by the eyes alone*: of 128 random free poses of a room, two takes each, the median error of where the camera of
the second of two pictures stands and how it is turned, where they see a quarter alike or more; the share within half a
metre and 15 degrees; and the share of free ways ahead told within a quarter of a metre, beside that of one answer for
all, the median. Other encoders tell neither without more training.

Intervals are of the mean over rooms, 95 %; rooms are drawn anew, 2,000 times.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from by_scene import interval

import clearway
from clearway.api.perturbations import perturbations_asked
from clearway.errors import EncoderError
from clearway.learn.presets import DEFAULT
from clearway.learn.provenance import hardware, package_versions
from clearway.model.feature_map import fitted_features
from clearway.perception.encode import RANDOM, TRAINED, encoder_from_record, features_of, find_record
from clearway.perception.encoder import Encoder
from clearway.perception.eyes import NAME, SHIPPED, read_eyes
from clearway.perception.preprocess import Preprocessing, to_pixels
from clearway.pretraining.judge import FREE_M, judge_rooms, recognition
from clearway.scenes.scene import Scene
from clearway.scenes.scene_files import scene_files
from clearway.scenes.thor_v1 import read_scene
from clearway.views.grid import grid_takes
from clearway.views.stream import Views

CONDITIONS = ("geometry", "all")
PIXELS = "pixels 18 x 24"
TAKES, POSES = 4, 128
TOLD = ("place_m", "turn_deg", "poses", "free_ahead")

Seen = Callable[[np.ndarray], np.ndarray]
"""Features (B, F) of pictures (B, height, width, 3)."""


def pixels(pictures: np.ndarray) -> np.ndarray:
    """Small pictures as features, less the mean of each."""
    small = to_pixels(pictures, Preprocessing(18, 24, (0, 0, 0), (1, 1, 1))).flatten(1).numpy()
    return small - small.mean(axis=1, keepdims=True)


def encoders(scenes: Sequence[Scene], left_out: Sequence[str]) -> dict[str, Seen]:
    """What is compared, by name."""
    found: dict[str, Seen] = {PIXELS: pixels}
    for name in (RANDOM, TRAINED, NAME):
        if name in left_out:
            continue
        try:
            encoder = encoder_from_record(find_record(name, scenes))
        except EncoderError as fault:
            print(f"{name}: left out, {fault}", file=sys.stderr)
            continue
        found[name] = described(encoder) if name == NAME else partial(features_of, encoder=encoder)
    return found


def described(encoder: Encoder) -> Seen:
    """The description alone, which is what eyes recognise by."""
    count = read_eyes(SHIPPED).shape.description_width
    return lambda seen: features_of(seen, encoder)[:, :count]


def recognised(scene: Scene, takes: np.ndarray, kept: np.ndarray, see: Seen, *, whiten: bool) -> dict[str, float]:
    """Of takes (S, height, width, 3), among features (S, F) of the scene's own pictures."""
    both = np.stack([kept, see(takes)], axis=1).reshape(2 * len(kept), -1)
    poses = np.column_stack([scene.locations_m, scene.headings_deg]).repeat(2, axis=0)
    features = torch.from_numpy(both)
    if whiten:
        features = fitted_features(torch.from_numpy(kept), DEFAULT)(features)
    return recognition(features, poses)


def own_pictures(scene: Scene) -> np.ndarray:
    """Of all poses."""
    assert scene.observations is not None
    return scene.observations[:]


def in_rooms(scenes: Sequence[Scene], left_out: Sequence[str], seed: int) -> dict[str, dict[str, list[float]]]:
    """Shares recognised in each room, by condition and encoder."""
    seen_by = encoders(scenes, left_out)
    own = {name: [see(own_pictures(scene)) for scene in scenes] for name, see in seen_by.items()}
    found: dict[str, dict[str, list[float]]] = {}
    for condition in CONDITIONS:
        taken = grid_takes(scenes, perturbations_asked(condition), takes=TAKES, seed=seed, workers=1)
        for number, (scene, takes) in enumerate(zip(scenes, taken, strict=True)):
            for name, see in seen_by.items():
                for whiten in (False, True) if name == RANDOM else (False,):
                    told = recognised(scene, takes[:, 0], own[name][number], see, whiten=whiten)
                    row = f"{condition}: {name}{', whitened' if whiten else ''}"
                    for figure, value in told.items():
                        found.setdefault(row, {}).setdefault(figure, []).append(value)
    return found


def seen_by_eyes(files: Sequence[Path], seed: int) -> dict[str, dict[str, list[float]]]:
    """What the eyes tell of random views of each room, by condition."""
    eyes, found = read_eyes(SHIPPED), {}
    for condition in CONDITIONS:
        with tempfile.TemporaryDirectory() as folder:
            asked: dict[str, Any] = {"poses": POSES, "takes": 2, "perturb": (condition,), "sensors": ("rgb", "depth")}
            clearway.take_views(files, out=folder, seed=seed, workers=1, **asked)
            views = clearway.open_views(folder)
            told = judge_rooms(eyes, views, seed, relight=False)
            found[condition] = {name: [room[name] for room in told] for name in TOLD}
            found[condition]["free_ahead_constant"] = constant_free_ahead(views)
    return found


def constant_free_ahead(views: Views) -> list[float]:
    """Share of free ways ahead of each room within a quarter of a metre of the median of all rooms."""
    ahead_m = [shard.table.free_m[:, 0] for shard in views.shards]
    middle = float(np.median(np.concatenate(ahead_m)))
    return [float(np.mean(np.abs(own - middle) < FREE_M)) for own in ahead_m]


def summary(rows: Mapping[str, Mapping[str, Sequence[float]]]) -> dict[str, dict[str, list[float]]]:
    """Mean and interval of every figure, to print and to keep."""
    found: dict[str, dict[str, list[float]]] = {}
    for row, figures in rows.items():
        for name, values in figures.items():
            column = np.array(values, float)
            found.setdefault(row, {})[name] = [float(np.nanmean(column)), *interval(column)]
    return found


def table(found: Mapping[str, Mapping[str, Sequence[float]]]) -> str:
    """As Markdown, a row a line."""
    names = list(next(iter(found.values())))
    lines = ["| | " + " | ".join(names) + " |", "|" + "---|" * (len(names) + 1)]
    for row, figures in found.items():
        cells = [f"{mean:.3g} ({low:.3g} to {high:.3g})" for mean, low, high in figures.values()]
        lines.append(f"| {row} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    """Measure, print, and write the record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--rooms", type=int, help="the first so many; default: all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--leave-out", nargs="+", default=[], choices=(RANDOM, TRAINED), help="encoders")
    parser.add_argument("--json", type=Path, help="where the record is written")
    args = parser.parse_args()
    files = scene_files(args.scenes)[: args.rooms]
    torch.set_num_threads(1)
    told = seen_by_eyes(files, args.seed)
    print(f"{len(files)} rooms, seed {args.seed}\n\n{table(summary(told))}\n", flush=True)
    rooms = in_rooms([read_scene(file) for file in files], args.leave_out, args.seed)
    print(table(summary(rooms)))
    if args.json:
        record = {"rooms": [file.stem for file in files], "seed": args.seed, "recognised": rooms, "told": told}
        record |= {"eyes": find_record(NAME, []).identity, "hardware": hardware(), "versions": package_versions()}
        args.json.write_text(json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
