"""How long the viewer takes to begin an episode: a scene of 10,000 poses, an agent, targets anywhere.

    python benchmarks/viewer.py

Makes the scene and a short training in a temporary folder first, then begins episodes to targets drawn anew and prints
the median and the slowest, in milliseconds.
"""

import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from clearway.view.episode import Episode
from clearway.view.stage import run_stage
from clearway.view.viewing import Viewing

SIDE = 50  # cells; four headings each
FEATURES = 2048
EPISODES = 20


def clearway(*words: object) -> None:
    subprocess.run([sys.executable, "-m", "clearway", *map(str, words)], check=True)


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "hall.txt").write_text("\n".join("." * SIDE for _ in range(SIDE)) + "\n")
        words = ("--cell-size", 0.25, "--features", FEATURES, "--out", folder)
        clearway("scenes", "import", "floor-plan", folder / "hall.txt", *words)
        clearway("train", folder / "hall.h5", "--out", folder / "run", "--frames", 8_000)
        stage = run_stage([folder / "run"])
        poses = stage.scenes[0].state_count
        session, took_ms = Viewing(stage), []
        for target in np.random.default_rng(0).integers(poses, size=EPISODES).tolist():
            begun = time.perf_counter()
            session.begin(Episode(target=target))
            took_ms.append(1000 * (time.perf_counter() - begun))
    print(f"{poses} poses: an episode begins in {statistics.median(took_ms):.1f} ms, {max(took_ms):.1f} ms at most")


if __name__ == "__main__":
    main()
