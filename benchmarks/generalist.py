"""The generalist in rooms that it has never entered, beside the same agent to which collisions cost nothing.

    python benchmarks/generalist.py rooms-test                          # no tour; collision cost 16 and 0
    python benchmarks/generalist.py rooms-test --tour 500               # and who goes by the tour's nearest pictures
    python benchmarks/generalist.py rooms-test --perturb all
    python benchmarks/generalist.py rooms-test --json record.json       # figures of every scene
    python benchmarks/generalist.py rooms-test --eyes eyes --rivals     # alone; by eyes of your own
    python benchmarks/generalist.py rooms-test --tour 500 --rivals memory cells   # with these taken away

Scenes are files or folders of them, with pictures. All agents walk to the same goals from the same starts. Intervals
are of the mean over scenes, and so are differences, scene by scene; see `by_scene`.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from by_scene import print_difference, print_higher, print_table, write_record
from retrieval import Retrieving
from taken_away import WithoutCells, WithoutMemory

import clearway
from clearway.agents.generalist import Generalist
from clearway.evaluation.goals import GoalEvaluation
from clearway.learn.provenance import hardware, package_versions
from clearway.perception import eyes

CARELESS, RETRIEVAL = "collisions cost nothing", "nearest picture of the tour"
NO_MEMORY, NO_CELLS = "without memory", "without the map's cells"
RIVALS = ("careless", "nearest", "memory", "cells")
USUAL = RIVALS[:2]


def main() -> None:
    """Measure, print, and write the record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--goals", type=int, default=20, help="of each scene")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--tour", type=int, default=0, help="steps")
    parser.add_argument("--perturb", nargs="+", default=["none"])
    parser.add_argument("--eyes", default=eyes.NAME, help="a folder of eyes; by default those that come along")
    told = (
        "careless: collisions cost nothing; nearest: goes by the tour's nearest pictures; memory, cells: see taken_away"
    )
    parser.add_argument("--rivals", nargs="*", choices=RIVALS, default=USUAL, help=f"{told}. Without a name: none")
    parser.add_argument("--json", type=Path, help="where the record is written")
    args = parser.parse_args()
    generalist = Generalist.by_eyes(eyes.from_record(eyes.find_record(args.eyes)))
    careless = replace(generalist, settings=replace(generalist.settings, collision_cost=0.0))
    agents = {"generalist": generalist} | ({CARELESS: careless} if "careless" in args.rivals else {})
    parts = generalist.encoder, generalist.sight, generalist.settings
    if "nearest" in args.rivals and args.tour:
        agents[RETRIEVAL] = Retrieving(*parts)
    if "cells" in args.rivals and args.tour:
        agents[NO_CELLS] = WithoutCells(*parts)
    if "memory" in args.rivals:
        agents[NO_MEMORY] = WithoutMemory(*parts)
    asked = {"goals": args.goals, "seed": args.seed, "tour": args.tour, "perturb": args.perturb}
    record = {"asked": asked, "eyes": args.eyes, "versions": package_versions(), "hardware": hardware()}
    found: dict[str, GoalEvaluation] = {}
    for name, agent in agents.items():
        own, *others = clearway.evaluate_goals(agent, args.scenes, **asked)
        found |= {name: own} | {other.agent: other for other in others}
        if args.json:  # after each: it may be hours until the next is done
            write_record(args.json, record, found)
    print_table(found)
    own = found["generalist"]
    if CARELESS in found:
        print_difference(found[CARELESS], own, "collisions", "collisions spared an episode")
    print_higher(own, {name: found[name] for name in (NO_MEMORY, NO_CELLS, RETRIEVAL) if name in found}, "spl")


if __name__ == "__main__":
    main()
