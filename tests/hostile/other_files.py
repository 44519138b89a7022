"""Hostile files of the importers' own formats (JSON, CSV, pictures, archives, floor plans) and of runs."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import stat
import tempfile
import warnings
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from pathlib import Path

import h5py
import numpy as np
from PIL import Image
from safetensors.torch import save

from clearway.evaluation.episode_files import read_episodes
from clearway.importers.archives import unpacked
from clearway.importers.avd import read_avd
from clearway.importers.images import read_images
from clearway.importers.savn import read_savn
from clearway.learn.checkpoint import FORMAT_VERSION, MANIFEST_FILE, NETWORK_FILE, TRAINING_FILE, newest_checkpoint
from clearway.learn.load import load_agent
from clearway.learn.run_folder import RunFolder
from clearway.learn.train import train
from clearway.mapping.map_files import read_map, write_map
from clearway.mapping.room_map import RoomMap
from clearway.scenes.floor_plan_files import floor_plan_names, read_floor_plan
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import write_scene
from clearway.scenes.validate import SceneWarning
from helpers.made import corridor_scene
from helpers.small_runs import small_learner, small_request
from hostile import scene_files
from hostile.cases import Case, Sound

DEEP = "[" * 100_000
ZIP_METHODS = {"bzip2": zipfile.ZIP_BZIP2, "LZMA": zipfile.ZIP_LZMA}


def cases(flips: int) -> Iterator[Case]:
    """All of them; of each kind of file up to 60 have a flipped bit, fewer where `flips` is below 240."""
    for sound in (*plans(), archive(), poses(), *pictures(), savn(), avd()):
        yield from sound.flipped(min(60, flips // 4))
        yield from sound.cut(15)
        yield from sound.overwritten(9)
    for name, (content, says) in ARCHIVES.items():
        yield Case("hostile archives", name, _file("dumps.zip", content), read_archive, says)
    for name, (content, says) in PLANS.items():
        yield Case("hostile floor plans", name, _file("plans.npz", content), read_plans, says)
    for name, (row, says) in TABLES.items():
        yield Case("hostile tables", name, _beside_a_picture(row), read_table, says)
    for name, (content, says) in PICTURES.items():
        sound = replace(pictures()[0], content=content(), group="hostile pictures")
        yield replace(sound.case("bombs", name, sound.content), says=says)
    for name, (text, says) in GRAPHS.items():
        yield replace(savn().case("JSON", name, text.encode()), says=says)
    for name, (text, says) in LINKS.items():
        yield replace(avd().case("JSON", name, text.encode()), says=says)
    yield from run_cases()


def look_at(scene: Scene) -> str:
    return scene_files.digest(scene)


def quietly(read: Callable[[Path], str]) -> Callable[[Path], str]:
    """Without the warnings about what is odd."""

    def quiet(path: Path) -> str:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SceneWarning)
            warnings.simplefilter("ignore", UserWarning)  # Pillow's, about broken metadata
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            return read(path)

    return quiet


def _file(name: str, content: Callable[[], bytes]) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        (folder / name).write_bytes(content())
        return folder / name

    return make


def read_plans(path: Path) -> str:
    return str([read_floor_plan(path, name).cells.tolist() for name in floor_plan_names(path)[:5]])


def plans() -> list[Sound]:
    file = io.BytesIO()
    np.savez_compressed(file, hall=np.array([[0, 0], [0, 1]]), room=np.array([[True, False], [True, True]]))
    return [
        Sound("floor plans", "plans.npz", file.getvalue(), read_plans),
        Sound("floor plans", "plan.txt", b"..#\n...\n", read_plans),
        Sound("floor plans", "plan.csv", b"x,z\n0,0\n0,1\n", read_plans),
    ]


def npy(header: str, values: bytes = b"") -> bytes:
    text = header.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + values


def npz(content: bytes, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    return zipped({"hall.npy": content}, method)


def zipped(members: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return file.getvalue()


HEADER = "{'descr': %s, 'fortran_order': False, 'shape': %s}"
PLANS: dict[str, tuple[Callable[[], bytes], str]] = {
    "8 TB in a header": (lambda: npz(npy(HEADER % ("'<i8'", "(500000000000, 2)"))), "claims 8,000,000,000,000 bytes"),
    "6 GB in a header": (lambda: npz(npy(HEADER % ("'<i8'", "(400000000, 2)"))), "claims 6,400,000,000 bytes"),
    "fewer than none": (lambda: npz(npy(HEADER % ("'<i8'", "(-1, 2)"))), "cannot be read"),
    "a pickle": (lambda: npz(npy(HEADER % ("'|O'", "(1, 2)"), b"cos\nsystem\n(S'true'\ntR.")), "allow_pickle=False"),
    "a header that is code": (lambda: npz(npy("__import__('os').abort()")), "cannot be read"),
    "a header too deep": (lambda: npz(npy("(" * 100)), "cannot be read"),
    "a name that leads out": (lambda: zipped({"../../hall.npy": b"x"}), "is no name for a file"),
    **{
        f"packed by {name}": (lambda method=method: npz(bytes(1 << 22), method), "packed by method")
        for name, method in ZIP_METHODS.items()
    },
}


def read_archive(path: Path) -> str:
    with unpacked([path], (".h5",)) as files:
        return str([scene_files.read(file) for file in files[:3]])


def archive() -> Sound:
    return Sound("archives", "dumps.zip", zipped({"data/scene.h5": scene_files.published().content}), read_archive)


def linked() -> bytes:
    file, member = io.BytesIO(), zipfile.ZipInfo("scene.h5")
    member.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr(member, "/etc/passwd")
    return file.getvalue()


def twice() -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        archive.writestr("scene.h5", b"one")
        archive.writestr("scene.h5", b"two")
    return file.getvalue()


def sharing_bytes() -> bytes:
    """200 members that are all the same 4 MB, which the directory names again and again."""
    one = bytearray(zipped({"000.h5": np.random.default_rng(0).bytes(1 << 20) + bytes(1 << 22)}))
    start = one.index(b"PK\x01\x02")
    end = one.index(b"PK\x05\x06")
    entry, last = bytes(one[start:end]), bytearray(one[end:])
    entries = b"".join(entry.replace(b"000.h5", f"{number:03}.h5".encode()) for number in range(400))
    last[8:12] = (400).to_bytes(2, "little") * 2
    last[12:16] = len(entries).to_bytes(4, "little")
    return bytes(one[:start]) + entries + bytes(last)


ARCHIVES: dict[str, tuple[Callable[[], bytes], str]] = {
    "up and out": (lambda: zipped({"../scene.h5": b"x"}), "leads out of the archive"),
    "up and out on the way": (lambda: zipped({"a/../../scene.h5": b"x"}), "leads out of the archive"),
    "from the root": (lambda: zipped({"/etc/scene.h5": b"x"}), "leads out of the archive"),
    "up and out with backslashes": (lambda: zipped({"..\\scene.h5": b"x"}), "leads out of the archive"),
    "from a drive": (lambda: zipped({"C:/scene.h5": b"x"}), "leads out of the archive"),
    "a link": (linked, "holds the link 'scene.h5'"),
    "one name twice": (twice, "two files named 'scene.h5'"),
    "one name in two folders": (lambda: zipped({"a/scene.h5": b"x", "b/scene.h5": b"y"}), "two files named"),
    "64 MiB of zeros": (lambda: zipped({"scene.h5": bytes(1 << 26)}), "unpacks to more than"),
    "members that share their bytes": (sharing_bytes, "dumps.zip"),
    "an archive in an archive": (lambda: zipped({"in.zip": zipped({"scene.h5": b"x"})}), "holds no scene file"),
    "10,001 files": (lambda: zipped({f"{number}.h5": b"" for number in range(10_001)}), "holds 10001 files"),
    "a name of 300 letters": (lambda: zipped({"a" * 300 + ".h5": b"x"}), "cannot be unpacked"),
    "a name with terminal codes": (lambda: zipped({"../\x1b[2J.h5": b"x"}), r"\x1b[2J"),
    "no scene in it": (lambda: zipped({"scene.h5": b"no"}), "is not an HDF5 file"),
    **{
        f"packed by {name}": (lambda method=method: zipped({"scene.h5": bytes(1 << 20)}, method), "packed by method")
        for name, method in ZIP_METHODS.items()
    },
}


def _beside_a_picture(row: tuple) -> Callable[[Path], Path]:
    return poses().case("", "", table([row])).make


def table(rows: list[tuple]) -> bytes:
    file = io.StringIO(newline="")
    csv.writer(file).writerows([("file", "x", "z", "heading"), *rows])
    return file.getvalue().encode("utf-8", "surrogateescape")


@quietly
def read_table(path: Path) -> str:
    return look_at(
        read_images(path if path.suffix == ".csv" else path.with_name("poses.csv"), step_m=0.5, height_px=30)
    )


def turned_round(name: str) -> bytes:
    return table([(name, 0, z, heading) for z in (0, 0.5) for heading in (0, 90, 180, 270)])


def write_picture(folder: Path) -> None:
    (folder / "p.png").write_bytes(picture_bytes("PNG"))


def poses() -> Sound:
    return Sound("tables of photographs", "poses.csv", turned_round("p.png"), read_table, beside=write_picture)


def picture_bytes(kind: str, size: tuple[int, int] = (40, 30)) -> bytes:
    noise = np.random.default_rng(0).integers(0, 256, (size[1], size[0], 3), np.uint8)
    file, exif = io.BytesIO(), Image.Exif()
    exif[0x0112] = 6
    Image.fromarray(noise).save(file, kind, exif=exif)
    return file.getvalue()


def pictures() -> list[Sound]:
    found = []
    for kind in ("JPEG", "PNG", "WEBP", "TIFF", "BMP"):
        name = f"p.{kind.lower()}"
        beside = _file("poses.csv", lambda name=name: turned_round(name))
        found.append(Sound("photographs", name, picture_bytes(kind), read_table, beside=beside))
    return found


def flat(kind: str, side: int, mode: str = "L") -> Callable[[], bytes]:
    """A picture of one colour, which packs to next to nothing."""

    def made() -> bytes:
        file = io.BytesIO()
        Image.new(mode, (side, side)).save(file, kind)
        return file.getvalue()

    return made


PICTURES: dict[str, tuple[Callable[[], bytes], str]] = {
    "80 megapixels of nothing": (flat("PNG", 8_900, "1"), "8900 x 8900 pixels, more than"),
    "100 megapixels of nothing": (flat("PNG", 10_000, "1"), "10000 x 10000 pixels, more than"),
    "400 megapixels of nothing": (flat("PNG", 20_000, "1"), "cannot be read as a picture"),
    "JPEG of 100 megapixels": (flat("JPEG", 10_000), "pixels, more than"),
    "an empty file": (bytes, "cannot be read as a picture"),
    "a vector file": (lambda: b"<svg xmlns='http://www.w3.org/2000/svg'/>", "cannot be read as a picture"),
    "PostScript": (lambda: b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n", "cannot be read as a picture"),
}
TABLES: dict[str, tuple[tuple, str]] = {
    "a location of NaN": (("p.png", "nan", 0, 0), "line 2 holds 'nan,0,0'"),
    "a location at infinity": (("p.png", "inf", 0, 0), "line 2 holds 'inf,0,0'"),
    "a location of 400 digits": (("p.png", "9" * 400, 0, 0), "line 2 holds"),
    "a picture elsewhere": (("/etc/hostname", 0, 0, 0), "no file in the table's folder"),
    "a picture further up": (("../../../../etc/hostname", 0, 0, 0), "no file in the table's folder"),
    "a name with a null byte": (("a\0b.png", 0, 0, 0), "poses.csv"),
    "a name of a MiB": (("a" * (1 << 20), 0, 0, 0), "poses.csv"),
    "a name with terminal codes": (("\x1b[2J.png", 0, 0, 0), r"\x1b[2J"),
    "a name that is no UTF-8": (("\udcff.png", 0, 0, 0), "is no CSV file"),
}


@quietly
def read_savn_folder(path: Path) -> str:
    return look_at(read_savn(path.parent))


def savn_keys() -> list[str]:
    return [f"{x * 0.25:.2f}|0.00|{heading}|0" for x in (0, 2) for heading in (0, 90, 180, 270)]


def write_savn_pictures(folder: Path) -> None:
    with h5py.File(folder / "images.hdf5", "w") as file:
        for key in savn_keys():
            file[key] = np.zeros((6, 8, 3), np.uint8)


def savn() -> Sound:
    graph = {"nodes": [{"id": key} for key in savn_keys()], "links": []}
    content = json.dumps(graph).encode()
    return Sound("SAVN's graphs", "graph.json", content, read_savn_folder, beside=write_savn_pictures)


def nodes(*keys: str) -> str:
    return json.dumps({"nodes": [{"id": key} for key in keys], "links": []})


GRAPHS: dict[str, tuple[str, str]] = {
    "100,000 deep": (DEEP, "nested too deep"),
    "no graph": ("null", "is no node-link graph"),
    "a number of 5,000 digits": ("9" * 5000, "cannot be read as JSON"),
    "a location at 1e300": (nodes(*(f"1e300|0|{heading}|0" for heading in (0, 90, 180, 270))), "'1e300|0|0|0'"),
    "a location of NaN": (nodes("nan|0|0|0"), "'nan|0|0|0'"),
    "a heading at infinity": (nodes("0|0|inf|0"), "graph.json"),
    "a key of a MiB": (nodes("9" * (1 << 20)), "expected x|z|rotation|horizon"),
    "a key that is no text": ('{"nodes": [{"id": {}}], "links": []}', "expected x|z|rotation|horizon"),
    "half a surrogate": ('{"nodes": [{"id": "\\ud800"}], "links": []}', "expected x|z|rotation|horizon"),
}


@quietly
def read_avd_folder(path: Path) -> str:
    return look_at(read_avd(path.parent, height_px=18))


def write_avd_pictures(folder: Path) -> None:
    (folder / "jpg_rgb").mkdir()
    for name in "abc":
        (folder / "jpg_rgb" / f"{name}.jpg").write_bytes(picture_bytes("JPEG"))


def annotations(**changes: object) -> str:
    names = ["a.jpg", "b.jpg", "c.jpg"]
    found = {}
    for number, name in enumerate(names):
        ends = {"rotate_cw": names[(number + 1) % 3], "rotate_ccw": names[number - 1], "forward": "", "backward": ""}
        found[name] = ends | changes
    return json.dumps(found)


def avd() -> Sound:
    content = annotations().encode()
    return Sound("AVD's annotations", "annotations.json", content, read_avd_folder, beside=write_avd_pictures)


LINKS: dict[str, tuple[str, str]] = {
    "100,000 deep": (DEEP, "nested too deep"),
    "a list": ("[]", "lacks the links"),
    "links that are numbers": (annotations(forward=1e308), "lacks the links"),
    "turns that lead nowhere": (annotations(rotate_cw="x.jpg"), "no picture can be turned round"),
    "turns to itself": (annotations(rotate_cw="a.jpg", rotate_ccw="a.jpg"), "no picture can be turned round"),
    "moves to nowhere": (annotations(forward="../../etc/passwd"), ""),
    "pictures elsewhere": (annotations().replace("a.jpg", "/etc/hostname"), "is no file in jpg_rgb"),
    "pictures with half a surrogate": (annotations().replace("a.jpg", "\\ud800"), "is no file in jpg_rgb"),
}


def run_cases() -> Iterator[Case]:
    """A run folder, file by file."""
    files = run_files()
    checkpoint = next(name for name in files if name.endswith(NETWORK_FILE)).rpartition("/")[0]
    record = json.loads(files["run.json"])
    for name, says in {"run.json": "run.json", f"{checkpoint}/{MANIFEST_FILE}": "every checkpoint is damaged"}.items():
        for kind, text in {"100,000 deep": DEEP, "a list": "[]", "no UTF-8": "\udcff", "no JSON": "{"}.items():
            yield run_case(files, f"{Path(name).name} is {kind}", {name: text.encode("utf-8", "surrogateescape")}, says)
    for name, (value, says) in RECORDS.items():
        learner = record["learner"] | {name: value}
        whole = record | ({"learner": learner} if name in record["learner"] else {name: value})
        yield run_case(files, f"{name} is {str(value)[:20]}", {"run.json": json.dumps(whole).encode()}, says)
    for name in ("", "..", "../../attic", "..\\attic", "attic\0"):  # pictures are files named by the scene
        scenes = [record["scenes"][0] | {"name": name}, *record["scenes"][1:]]
        whole = json.dumps(record | {"scenes": scenes}).encode()
        yield run_case(files, f"a scene is {name!r}", {"run.json": whole}, "cannot be part of a file's name")
    for kind, content in tensor_files(files[f"{checkpoint}/{NETWORK_FILE}"]).items():
        sums = {NETWORK_FILE: content, TRAINING_FILE: files[f"{checkpoint}/{TRAINING_FILE}"]}
        kept = {name: hashlib.sha256(held).hexdigest() for name, held in sums.items()}
        manifest = {"format_version": FORMAT_VERSION, "frames": 1, "updates": 1, "seconds": 1, "sha256": kept}
        changes = {
            f"{checkpoint}/{NETWORK_FILE}": content,
            f"{checkpoint}/{MANIFEST_FILE}": json.dumps(manifest).encode(),
        }
        yield run_case(files, f"tensors: {kind}", changes, checkpoint)
    for kind, text in {"100,000 deep": DEEP, "Inf": '{"format_version": Infinity}', "null": "null"}.items():
        yield Case("episodes", kind, _file("trial.json", text.encode), read_trial, "trial.json")

    for kind, line in FIGURES.items():
        content = b'{"frames": 80, "seconds": 1}\n' + line + b"\n"
        made = _file("metrics.jsonl", lambda content=content: content)
        yield Case("hostile figures", kind, made, read_figures, "metrics.jsonl, line 2")
    for kind, content in tensor_files(room_map()).items():
        yield Case("hostile maps", kind, _file("room.map", lambda content=content: content), read_room_map, "room.map")


def read_figures(path: Path) -> str:
    return str(RunFolder(path.parent).metrics())


def room_map() -> bytes:
    """A map of one picture."""
    shapes = {"room": (5, 5), "shut": (4, 5, 5), "taken": (1, 3), "features": (1, 3)}
    with tempfile.TemporaryDirectory() as folder:
        write_map(
            Path(folder) / "room.map", RoomMap(**{name: np.zeros(shape) for name, shape in shapes.items()}), "eyes", 0.5
        )
        return (Path(folder) / "room.map").read_bytes()


def read_room_map(path: Path) -> str:
    return str(read_map(path, "eyes", 0.5, 3))


FIGURES = {
    "100,000 deep": DEEP.encode(),
    "a list": b"[]",
    "a number": b"1e400",
    "no UTF-8": b"\xff",
    "NaN": b'{"frames": 160, "seconds": NaN}',
    "Inf": b'{"frames": 160, "seconds": 1e400}',
    "a number of 5,000 digits": b'{"frames": %s, "seconds": 1}' % (b"9" * 5000),
    "frames of a half": b'{"frames": 0.5, "seconds": 1}',
    "a text": b'{"frames": 160, "seconds": "\\u001b[2J"}',
    "an object": b'{"frames": 160, "seconds": 1, "loss": {}}',
    "nothing": b"",
}


def read_trial(path: Path) -> str:
    return str(read_episodes(path))


def run_files() -> dict[str, bytes]:
    """The files of a short run, by their paths in its folder."""
    with tempfile.TemporaryDirectory() as folder:
        write_scene(corridor_scene(5), Path(folder) / "corridor.h5")
        run = train(small_request(learner=small_learner(frames=80)), Path(folder) / "run").path
        paths = [path for path in run.rglob("*") if path.is_file() and path.suffix in (".json", ".safetensors")]
        return {path.relative_to(run).as_posix(): path.read_bytes() for path in paths}


def run_case(files: dict[str, bytes], name: str, changes: dict[str, bytes], says: str) -> Case:
    """The run with some of its files changed."""

    def make(folder: Path) -> Path:
        for relative, content in {**files, **changes}.items():
            path = folder / relative
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        return folder

    return Case("run folders", name, make, read_run, says)


@quietly
def read_run(path: Path) -> str:
    record = RunFolder(path).read_record()
    agent = load_agent(path, newest_checkpoint(RunFolder(path).checkpoints))
    return str((asdict(record), [tensor.sum().item() for tensor in agent.network.state_dict().values()]))


SETTING, UNREADABLE = "run.json: a setting is missing or unknown", "run.json: not readable"
RECORDS: dict[str, tuple[object, str]] = {
    "frames": ("many", SETTING),
    "envs": (1.5, SETTING),
    "discount": (float("nan"), SETTING),
    "gae_lambda": (2.0, SETTING),
    "lr_start": (float("inf"), SETTING),
    "algorithm": ("magic", SETTING),
    "hindsight": ("yes", SETTING),
    "width": (10**7, "does not fit its run"),
    "history_length": (10**9, "does not fit its run"),
    "seed": ([], SETTING),
    "zone_level": ("planet", SETTING),
    "scenes": ({"name": "x"}, SETTING),
    "reward": ([], SETTING),
    "learner": (None, SETTING),
    "command": (5, SETTING),
    "format_version": (float("inf"), UNREADABLE),
}


def tensor_files(whole: bytes) -> dict[str, bytes]:
    """Safetensors files that lie about what they hold; a manifest with their checksums goes with each."""
    length = int.from_bytes(whole[:8], "little")
    header = json.loads(whole[8 : 8 + length])
    first = next(name for name in header if name != "__metadata__")

    def lying(**changes: object) -> bytes:
        text = json.dumps(header | {first: header[first] | changes}).encode()
        return len(text).to_bytes(8, "little") + text + whole[8 + length :]

    import torch

    zeros = {name: torch.zeros(entry["shape"]) for name, entry in header.items() if name != "__metadata__"}
    return {
        "a header of 16 EiB": (2**64 - 1).to_bytes(8, "little") + whole[8:],
        "a header of 90 MB": (90_000_000).to_bytes(8, "little") + whole[8:],
        "a header too deep": len(DEEP).to_bytes(8, "little") + DEEP.encode(),
        "an empty file": b"",
        "offsets beyond the end": lying(data_offsets=[0, 2**60]),
        "offsets backwards": lying(data_offsets=[64, 0]),
        "a shape of 10^18": lying(shape=[10**9, 10**9]),
        "a shape that overflows": lying(shape=[2**63, 2]),
        "an unknown type": lying(dtype="Q7"),
        "a pickle": b"\x80\x04cos\nsystem\n(S'true'\ntR.",
        "no tensors": save({}),
        "NaN": save({**zeros, first: torch.full_like(zeros[first], float("nan"))}),
        "mean of no axis": save({**zeros, "features.mean": torch.tensor(1.0)}),
        "a basis of one axis": save({**zeros, "features.basis": torch.zeros(3)}),
        "whole numbers": save({**zeros, "features.mean": torch.zeros(12, dtype=torch.int64)}),
        "another width": save({**zeros, "network.siamese_weight": torch.zeros(4, 9, 12)}),
    }
