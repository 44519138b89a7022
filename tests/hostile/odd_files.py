"""What no file should be, under the name of one: a pipe, a device without an end, a folder; for every reader."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

from clearway.deploy.onnx_file import read_onnx
from clearway.evaluation.episode_files import read_episodes
from clearway.importers.mjcf_compile import compiled
from clearway.learn.checkpoint import MANIFEST_FILE, newest_checkpoint
from clearway.learn.run_folder import RunFolder
from clearway.mapping.map_files import read_map
from clearway.perception.eyes import CARD_FILE, SHIPPED, WEIGHTS_FILE, read_eyes
from clearway.rooms.obstacles import AgentShape
from clearway.settings_file import read_settings
from hostile import other_files, scene_files
from hostile.cases import Case

KINDS: dict[str, Callable[[Path], object]] = {
    "a pipe": os.mkfifo,
    "a device": lambda path: path.symlink_to("/dev/zero"),
    "a folder": Path.mkdir,
}
AGENT = AgentShape(radius_m=0.3, height_m=1.0, step_m=0.4)


def read_checkpoints(manifest: Path) -> str:
    return str(newest_checkpoint(manifest.parents[1]))


def write_card(folder: Path) -> None:
    (folder / CARD_FILE).write_bytes((SHIPPED / CARD_FILE).read_bytes())


def nothing(folder: Path) -> None:
    """No other file is needed."""


READERS: dict[str, tuple[str, Callable[[Path], object], Callable[[Path], object]]] = {
    "a scene": ("scene.h5", scene_files.read, nothing),
    "an archive": ("dumps.zip", other_files.read_archive, nothing),
    "plans": ("plans.npz", other_files.read_plans, nothing),
    "a plan": ("plan.txt", other_files.read_plans, nothing),
    "a table": ("poses.csv", other_files.read_table, other_files.write_picture),
    "SAVN's graph": ("graph.json", other_files.read_savn_folder, other_files.write_savn_pictures),
    "AVD's annotations": ("annotations.json", other_files.read_avd_folder, other_files.write_avd_pictures),
    "a run": ("run.json", lambda path: RunFolder(path.parent).read_record(), nothing),
    "figures": ("metrics.jsonl", lambda path: RunFolder(path.parent).metrics(), nothing),
    "a checkpoint": (f"frames-000000000080/{MANIFEST_FILE}", read_checkpoints, nothing),
    "episodes": ("trial.json", read_episodes, nothing),
    "eyes' card": (CARD_FILE, lambda path: read_eyes(path.parent), nothing),
    "eyes' weights": (WEIGHTS_FILE, lambda path: read_eyes(path.parent), write_card),
    "a map": ("room.map", lambda path: read_map(path, "eyes", 0.5, 3), nothing),
    "an exported agent": ("agent.onnx", read_onnx, nothing),
    "settings": ("run.yaml", read_settings, nothing),
    "a MuJoCo model": ("world.xml", lambda path: compiled(path, AGENT), nothing),
}
"""By what is read: the file's name, its reader, and what writes the files beside it."""


def cases() -> Iterator[Case]:
    """Each kind in the place of each file."""
    for reader, (name, read, beside) in READERS.items():
        for kind, make in KINDS.items():
            yield Case("hostile kinds of files", f"{kind} as {reader}", _made(name, make, beside), _digest(read))


def _made(name: str, make: Callable[[Path], object], beside: Callable[[Path], object]) -> Callable[[Path], Path]:
    def made(folder: Path) -> Path:
        beside(folder)
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        make(path)
        return path

    return made


def _digest(read: Callable[[Path], object]) -> Callable[[Path], str]:
    @other_files.quietly
    def digest(path: Path) -> str:
        return str(read(path))

    return digest
