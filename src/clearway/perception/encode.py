"""Choose an encoder by name, and encode scenes with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from clearway.errors import EncoderError, SceneError
from clearway.perception import depth_grid, eyes, plugged, pretrained, random_resnet
from clearway.perception.cache import Entry, cached, content_key, joint_key
from clearway.perception.encoder import Encoder, sensor_of
from clearway.perception.preprocess import Preprocessing
from clearway.perception.random_resnet import RESNET50, ResNetShape
from clearway.plugins import find_plugin
from clearway.progress import work_progress
from clearway.scenes.scene import EncoderRecord, Observations, Scene
from clearway.scenes.sensors import RGB, SENSORS
from clearway.spread.workers import Work, Workers, workers_for
from clearway.torch_threads import threads_in_use, torch_threads

AUTO, TRAINED, RANDOM = "auto", "resnet50", "random-resnet50"
BATCH_PICTURES = 32

Batch = tuple[Observations, int, int]
"""Where pictures are, the first and the last of a batch, last excluded."""


def find_record(
    name: str,
    scenes: Sequence[Scene] | Callable[[], Sequence[Scene]],
    *,
    seed: int = 0,
    shape: ResNetShape = RESNET50,
    preprocessing: Preprocessing = random_resnet.PREPROCESSING,
) -> EncoderRecord:
    """The record of the encoder that a user asks for by name.

    Args:
        name: "clearway" or "auto" for the shipped eyes, a folder of eyes (`clearway pretrain`), "resnet50"
            (trained on ImageNet, `microsoft/resnet-50`), "random-resnet50" (calibrated on the scenes), "depth-grid" (of
            depth, without a network), one of another package (`clearway.plugins`), or a vision model on the Hugging
            Face hub or in a folder.
        scenes: what "random-resnet50" calibrates on, in any order; or what gives them, asked only if it is needed.
        seed: of "random-resnet50".
        shape, preprocessing: of "random-resnet50".

    Raises:
        EncoderError: there is no such encoder, it cannot be had, or there are no pictures to calibrate on.
        PluginError: another package's encoder cannot be used.
    """
    if name == AUTO:
        return eyes.find_record()
    if name == RANDOM:
        return _fitted(scenes, seed, shape, preprocessing)
    if name == depth_grid.NAME:
        return depth_grid.find_record()
    if name == eyes.NAME or eyes.is_eyes(Path(name)):
        return eyes.find_record(name)
    if name == TRAINED:
        return pretrained.find_record(pretrained.RESNET50_MODEL, TRAINED)
    plugin = find_plugin("encoders", name)
    return plugged.make_encoder(plugin).record if plugin else pretrained.find_record(name)


def check_encoder(encoder: str, sensors: Sequence[str]) -> None:
    """Check, before what takes long, that an encoder can be had, and its sensor is among those to be rendered.

    Raises:
        EncoderError, PluginError: as of `find_record`; or its sensor is not rendered.
    """
    if encoder != RANDOM:  # which sees colour, and is calibrated on pictures that are still to be rendered
        check_rendered(find_record(encoder, ()), sensors)


def check_rendered(record: EncoderRecord, sensors: Sequence[str]) -> None:
    """Raise EncoderError where an encoder's sensor is not among those to be rendered."""
    sensor = sensor_of(record)
    if sensor not in sensors:
        remedy = f"Add --sensors {RGB} {sensor}" if sensor in SENSORS else f"Use one that sees {' or '.join(SENSORS)}"
        raise EncoderError(f"encoder {record.name} sees {sensor}, and it is not rendered. {remedy}")


def encoder_from_record(record: EncoderRecord) -> Encoder:
    """Make the encoder again that made a scene's features.

    Raises:
        EncoderError: the record does not say how, was altered, or its model cannot be had.
    """
    kind = record.settings.get("kind")
    if kind == random_resnet.KIND:
        return random_resnet.from_record(record)
    if kind == depth_grid.KIND:
        return depth_grid.from_record(record)
    if kind == eyes.KIND:
        return eyes.from_record(record).network
    if kind == pretrained.KIND:
        return pretrained.from_record(record)
    if kind == plugged.KIND:
        return plugged.from_record(record)
    if kind == plugged.OWN_KIND:
        problem = f"encoder {record.name}: a program of its own made the features, and no package offers it"
        raise EncoderError(f"{problem}. Offer it as a plugin (docs/python.md), or encode the scene again")
    problem = f"encoder {record.name}: the features came with the scene's file, which does not say how they were made"
    raise EncoderError(f"{problem}. Encode the scene again")


def encode_scenes(
    scenes: Sequence[Scene],
    encoder: str | EncoderRecord = AUTO,
    *,
    seed: int = 0,
    threads: int | None = None,
    progress: bool = False,
    batch: int = BATCH_PICTURES,
    workers: int | None = None,
    ray: str | None = None,
) -> list[Scene]:
    """The scenes with features of their pictures, all by one encoder.

    However many workers share the work, features are those of one process with one thread, bit for bit.

    Features are kept in the user's cache folder by the content of the pictures, the encoder's identity, and what
    decides the last bits: `batch` and the number of threads.

    Args:
        scenes: scenes with pictures of the encoder's sensor; those to be trained together must be encoded together.
        encoder: a name, see `find_record`, or the record of an encoder to use again.
        seed: of "random-resnet50".
        threads: processor threads; None: as many as torch uses, one a core if nobody set it.
        progress: show a progress bar, if standard error is a terminal.
        batch: pictures that go through the network together.
        workers: processes that share the encoding, one thread each; None: this process alone, with `threads`. Under
            Ray's "local" processors, None for all.
        ray: address of a Ray cluster that encodes instead, see `ray_cluster.connected`; files of pictures must have
            the same path on all nodes.

    Raises:
        EncoderError: see `find_record`; or a scene has no pictures, or a process died.
        SceneError: the pictures of a scene's file are damaged.
        RunError: Ray is asked for and cannot be had.
    """
    here = workers is None and ray is None
    with (
        torch_threads(threads),
        work_progress("encoding", sum(scene.state_count for scene in scenes), progress) as show_done,
    ):
        record = find_record(encoder, scenes, seed=seed) if isinstance(encoder, str) else encoder
        shaped_by = {"threads": threads_in_use() if here else 1, "batch": batch}
        work = Work(partial(_open, encoder_from_record, record, None if here else 1), _encode, _died)
        encoded, done = [], 0
        with workers_for(work, workers=workers, ray=ray) as crew:
            for scene in scenes:
                pictures = pictures_of(scene, sensor_of(record))
                key = joint_key(content_key(pictures), record.identity, shaped_by)
                make = partial(_encode_all, crew, pictures, batch, show_done, done)
                features = cached("features", key, make).arrays["features"]
                done += scene.state_count
                show_done(done)
                encoded.append(scene.with_features(features, record))
    return encoded


def encoded(scene: Scene, encoder: Encoder) -> Scene:
    """A scene with features of its pictures, made in this process with the threads it has, and not kept in the cache.

    Raises:
        EncoderError: the scene has nothing of the encoder's sensor.
    """
    pictures = pictures_of(scene, sensor_of(encoder.record))
    return scene.with_features(features_of(pictures, encoder), encoder.record)


def features_of(pictures: Observations, encoder: Encoder) -> np.ndarray:
    """Features (N, F) float32 of N pictures, as `encoded` makes them."""
    return np.concatenate([_encode(encoder, batch) for batch in _batches(pictures, BATCH_PICTURES)])


def kept_features(pictures: Observations, encoder: Encoder) -> np.ndarray:
    """`features_of`, kept in the user's cache folder as those of scenes are; the encoder's record says what it is."""
    shaped_by = {"threads": threads_in_use(), "batch": BATCH_PICTURES}
    key = joint_key(content_key(pictures), encoder.record.identity, shaped_by)
    return cached("features", key, lambda: Entry({"features": features_of(pictures, encoder)})).arrays["features"]


def _open(load: Callable[[EncoderRecord], Encoder], record: EncoderRecord, threads: int | None) -> Encoder:
    """What a worker encodes with: the network, with so many threads; None leaves them as they are."""
    if threads is not None:
        import torch

        torch.set_num_threads(threads)
    return load(record)


def _encode(encoder: Encoder, batch: Batch) -> np.ndarray:
    """Features (B, F) float32 of a batch."""
    pictures, first, last = batch
    return encoder.encode(pictures[first:last])


def _died(batch: Batch, how: str) -> EncoderError:
    remedy = "Run the command again, with fewer --workers where memory is short"
    return EncoderError(f"an encoding process {how}. {remedy}")


def _batches(pictures: Observations, size: int) -> Iterator[Batch]:
    """Batches of pictures (S, height, width, 3).

    Pictures in memory are cut to the batch, so that no process is sent more than it needs.
    """
    for first in range(0, pictures.shape[0], size):
        last = min(first + size, pictures.shape[0])
        if isinstance(getattr(pictures, "raw", pictures), np.ndarray):
            yield pictures[first:last], 0, last - first
        else:
            yield pictures, first, last


def _encode_all(
    crew: Workers[Batch, np.ndarray],
    pictures: Observations,
    batch: int,
    show_done: Callable[[int], None],
    done_before: int,
) -> Entry:
    """The features (S, F) float32 of all pictures of a scene, to be cached."""
    parts: list[np.ndarray] = []
    done = done_before
    for part in crew.results(_batches(pictures, batch)):
        parts.append(part)
        done += len(part)
        show_done(done)
    return Entry({"features": np.concatenate(parts)})


def pictures_of(scene: Scene, sensor: str = RGB) -> Observations:
    """What a sensor saw of a scene, to be encoded. Raises EncoderError where there is nothing of it."""
    if not scene.sensors:
        remedy = "Give one with pictures; clearway train learns by the features that its file holds"
        raise EncoderError(f"scene {scene.name} has no pictures to encode. {remedy}")
    try:
        return scene.seen_by(sensor)
    except SceneError as fault:
        raise EncoderError(str(fault)) from fault


def _fitted(
    given: Sequence[Scene] | Callable[[], Sequence[Scene]], seed: int, shape: ResNetShape, preprocessing: Preprocessing
) -> EncoderRecord:
    """The record of a random ResNet calibrated on the scenes, from the cache if it was fitted before."""
    scenes = given() if callable(given) else given
    if not scenes:
        raise EncoderError(f"encoder {RANDOM} is calibrated on the scenes' pictures, and there are none. Name a scene")
    by_key = {content_key(pictures_of(scene)): pictures_of(scene) for scene in scenes}
    ordered = [by_key[key] for key in sorted(by_key)]

    def make() -> Entry:
        with torch_threads(1):  # so that statistics, and with them features, are the same bits however many encode
            record = random_resnet.fit_record(ordered, seed=seed, shape=shape, preprocessing=preprocessing, name=RANDOM)
        return Entry(record.arrays, {"identity": record.identity, "settings": dict(record.settings)})

    request = joint_key(random_resnet.VERSION, seed, shape.to_json(), preprocessing.to_json(), sorted(by_key))
    entry = cached("encoders", request, make)
    settings = entry.note["settings"]
    assert isinstance(settings, dict)
    return EncoderRecord(RANDOM, str(entry.note["identity"]), settings, entry.arrays)
