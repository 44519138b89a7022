"""One bit flipped anywhere in a file of ours: it is refused, or nothing of the scene differs. Never a crash."""

import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from clearway.scenes.thor_v1 import write_scene
from made import grid_scene

READER = Path(__file__).with_name("flipped_bits.py")


def outcomes(path: Path, bits: list[int]) -> Counter[str]:
    """How reading went, over all bits."""
    process = subprocess.run(
        [sys.executable, READER, path, *map(str, bits)], capture_output=True, text=True, timeout=600, check=False
    )
    answers = [line.split() for line in process.stdout.splitlines()]
    assert process.returncode == 0, f"the reader ended after bit {answers[-1:]}: {process.stderr[-500:]}"
    assert [int(bit) for bit, _ in answers] == bits
    assert not [bit for bit, outcome in answers if outcome == "wrong"]
    return Counter(outcome for _, outcome in answers)


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("flipped") / "scene.h5"
    write_scene(grid_scene(1, width=4, depth=3, feature_count=8), path)
    return path


def chosen_bits(path: Path, count: int, seed: int) -> list[int]:
    every = 8 * path.stat().st_size
    return np.random.default_rng(seed).choice(every, size=min(count, every), replace=False).tolist()


def test_a_thousand_flipped_bits(scene_file: Path) -> None:
    found = outcomes(scene_file, chosen_bits(scene_file, 1_000, seed=0))
    assert found["refused"] > 300
    assert found["same"] > 10  # what no reader looks at: unused space


@pytest.mark.slow
def test_ten_thousand_flipped_bits(scene_file: Path) -> None:
    assert outcomes(scene_file, chosen_bits(scene_file, 10_000, seed=1)).total() == 10_000
