"""What sending less costs in quality: two workers, gradients whole, in bfloat16, and of fewer and larger steps.

    python benchmarks/scaling_quality.py            # three seeds, four generated rooms, some minutes

Each line is of the last tenth of a training's rows, over all its targets: mean over seeds, and each seed's.
"""

from __future__ import annotations

import argparse
from statistics import mean
from typing import Any

from scaling_worker import scenes_of

import clearway

CASES: dict[str, dict[str, Any]] = {
    "float32, 8 steps an update": {},
    "bfloat16, 8 steps": {"sent_gradients": "bfloat16"},
    "float32, 4 steps, 1.4 times the learning rate": {"minibatches": 2, "lr_start": 7e-4, "lr_end": 7e-5},
}
FIGURES = ("success", "steps", "collisions")


def main() -> None:
    """Train and print a table in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rooms", type=int, default=4)
    parser.add_argument("--frames", type=int, default=240_000)
    parser.add_argument("--seeds", type=int, default=3)
    given = parser.parse_args()
    scenes = scenes_of(given.rooms)
    print("| sent | " + " | ".join(FIGURES) + " |\n|" + "---|" * (len(FIGURES) + 1))
    for name, settings in CASES.items():
        ends = []
        for seed in range(given.seeds):
            found = clearway.train(scenes, frames=given.frames, seed=seed, workers=2, threads=1, **settings)
            rows = found.metrics[-max(1, len(found.metrics) // 10) :]
            ends.append({figure: mean(row[figure] for row in rows) for figure in FIGURES})
        shown = []
        for figure in FIGURES:
            of_seeds = [end[figure] for end in ends]
            shown.append(f"{mean(of_seeds):.3f} ({', '.join(f'{value:.3f}' for value in of_seeds)})")
        print(f"| {name} | " + " | ".join(shown) + " |", flush=True)


if __name__ == "__main__":
    main()
