"""Hostile scene files (HDF5): damaged ones of our own, and dumps that lie, link, loop or unpack without end."""

from __future__ import annotations

import hashlib
import json
import tempfile
import warnings
import zlib
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path

import h5py
import numpy as np

from clearway.scenes.export import export_thor_v1
from clearway.scenes.file_pictures import BLOCK_PICTURES
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import FORMAT_VERSION, read_scene, write_scene
from clearway.scenes.validate import SceneWarning
from helpers.dumps import full_scene, published_dump, replaced
from helpers.made import corridor_scene
from hostile.cases import Case, Sound

Change = Callable[[h5py.File], object]
GIB = 1024**3


def digest(scene: Scene) -> str:
    """Of all that a scene holds; its pictures are looked at block by block."""
    found = hashlib.sha256()
    arrays = [scene.graph, scene.locations_m, scene.headings_deg]
    arrays += [] if scene.features is None else [scene.features]
    arrays += [scene.top_view.image] if scene.top_view else []
    arrays += [scene.encoder.arrays[name] for name in sorted(scene.encoder.arrays)] if scene.encoder else []
    if scene.observations is not None:
        starts = range(0, scene.observations.shape[0], BLOCK_PICTURES)
        arrays += [scene.observations[start : start + BLOCK_PICTURES] for start in starts]
    arrays += [readings[:] for readings in scene.further]
    for array in arrays:
        found.update(f"{array.shape} {array.dtype}".encode())
        found.update(np.ascontiguousarray(array).data if array.size else b"")
    view, encoder = scene.top_view, scene.encoder
    texts = [
        asdict(scene.made_by),
        scene.cell_size_m,
        [asdict(readings.sensor) for readings in scene.further],
        view and [view.x_min_m, view.x_max_m, view.z_min_m, view.z_max_m],
        encoder and [encoder.name, encoder.identity, encoder.settings, sorted(encoder.arrays)],
    ]
    found.update(json.dumps(texts, sort_keys=True, default=dict).encode())
    return found.hexdigest()


def read(path: Path) -> str:
    """Everything in a scene file."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SceneWarning)
        return digest(read_scene(path, name="scene"))


def ours() -> Sound:
    """A scene file of ours in which nothing is missing."""
    content = written(lambda path: write_scene(full_scene(), path))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.h5"
        path.write_bytes(content)
        return Sound("our scene files", "scene.h5", content, read, same=read(path))


def published() -> Sound:
    """A scene in the published layout, without checksums: damage to its values cannot be seen."""
    content = written(lambda path: export_thor_v1(corridor_scene(4), path))
    return Sound("published dumps", "dump.h5", content, read)


def written(write: Callable[[Path], object]) -> bytes:
    """The bytes of a file that `write` writes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file.h5"
        write(path)
        return path.read_bytes()


def cases(flips: int) -> Iterator[Case]:
    """All hostile scene files; `flips` of ours have a flipped bit. Below 1,000, others are damaged less often too."""
    whole = ours()
    yield from whole.flipped(flips)
    yield from whole.cut(100)
    yield from whole.overwritten(min(150, flips // 4))
    yield whole.case("with something behind", "its own bytes again", whole.content * 2)
    yield whole.case("with something behind", "zeros", whole.content + bytes(4096))
    plain = published()
    yield from plain.flipped(min(250, flips // 4))
    yield from plain.cut(40)
    yield from plain.overwritten(60)
    for name, (change, says) in FAULTS.items():
        yield Case("faulty dumps", name, _changed_dump(change), read, says)
    for name, (attribute, value, says) in ATTRIBUTES.items():
        yield Case("faulty attributes", name, _changed_attribute(attribute, value), read, says)
    for name, (content, says) in NO_SCENES.items():
        yield Case("no scene files", name, _written(content), read, says)
    yield Case("no scene files", "a folder", lambda folder: folder, read, "is a folder")
    yield Case("no scene files", "nothing", lambda folder: folder / "none.h5", read, "there is no such file")


def _changed_dump(change: Change) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        published_dump(folder / "dump.h5", change)
        return folder / "dump.h5"

    return make


def _changed_attribute(name: str, value: object) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        write_scene(full_scene(), folder / "scene.h5")
        with h5py.File(folder / "scene.h5", "r+") as file:
            file.attrs[name] = value
        return folder / "scene.h5"

    return make


def _written(content: bytes) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        (folder / "scene.h5").write_bytes(content)
        return folder / "scene.h5"

    return make


def drop_what_is_seen(file: h5py.File) -> None:
    del file["observation"], file["resnet_feature"]


def link_out(file: h5py.File) -> None:
    del file["graph"]
    file["graph"] = h5py.ExternalLink("other.h5", "graph")


def link_within(file: h5py.File) -> None:
    file.move("graph", "hidden")
    file["graph"] = h5py.SoftLink("/hidden")


def link_to_itself(file: h5py.File) -> None:
    del file["graph"]
    file["graph"] = h5py.SoftLink("/graph")


def link_encoder_to_the_root(file: h5py.File) -> None:
    file.attrs["encoder"] = '{"name": "x", "identity": "y"}'
    file["encoder"] = file["/"]


def crowd_the_encoder(file: h5py.File) -> None:
    file.attrs["encoder"] = '{"name": "x", "identity": "y"}'
    for number in range(1001):
        file[f"encoder/{number}"] = 0


def name_an_array_after_terminal_codes(file: h5py.File) -> None:
    file.attrs["encoder"] = '{"name": "x", "identity": "y"}'
    file["encoder/\x1b[2J\nnews"] = "text"


def make_virtual(file: h5py.File) -> None:
    layout = h5py.VirtualLayout(shape=(16, 4), dtype=np.int32)
    layout[:] = h5py.VirtualSource("other.h5", "graph", shape=(16, 4))
    del file["graph"]
    file.create_virtual_dataset("graph", layout)


def store_outside(file: h5py.File) -> None:
    del file["location"]
    outside = [("outside.bin", 0, h5py.h5f.UNLIMITED)]
    file.create_dataset("location", (16, 2), np.float32, external=outside)


def remade(name: str, shape: tuple[int, ...], dtype: object, **storage: object) -> Change:
    """A dataset of which nothing was written."""

    def change(file: h5py.File) -> None:
        del file[name]
        file.create_dataset(name, shape, dtype, **storage)

    return change


def repacked(name: str, **storage: object) -> Change:
    """The same values, stored in another way."""

    def change(file: h5py.File) -> None:
        values = file[name][()]
        del file[name]
        file.create_dataset(name, data=values, **storage)

    return change


def bomb(name: str, size: int) -> Change:
    """A first chunk that unpacks to many times its size."""

    def change(file: h5py.File) -> None:
        values = file[name][()]
        del file[name]
        dataset = file.create_dataset(name, data=values, compression="gzip", chunks=values.shape)
        dataset.id.write_direct_chunk((0,) * values.ndim, zeros_deflated(size))

    return change


def sensed(shape: tuple[int, ...] = (16, 12, 16), change: Change | None = None, **storage: object) -> Change:
    """A depth sensor, of zeros where no storage is named and else never written; then another change of the file."""

    def all_of_it(file: h5py.File) -> None:
        values = None if storage else np.zeros(shape, np.uint16)
        dataset = file.create_dataset("sensors/depth", shape, np.uint16, data=values, **storage)
        dataset.attrs.update({"dtype": "float32", "unit": "m", "low": 0.0, "high": 20.0, "step": 0.001})
        if change is not None:
            change(file)

    return all_of_it


def unpack_depth_without_end(file: h5py.File) -> None:
    file["sensors/depth"].id.write_direct_chunk((0, 0, 0), zeros_deflated(GIB))


def link_the_sensors_out(file: h5py.File) -> None:
    file["sensors"] = h5py.ExternalLink("other.h5", "/sensors")


def link_depth_out(file: h5py.File) -> None:
    file["sensors/depth"] = h5py.ExternalLink("other.h5", "/depth")


def zeros_deflated(size: int) -> bytes:
    """A zlib stream of so many zero bytes (whole MiB), put together from the same MiB again and again."""
    packer = zlib.compressobj(6, zlib.DEFLATED, -zlib.MAX_WBITS)
    piece = packer.compress(bytes(1 << 20)) + packer.flush(zlib.Z_FULL_FLUSH)
    checksum = size % 65521 << 16 | 1
    return b"\x78\x9c" + piece * (size >> 20) + b"\x03\x00" + checksum.to_bytes(4, "big")


def fill_the_encoder_with_zeros(file: h5py.File) -> None:
    """1 GiB of statistics, all of whose chunks are the same megabyte of zeros."""
    file.attrs["encoder"] = '{"name": "x", "identity": "y"}'
    dataset = file.create_dataset("encoder/zeros", (GIB,), np.uint8, chunks=(1 << 24,), compression="gzip")
    packed = zeros_deflated(1 << 24)
    for start in range(0, GIB, 1 << 24):
        dataset.id.write_direct_chunk((start,), packed)


def pack_twice(file: h5py.File) -> None:
    del file["graph"]
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_chunk((16, 4))
    plan.set_deflate(9)
    plan.set_deflate(9)
    file.create_dataset("graph", data=SCENE.graph, dcpl=plan)


def pack_by_scale_and_offset(file: h5py.File) -> None:
    del file["graph"]
    file.create_dataset("graph", data=SCENE.graph, scaleoffset=6)


def grow_to_a_million_states(file: h5py.File) -> None:
    count = 10**6
    states = np.arange(count)
    turned = [states // 4 * 4 + (states + turn) % 4 for turn in (1, 3)]
    parts = {
        "graph": np.stack([np.full(count, -1), *turned, np.full(count, -1)], axis=1).astype(np.int32),
        "location": np.stack([states // 4 % 1000, states // 4000], axis=1).astype(np.float32),
        "rotation": (states % 4 * 90).astype(np.float32),
        "resnet_feature": np.ones((count, 1, 1), np.float32),
    }
    for name in (*parts, "observation", "shortest_path_distance"):
        del file[name]
    for name, values in parts.items():
        file.create_dataset(name, data=values, compression="gzip")


def share_poses(file: h5py.File) -> None:
    """All locations the same, all headings the same."""
    file["location"][:] = 1
    file["rotation"][:] = 90


def lead_one_way(file: h5py.File) -> None:
    """Moves that are no way back."""
    graph = SCENE.graph.copy()
    graph[:, [0, 3]] = np.random.default_rng(0).integers(16, size=(16, 2))
    file["graph"][:] = graph


def wide_compound(file: h5py.File) -> None:
    del file["graph"]
    file["graph"] = np.zeros((16, 4), [(f"field_{number}", "i4") for number in range(500)])


def vlen(kind: object) -> Change:
    return remade("graph", (16, 4), h5py.vlen_dtype(kind))


def references(file: h5py.File) -> None:
    del file["graph"]
    dataset = file.create_dataset("graph", (16, 4), h5py.ref_dtype)
    dataset[:] = file["location"].ref


SCENE = corridor_scene(4)
WHOLE = "dataset 'graph': holds something else than whole numbers from -1 to 15"
UNWRITTEN = "values were written"
FAULTS: dict[str, tuple[Change, str]] = {
    "graph too high": (replaced("graph", SCENE.graph + 1), WHOLE),
    "graph too low": (replaced("graph", SCENE.graph - 1), WHOLE),
    "graph of halves": (replaced("graph", SCENE.graph + 0.5), WHOLE),
    "graph of NaN": (replaced("graph", np.full((16, 4), np.nan)), WHOLE),
    "graph of Inf": (replaced("graph", np.full((16, 4), np.inf)), WHOLE),
    "graph beyond int64": (replaced("graph", np.full((16, 4), 2**63, np.uint64)), WHOLE),
    "graph of three actions": (replaced("graph", SCENE.graph[:, :3]), "has shape (16, 3), expected (any, 4)"),
    "no state": (replaced("graph", np.zeros((0, 4), np.int32)), "dataset 'graph': has 0 states"),
    "one state": (replaced("graph", np.zeros((1, 4), np.int32)), "dataset 'graph': has 1 states"),
    "graph is a number": (replaced("graph", 5), "dataset 'graph': has shape (), expected"),
    "graph is a text": (replaced("graph", "text"), "dataset 'graph': has shape (), expected"),
    "graph is empty": (replaced("graph", h5py.Empty("f4")), "dataset 'graph': has shape None, expected"),
    "graph of bytes": (replaced("graph", np.full((16, 4), b"ab")), "dataset 'graph': holds |S2, expected numbers"),
    "graph of a compound": (replaced("graph", np.zeros((16, 4), [("a", "i4")])), "expected numbers"),
    "graph of 500 fields": (wide_compound, "expected numbers"),
    "graph of complex numbers": (replaced("graph", np.zeros((16, 4), complex)), "expected numbers"),
    "graph of texts of any length": (vlen(str), "expected numbers"),
    "graph of arrays of any length": (vlen(np.int32), "expected numbers"),
    "graph of references": (references, "expected numbers"),
    "graph of opaque values": (replaced("graph", np.zeros((16, 4), "V8")), "expected numbers"),
    "graph is a group": (lambda file: (file.pop("graph"), file.create_group("graph")), "is not a dataset"),
    "graph is missing": (lambda file: file.pop("graph"), "dataset 'graph': is missing"),
    "graph that leads one way": (lead_one_way, ""),
    "graph of big-endian numbers": (replaced("graph", SCENE.graph.astype(">i8")), ""),
    "locations too few": (replaced("location", SCENE.locations_m[:-1]), "dataset 'location': has shape (15, 2)"),
    "locations at infinity": (replaced("location", np.full((16, 2), np.inf)), "dataset 'location': holds NaN, Inf"),
    "locations far away": (replaced("location", np.full((16, 2), 1e300)), "more than 10,000 m"),
    "locations hardly apart": (replaced("location", SCENE.locations_m * 1e-300), ""),
    "headings of NaN": (replaced("rotation", np.full(16, np.nan)), "dataset 'rotation': holds no headings"),
    "headings too large": (replaced("rotation", SCENE.headings_deg * 1000), "dataset 'rotation': holds no headings"),
    "poses that are all the same": (share_poses, ""),
    "features of NaN": (replaced("resnet_feature", np.full((16, 1, 8), np.nan)), "hold NaN or Inf"),
    "features of Inf": (replaced("resnet_feature", np.full((16, 1, 8), -np.inf)), "hold NaN or Inf"),
    "features beyond float32": (replaced("resnet_feature", np.full((16, 1, 8), 1e300)), "hold NaN or Inf"),
    "no features": (replaced("resnet_feature", np.zeros((16, 0, 8), np.float32)), "has shape (16, 0, 8)"),
    "features of integers": (replaced("resnet_feature", np.zeros((16, 1, 8), np.int32)), "expected numbers"),
    "features too few": (replaced("resnet_feature", np.zeros((15, 1, 8), np.float32)), "has shape (15, 1, 8)"),
    "pictures of 16 bits": (replaced("observation", SCENE.observations.astype(np.uint16)), "expected uint8"),
    "pictures of two colours": (replaced("observation", SCENE.observations[..., :2]), "dataset 'observation': has"),
    "distances too few": (replaced("shortest_path_distance", np.zeros((3, 3))), "has shape (3, 3)"),
    "nothing to be seen": (drop_what_is_seen, "neither pictures nor features"),
    "a link to another file": (link_out, "dataset 'graph': is a link"),
    "a link within the file": (link_within, "dataset 'graph': is a link"),
    "a link to itself": (link_to_itself, "dataset 'graph': is a link"),
    "a group within itself": (link_encoder_to_the_root, "dataset 'encoder': is not a dataset"),
    "a crowded group": (crowd_the_encoder, "is not a group of at most 1000 arrays"),
    "a name that clears the terminal": (name_an_array_after_terminal_codes, r"\x1b[2J\nnews"),
    "a virtual dataset": (make_virtual, "dataset 'graph': keeps its values in another file"),
    "external storage": (store_outside, "dataset 'location': keeps its values in another file"),
    "7 TiB of features": (remade("resnet_feature", (16, 1, 2**37), "f4", chunks=(1, 1, 64)), "1 to 65536 features"),
    "7 TiB of pictures": (remade("observation", (16, 700_000, 230_000, 3), "u1", chunks=(1, 64, 64, 3)), "sides up to"),
    "7 TiB of graph": (remade("graph", (2**39, 4), "i4", chunks=(64, 4)), "more than the limit"),
    "7 TiB of graph in one piece": (remade("graph", (2**39, 4), "i4"), "more than the limit"),
    "a million states": (grow_to_a_million_states, "dataset 'graph': would take 16,000,000 bytes, more than the limit"),
    "huge chunks": (
        remade("resnet_feature", (16, 1, 8), "f4", chunks=(1, 1, 2**25), maxshape=(16, 1, None)),
        "dataset 'resnet_feature': its chunks",
    ),
    "a graph never written": (remade("graph", (16, 4), "i4"), UNWRITTEN),
    "features never written": (remade("resnet_feature", (16, 1, 8), "f4", chunks=(4, 1, 8)), UNWRITTEN),
    "pictures never written": (remade("observation", (16, 12, 16, 3), "u1"), UNWRITTEN),
    "a graph that unpacks to a GiB": (bomb("graph", GIB), "dataset 'graph': is damaged (the chunk at (0, 0)"),
    "features that unpack to a GiB": (bomb("resnet_feature", GIB), "dataset 'resnet_feature': is damaged"),
    "pictures that unpack to a GiB": (bomb("observation", GIB), "dataset 'observation': is damaged"),
    "depth": (sensed(), ""),
    "depth never written": (sensed(chunks=(1, 12, 16)), UNWRITTEN),
    "depth of too few poses": (sensed((15, 12, 16)), "dataset 'sensors/depth': has shape (15, 12, 16)"),
    "7 TiB of depth": (sensed((16, 700_000, 300_000), chunks=(1, 64, 64)), "sides up to"),
    "depth that unpacks to a GiB": (
        sensed(change=unpack_depth_without_end, chunks=(16, 12, 16), compression="gzip"),
        "dataset 'sensors/depth': is damaged",
    ),
    "sensors in another file": (link_the_sensors_out, "dataset 'sensors': is not a group"),
    "depth in another file": (link_depth_out, "dataset 'depth': is a link"),
    "a GiB of zeros": (fill_the_encoder_with_zeros, "dataset 'encoder/zeros': would take 1,073,741,824 bytes"),
    "packed twice": (pack_twice, "dataset 'graph': is packed in an odd order"),
    "packed by scale and offset": (pack_by_scale_and_offset, "dataset 'graph': is packed with the filter 6"),
    "packed by lzf": (repacked("graph", compression="lzf", shuffle=True), ""),
}
ATTRIBUTES: dict[str, tuple[str, object, str]] = {
    "a newer format": ("format_version", FORMAT_VERSION + 1, "reads up to 1. Upgrade clearway"),
    "a version in words": ("format_version", "new", "attribute 'format_version' is 'new'"),
    "a cell of NaN": ("cell_size_m", np.nan, "attribute 'cell_size_m' is nan"),
    "a cell of nothing": ("cell_size_m", 0.0, "attribute 'cell_size_m' is 0.0"),
    "several cell sizes": ("cell_size_m", np.ones(3), "neither a number nor a text"),
    "a compound": ("cell_size_m", np.zeros((), [("a", "f4")]), "neither a number nor a text"),
    "a thousand texts": ("made_by", np.array(["x" * 10_000] * 5, object), "neither a number nor a text"),
    "no JSON": ("made_by", "{", "attribute 'made_by' is not JSON"),
    "JSON 10,000 deep": ("made_by", "[" * 10_000, "attribute 'made_by' is not JSON"),
    "a JSON list": ("made_by", "[1]", "attribute 'made_by' is not a JSON object"),
    "no source": ("made_by", '{"source": 5}', "lacks the text 'source'"),
    "versions that are a number": ("made_by", '{"source": "room", "versions": 3}', "no object as 'versions'"),
    "a number of 5,000 digits": ("made_by", '{"source": ' + "9" * 5000 + "}", "attribute 'made_by'"),
    "an encoder without identity": ("encoder", '{"name": "x"}', "lacks the text 'identity'"),
}
NO_SCENES: dict[str, tuple[bytes, str]] = {
    "a text": (b"hello", "is not an HDF5 file"),
    "an empty file": (b"", "is not an HDF5 file"),
    "an archive": (b"PK\x03\x04" + bytes(600), "is not an HDF5 file"),
    "HDF5's first bytes": (b"\x89HDF\r\n\x1a\n", "cannot be opened as HDF5"),
    "HDF5's first bytes, then zeros": (b"\x89HDF\r\n\x1a\n" + bytes(5000), "cannot be opened as HDF5"),
}
