"""Recompute the published tables of the generalist from a record that `benchmarks/generalist.py` wrote.

    python benchmarks/published.py docs/figures/generalist-test-fourth.json

Of each part of the record a table, means over scenes with 95 % intervals, and what anticipation spares.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path

from by_scene import print_difference, print_table

from clearway.evaluation.goals import GoalEvaluation, GoalFigures

CARELESS = "collisions cost nothing"


def evaluations(part: Mapping[str, dict]) -> dict[str, GoalEvaluation]:
    """Of a part of a record, by agent."""
    found = {}
    for name, told in part.items():
        if isinstance(told, dict) and "scenes" in told:
            scenes = {
                row["scene"]: GoalFigures(**{k: v for k, v in row.items() if k != "scene"}) for row in told["scenes"]
            }
            found[name] = GoalEvaluation(name, scenes, told.get("perturbed"), told.get("tour"))
    return found


def main() -> None:
    """Print all parts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("record", type=Path)
    record = json.loads(parser.parse_args().record.read_text())
    for name, part in record.items():
        if found := evaluations(part):
            print(f"\n{name}\n")
            print_table(found)
            if CARELESS in found:
                print_difference(found[CARELESS], found["generalist"], "collisions", "collisions spared an episode")


if __name__ == "__main__":
    main()
