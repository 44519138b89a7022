"""Trained runs, whose folders are called by kind, a hyphen and seed."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any


def kind_and_seed(name: str) -> tuple[str, str]:
    """Of a run, by its folder's name."""
    kind, _, seed = name.rpartition("-")
    return kind, seed


def learnt(runs: Sequence[Path]) -> dict[str, dict[str, Any]]:
    """By name of folder, what each run was trained by, for how long, and as what its record has it.

    Raises:
        SystemExit: a folder is called by another seed.
    """
    found = {run.name: _learnt(run) for run in runs}
    for name, about in found.items():
        if kind_and_seed(name)[1] != str(about["seed"]):
            raise SystemExit(f"{name}: was trained with seed {about['seed']}. Call the folder KIND-{about['seed']}")
    return found


def _learnt(run: Path) -> dict[str, Any]:
    record = json.loads((run / "run.json").read_text())
    *_, last = (run / "metrics.jsonl").read_text().splitlines()
    end = json.loads(last)
    told = {name: record[name] for name in ("learner", "reward", "seed")}
    return {**told, "scenes": len(record["scenes"]), "frames": end["frames"], "seconds": round(end["seconds"])}
