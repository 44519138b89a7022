"""The folder of a training that was given none, and the command that goes on with a training."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from pathlib import Path

from clearway.remote.address import addresses_without_secrets

RUNS = Path("runs")


def free_run_folder(files: Sequence[Path], reward: str, algorithm: str, seed: int) -> Path:
    """A folder that is not there yet: runs/ROOM-REWARD-ALGORITHM-sSEED, with a number behind it where that is taken.

    Args:
        files: scene files; the first one's name stands for all.
        reward, algorithm: their names.
        seed: of the training.
    """
    room = files[0].stem + (f"-and-{len(files) - 1}-more" if len(files) > 1 else "")
    name = "-".join([*(_as_file_name(part) for part in (room, reward, algorithm)), f"s{seed}"])
    path, number = RUNS / name, 1
    while path.exists():
        number += 1
        path = RUNS / f"{name}-{number}"
    return path


def longer(words: Sequence[str], out: Path, frames: int | None = None) -> str:
    """The command, fit for a shell, that trains on from a `clearway train` until so many frames; without secrets.

    Args:
        words: of the training, without the program's name.
        out: its run folder.
        frames: in all; None: as many as it was to have.
    """
    words = _with_option(words, "--out", str(out))
    if frames is not None:
        words = _with_option(words, "--frames", str(frames))
    if "--no-resume" in words:
        words.remove("--no-resume")
    if "--resume" not in words:
        words.append("--resume")
    return shlex.join(["clearway", *map(addresses_without_secrets, words)])


def _with_option(words: Sequence[str], option: str, value: str) -> list[str]:
    """The words with an option's value in place of the one there, or at the end."""
    changed = list(words)
    for place, word in enumerate(words):
        if word == option:
            changed[place + 1] = value
            return changed
        if word.startswith(f"{option}="):
            changed[place] = f"{option}={value}"
            return changed
    return [*changed, option, value]


def _as_file_name(text: str) -> str:
    """The text with hyphens for all that is awkward in a file's name; at most 60 characters."""
    return re.sub(r"[^A-Za-z0-9_.]+", "-", text).strip("-.")[:60] or "x"
