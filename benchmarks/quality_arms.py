"""Two arms of `quality.py`, beside each other: has the first fewer collisions, and does it solve all targets sooner?

    python benchmarks/quality.py --seeds 5 6 7 8 9 --set history_length=1 --json one.json
    python benchmarks/quality.py --seeds 5 6 7 8 9 --json four.json
    python benchmarks/quality_arms.py one.json four.json
    python benchmarks/quality_arms.py arms.json         # both records in one file, as --keep writes them

Two-sided permutation tests over seeds, p corrected for both questions (Holm). A run that has not solved all its
targets counts with all its frames.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from clearway.evaluation.across_seeds import permutation_p
from clearway.experiments.correction import holm

Record = Mapping[str, Any]


def collisions(record: Record) -> np.ndarray:
    """(R,) mean collisions an episode of each run, in the end."""
    return np.array([run["collisions"] for run in record["seeds"]])


def frames_to_solved(record: Record) -> np.ndarray:
    """(R,) frames after which each run was first seen to solve all targets."""
    met = [run["first_met"].get("solved_targets") for run in record["seeds"]]
    return np.array(
        [run["frames"] if first is None else first["frames"] for run, first in zip(record["seeds"], met, strict=True)]
    )


MEASURES = {"collisions": collisions, "frames until all targets are solved": frames_to_solved}


def compared(first: Record, second: Record) -> dict[str, tuple[np.ndarray, np.ndarray, float, float]]:
    """By measure: values of both arms' runs, p, and p corrected for all measures."""
    values = {name: (measure(first), measure(second)) for name, measure in MEASURES.items()}
    one_scene = np.zeros(1, np.int64)
    found = [permutation_p(one[:, None], other[:, None], one_scene) for one, other in values.values()]
    return {name: (*values[name], p, all_p) for name, p, all_p in zip(values, found, holm(found), strict=True)}


def records_in(paths: Sequence[Path]) -> tuple[Record, Record]:
    """Two records, of two files or of one that holds both."""
    found = [json.loads(path.read_text(encoding="utf-8")) for path in paths]
    first, second = found[0] if len(found) == 1 else found
    return first, second


def main() -> None:
    """Print the table as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("records", nargs="+", type=Path)
    parser.add_argument("--keep", type=Path, help="write both records into this file, without the looks on the way")
    args = parser.parse_args()
    first, second = records_in(args.records)
    if args.keep:
        bare = [
            {**one, "seeds": [{k: v for k, v in run.items() if k != "checks"} for run in one["seeds"]]}
            for one in (first, second)
        ]
        args.keep.write_text(json.dumps(bare, separators=(",", ":")) + "\n", encoding="utf-8")
    print("| measure | first: mean (runs) | second: mean (runs) | p | p of both (Holm) |\n|---|---|---|---|---|")
    for name, (one, other, p, corrected) in compared(first, second).items():
        cells = [f"{arm.mean():,.7g} ({', '.join(f'{value:,.7g}' for value in sorted(arm))})" for arm in (one, other)]
        print(f"| {name} | {' | '.join(cells)} | {p:.2g} | {corrected:.2g} |")


if __name__ == "__main__":
    main()
