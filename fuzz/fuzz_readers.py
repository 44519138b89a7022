"""Feed mutated files to every reader, guided by coverage (atheris, libFuzzer).

    python fuzz/fuzz_readers.py -max_total_time=60      # pip install atheris (in the extra dev on Linux)

The first byte of an input chooses the reader, the rest is the file. Whatever a file holds, a reader may only give back
what it read or raise a `ClearwayError`; anything else ends the run with the input kept in a file `crash-*`. The corpus
is made on the spot from one sound file of each kind.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
import tempfile
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["clearway"]):
    from clearway.cli.config import with_config
    from clearway.cli.main import Command
    from clearway.deploy.agent import MAX_PICTURE_SIDE
    from clearway.deploy.onnx_file import check_seal, sealed
    from clearway.deploy.onnx_graph_check import problem_of
    from clearway.errors import ClearwayError
    from clearway.evaluation.episode_files import read_episodes
    from clearway.importers.archives import unpacked
    from clearway.importers.avd import read_avd
    from clearway.importers.images import read_images
    from clearway.importers.mjcf_files import files_of_model
    from clearway.importers.savn import read_savn
    from clearway.learn.checkpoint import read_network
    from clearway.learn.run_folder import RunFolder
    from clearway.mapping.map_files import read_map
    from clearway.scenes.floor_plan_files import floor_plan_names, read_floor_plan
    from clearway.scenes.floor_plans import FloorPlan
    from clearway.scenes.plan_scenes import floor_plan_scene
    from clearway.scenes.thor_v1 import read_scene, write_scene
    from clearway.serve.decoding import Bounds, Refused, decoded
    from clearway.serve.limits import Limits

import numpy as np
from PIL import Image

LARGEST = 200_000  # bytes of an input
BOUNDS = Bounds(Limits().picture_pixels, MAX_PICTURE_SIDE, Limits().picture_scans)
PLAN = FloorPlan("plan", np.array([[0, 0], [0, 1], [1, 1]]))


def read_everything(path: Path) -> None:
    """A scene file, and its pictures where it has any."""
    scene = read_scene(path)
    if scene.observations is not None and np.prod(scene.observations.shape) < 10**8:
        scene.observations[:]


def read_plans(path: Path) -> None:
    """All plans of a file."""
    for name in floor_plan_names(path)[:5]:
        read_floor_plan(path, name)


def read_archive(path: Path) -> None:
    """An archive of scene files."""
    with unpacked([path], (".h5",)) as files:
        for file in files[:3]:
            read_everything(file)


def read_graph(path: Path) -> None:
    """What stands before onnxruntime: the seal, and the check of what a graph asks for."""
    content = path.read_bytes()
    with contextlib.suppress(ValueError):  # no message of protobuf, which `read_onnx` tells in a line
        problem_of(content)
    check_seal(content, str(path))


def read_picture(path: Path) -> None:
    """A picture of a client of the service."""
    with contextlib.suppress(Refused):
        decoded(path.read_bytes(), BOUNDS)


def read_config(path: Path) -> None:
    """Settings of a training."""
    with_config(["train", "x.h5", "--config", str(path)], Command)


def picture_bytes(kind: str) -> bytes:
    """A small picture with some structure."""
    file = io.BytesIO()
    pixels = np.add.outer(np.arange(24), 3 * np.arange(32))[..., None] * np.array([1, 2, 3])
    Image.fromarray(pixels.astype(np.uint8)).save(file, kind, **({"progressive": True} if kind == "JPEG" else {}))
    return file.getvalue()


def scene_bytes() -> bytes:
    """A small scene file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.h5"
        write_scene(floor_plan_scene(PLAN, feature_count=4), path)
        return path.read_bytes()


def npz_bytes() -> bytes:
    """Two floor plans."""
    file = io.BytesIO()
    np.savez(file, hall=PLAN.cells, room=np.array([[True, False], [True, True]]))
    return file.getvalue()


def zip_bytes() -> bytes:
    """An archive with one scene file."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("scenes/scene.h5", scene_bytes())
    return file.getvalue()


def savn_bytes() -> bytes:
    """A node-link graph of two poses."""
    keys = ["0.00|0.00|0|0", "0.00|0.25|0|0"]
    graph = {"nodes": [{"id": key} for key in keys], "links": [{"source": keys[0], "target": keys[1]}]}
    return json.dumps(graph).encode()


def avd_bytes() -> bytes:
    """Links of three pictures."""
    turns = {"forward": "", "backward": ""}
    names = ["a.jpg", "b.jpg", "c.jpg"]
    entries = {
        name: {**turns, "rotate_cw": names[(k + 1) % 3], "rotate_ccw": names[(k - 1) % 3]}
        for k, name in enumerate(names)
    }
    return json.dumps(entries).encode()


def network_bytes() -> bytes:
    """A network's tensors; the manifest beside them is missing, so they are looked at and refused."""
    from safetensors.numpy import save

    return save({"network.x": np.zeros((2, 3), np.float32)})


def episodes_bytes() -> bytes:
    """An episode table of one episode."""
    columns = ("target", "start", "steps", "collisions", "reached", "looped", "shortest_path_steps")
    return json.dumps({"format_version": 1, "about": {}, "episodes": {key: [1] for key in columns}}).encode()


def map_bytes() -> bytes:
    """Tensors of the names that a map has."""
    from safetensors.numpy import save

    shapes = {"room": (5, 5), "shut": (4, 5, 5), "taken": (1, 3), "features": (1, 3)}
    return save({name: np.zeros(shape, np.float32) for name, shape in shapes.items()})


def graph_bytes() -> bytes:
    """A graph of one node with two attributes, sealed."""
    mark = b"clearway.sha256" + b"\x12\x40" + b"0" * 64
    node = b"\x22\x03Add" + b"\x2a\x04\x32\x02\x0a\x00" + b"\x2a\x06\x2a\x04\x08\x01\x10\x01"
    graph = bytes([10, len(node)]) + node
    return sealed(bytes([0x3A, len(graph)]) + graph + bytes([0x72, len(mark) + 2, 10, 15]) + mark)


READERS: tuple[tuple[str, Callable[[Path], object], Callable[[], bytes]], ...] = (
    ("scene.h5", read_everything, scene_bytes),
    ("plan.txt", read_plans, lambda: b"..#\n...\n"),
    ("plan.csv", read_plans, lambda: b"x,z\n0,0\n0,1\n"),
    ("plans.npz", read_plans, npz_bytes),
    ("dumps.zip", read_archive, zip_bytes),
    ("graph.json", lambda path: read_savn(path.parent), savn_bytes),
    ("annotations.json", lambda path: read_avd(path.parent), avd_bytes),
    ("poses.csv", lambda path: read_images(path, step_m=0.5), lambda: b"file,x,z,heading\nposes.csv,0,0,0\n"),
    ("network.safetensors", lambda path: read_network(path.parent), network_bytes),
    ("trial.json", read_episodes, episodes_bytes),
    (
        "world.xml",
        files_of_model,
        lambda: (
            b'<mujoco><compiler meshdir="a"/><include file="world.xml"/><asset><mesh file="b.stl"/></asset></mujoco>'
        ),
    ),
    ("agent.onnx", read_graph, graph_bytes),
    ("metrics.jsonl", lambda path: RunFolder(path.parent).metrics(), lambda: b'{"frames": 80, "seconds": 1}\n' * 2),
    ("room.map", lambda path: read_map(path, "eyes", 0.5, 3), map_bytes),
    ("seen.jpg", read_picture, lambda: picture_bytes("JPEG")),
    ("seen.png", read_picture, lambda: picture_bytes("PNG")),
    ("seen.webp", read_picture, lambda: picture_bytes("WEBP")),
    ("run.yaml", read_config, lambda: b"frames: 6e5\nset: {envs: 10}\n"),
    ("other.yaml", read_config, lambda: b'frames: 1:30\nseed: !!bool "zzz"\nout: 2020-12-24\n'),
)


def one_input(data: bytes) -> None:
    """Hand one file to one reader."""
    if not data:
        return
    name, reader, _ = READERS[data[0] % len(READERS)]
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        path = Path(folder) / name
        path.write_bytes(data[1:])
        with contextlib.suppress(ClearwayError):
            reader(path)


def write_corpus(folder: Path) -> None:
    """A sound file for each reader."""
    for number, (name, _, content) in enumerate(READERS):
        (folder / name).write_bytes(bytes([number]) + content())


def main() -> None:
    """Fuzz until told to stop; further arguments go to libFuzzer."""
    with tempfile.TemporaryDirectory() as corpus:
        write_corpus(Path(corpus))
        atheris.Setup([*sys.argv, f"-max_len={LARGEST}", "-rss_limit_mb=4096", "-timeout=30", corpus], one_input)
        atheris.Fuzz()


if __name__ == "__main__":
    main()
