"""A folder in which eyes are trained.

pretraining.json   settings, seed, views, versions, hardware, command
metrics.jsonl      a row of figures a line; its frames are pictures
checkpoints/       see `learn.checkpoint`
eyes.json, eyes.safetensors   the eyes, once they are trained (`perception.eyes`)
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clearway.errors import RunError
from clearway.files import json_text, read_json, written_whole
from clearway.learn.provenance import hardware, package_versions
from clearway.learn.run_folder import RunFolder
from clearway.perception.eyes import EyesCard, card_of, is_eyes, write_eyes
from clearway.perception.eyes_network import Eyes
from clearway.remote.address import addresses_without_secrets

if TYPE_CHECKING:
    from clearway.pretraining.trainer import PretrainRequest

RECORD_FILE = "pretraining.json"
DECIDES = ("settings", "seed", "keeping", "views")  # what the eyes will be


def record_of(request: PretrainRequest) -> dict[str, Any]:
    """All that determines a pretraining, and where it was made, as JSON values."""
    views = request.views
    digest = hashlib.sha256("".join(shard.room_key for shard in views.shards).encode()).hexdigest()
    return {
        "settings": request.settings.to_json(),
        "seed": request.seed,
        "keeping": None if request.keeping is None else _kept(card_of(request.keeping.record)),
        "views": {"rooms": len(views.rooms), "pictures": len(views), "digest": digest, **views.settings.to_json()},
        "versions": package_versions(),
        "hardware": hardware(request.device),
        "command": [*map(addresses_without_secrets, sys.argv)],
    }


def _kept(card: EyesCard) -> dict[str, Any]:
    """What is told of the eyes whose features are kept."""
    return {"sha256": card.sha256, "trained": dict(card.trained)}


class EyesFolder:
    """The files of one pretraining.

    Args:
        path: the folder; made when training starts.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._files = RunFolder(path)
        self.checkpoints, self.metrics_path = self._files.checkpoints, self._files.metrics_path
        self.metrics, self.forget_metrics_after = self._files.metrics, self._files.forget_metrics_after
        self.clear_parts = self._files.clear_parts

    @contextmanager
    def held(self) -> Iterator[None]:
        """Keep other processes from training here. Raises RunError where one does, or nothing can be written."""
        with self._files.held():
            yield

    @contextmanager
    def begun(self, record: Mapping[str, Any], resume: bool) -> Iterator[None]:
        """As `begin`; where it begins, and fails before its first checkpoint, what it wrote is removed again."""
        fresh, before = not (self.path / RECORD_FILE).exists(), {path.name for path in self.path.iterdir()}
        self.begin(record, resume)
        try:
            yield
        except Exception:
            if fresh and not any(self.checkpoints.glob("frames-*")):
                self._files.forget(before, RECORD_FILE)
            raise

    def begin(self, record: Mapping[str, Any], resume: bool) -> None:
        """Begin here, or find what to go on with.

        Raises:
            RunError: the folder holds something else, or a training and `resume` is off.
        """
        path = self.path / RECORD_FILE
        if not path.exists():
            left = [file.name for file in (self.metrics_path, self.checkpoints) if file.exists()]
            if left or is_eyes(self.path):
                raise RunError(f"{self.path}: holds other files already. Empty it, or give another --out")
        else:
            if not resume:
                raise RunError(f"{self.path}: holds a pretraining already. Give --resume to go on, or another --out")
            before = self._read(path)
            if other := [key for key in DECIDES if before.get(key) != json.loads(json_text(record[key]))]:
                problem = f"{self.path}: holds a pretraining with other {' and '.join(other)}"
                raise RunError(f"{problem}. Give the same, or another --out")
        if not any(self.checkpoints.glob("frames-*")):
            with written_whole(path) as part:
                part.write_text(json_text(record))

    def write_eyes(self, eyes: Eyes, pictures: int) -> None:
        """Write what was trained, with how."""
        record = self._read(self.path / RECORD_FILE)
        told = {key: record[key] for key in (*DECIDES, "versions", "hardware", "command")}
        write_eyes(self.path, eyes, {**told, "pictures": pictures})

    def _read(self, path: Path) -> dict[str, Any]:
        try:
            return dict(read_json(path))
        except (OSError, ValueError, TypeError) as fault:
            raise RunError(f"{path}: not readable ({fault}). Restore it, or train again elsewhere") from fault
