"""Targets in cells of which the generalist has kept no picture, in rooms that it has toured; everything perturbed.

    python benchmarks/known_rooms.py rooms-test --goals 20 --tour 500 --json known.json

One cell in five of each room is held out. The agent tours the room, and may come there, but keeps no picture that it
has taken there; its map still says where it could stand. Goals are poses of these cells. Where it is, and where the
picture of a goal was taken, it is not told.

Scenes are files or folders of them, with pictures, of rooms that can be built again. Intervals: see `by_scene`.
"""

from __future__ import annotations

import argparse
import zlib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from by_scene import print_table, write_record

import clearway
from clearway.agents.agent import POSE, Agent, Decisions, Observation, State
from clearway.agents.generalist import Generalist
from clearway.agents.mapping import MappingAgent
from clearway.agents.tour_map import map_of
from clearway.api.perturbations import perturbations_asked
from clearway.evaluation.goals import GoalEvaluation, evaluate_goals
from clearway.evaluation.tours import Touring
from clearway.learn.provenance import hardware, package_versions
from clearway.torch_threads import torch_threads
from clearway.views.seen import takes_seen

if TYPE_CHECKING:
    from clearway.scenes.scene import Scene

SHARE = 5  # one cell in so many is held out
CELLS = 5  # at least


class Watched:
    """An explorer of whom it is written down where it was.

    Args:
        explorer: walks.
    """

    def __init__(self, explorer: Agent) -> None:
        self._explorer = explorer
        self.sees: tuple[str, ...] = (*explorer.sees, POSE)

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """See `Agent.reset`."""
        self.states: list[int] = []
        return self._explorer.reset(target, seed)

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """See `Agent.act`."""
        self.states.append(int(observation[POSE][0]))
        return self._explorer.act(observation, state)


def held_out(scene: Scene, seed: int) -> np.ndarray:
    """(S,) bool, states in the cells that are held out, of the scene's largest part."""
    largest = scene.components == 0
    cells = np.unique(scene.cells[largest])
    count = max(CELLS, len(cells) // SHARE)
    chosen = np.random.default_rng([seed, zlib.crc32(scene.name.encode())]).choice(cells, count, replace=False)
    return largest & np.isin(scene.cells, chosen)


def touring(generalist: Generalist, without: np.ndarray, steps: int) -> Touring:
    """A tour after which the agent has no picture of the states `without` (S,) bool."""
    watched: list[Watched] = []

    def explorer(count: int) -> Watched:
        watched.append(Watched(generalist.explorer(count)))
        return watched[-1]

    def after(state: State) -> MappingAgent:
        known = map_of(state, generalist.sight, generalist.settings)
        if len(known.taken) != len(watched[-1].states):
            raise SystemExit("the tour's poses were not found together. Leave this room out")
        kept = ~without[watched[-1].states]
        known = replace(known, taken=known.taken[kept], features=known.features[kept])
        return MappingAgent(generalist.sight, known=known, settings=generalist.settings)

    return Touring(explorer, after, steps)


def main() -> None:
    """Measure, print, and write the record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--goals", type=int, default=20, help="of each scene")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--tour", type=int, default=500, help="steps")
    parser.add_argument("--takes", type=int, default=4, help="perturbed pictures of each pose")
    parser.add_argument("--json", type=Path, help="where the record is written")
    args = parser.parse_args()
    scenes = [scene for path in args.scenes for scene in clearway.load_scenes(path)]
    generalist = Generalist.shipped().stepping(scenes)
    scenes, settings = generalist.seen(scenes), {"goals": args.goals, "seed": args.seed}
    asked = {**settings, "tour": args.tour, "takes": args.takes, "perturb": "all", "held_out": SHARE}
    record = {"asked": asked, "versions": package_versions(), "hardware": hardware()}
    found: dict[str, GoalEvaluation] = {}
    with torch_threads(1):
        for scene in scenes:
            perturbed = perturbations_asked("all")
            takes = takes_seen(
                [scene], perturbed, generalist.explorer(1).sees, generalist.encoder, takes=args.takes, seed=args.seed
            )
            without = held_out(scene, args.seed)
            among = {scene.name: np.flatnonzero(without)}
            maker = {"generalist": touring(generalist, without, args.tour)}
            for one in evaluate_goals(maker, [scene], takes=takes, among=among, **settings):
                before = found.get(one.agent)
                found[one.agent] = (
                    one if before is None else replace(before, scenes={**before.scenes, **one.scenes}, tour=None)
                )
            if args.json:  # after each: it may be minutes until the next is done
                write_record(args.json, record, found)
    print_table(found)


if __name__ == "__main__":
    main()
