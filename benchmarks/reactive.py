"""Networks trained in one room, at their own targets, when what they see on the way is perturbed.

    python benchmarks/reactive.py office.h5 own-0 own-1 perturbed-0 perturbed-1 --json record.json

The name of a run is its kind, a hyphen and its seed. Episodes of at most 500 steps to each target, on the scene's own
pictures and on perturbed ones that no training has seen: four of each pose, one a step, none twice to the bit. Targets
are seen in the scene's own. Means over targets; of a kind, over its seeds, with the least and the most.

`--fewer A B` claims that kind A has fewer collisions than kind B where everything is perturbed: by a permutation test
of their seeds, corrected for all claims of the call (Holm).
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from run_names import kind_and_seed, learnt

import clearway
from clearway.agents.agent import FEATURES
from clearway.agents.by_features import FeatureAgent
from clearway.api.scenes import load_scenes
from clearway.evaluation import metrics
from clearway.evaluation.across_seeds import difference, permutation_p
from clearway.evaluation.episodes import EPISODES_PER_TARGET, run_episodes
from clearway.evaluation.takes import Takes
from clearway.experiments.correction import LEVEL, holm
from clearway.learn.load import TrainedNetwork
from clearway.learn.provenance import hardware, package_versions
from clearway.live.words import perturbations_named
from clearway.scenes.scene import Scene
from clearway.views.seen import TAKES, takes_seen
from clearway.world.world import make_world

STEP_LIMIT = 500
SEEN = ("none", "geometry", "all")
FIGURES = {
    "success": metrics.success,
    "success_4x": metrics.sc_4x,
    "spl": metrics.spl,
    "collisions": metrics.collisions,
}


def figures(run: Path, scene: Scene, takes: Takes | None, episodes: int, seed: int) -> dict[str, float]:
    """Of the run's agent, to its targets."""
    trained = clearway.load_agent(run)
    assert isinstance(trained, TrainedNetwork), run
    world = make_world([scene], {scene.name: list(trained.record.targets[scene.name])})
    agent = FeatureAgent(trained.in_scene(0))
    table = run_episodes(
        world, agent, scenes=[scene], takes=takes, episodes_per_target=episodes, step_limit=STEP_LIMIT, seed=seed
    )
    return {name: float(np.mean(figure(table))) for name, figure in FIGURES.items()}


def judged(found: Mapping[str, Mapping[str, Mapping[str, float]]], claims: Sequence[Sequence[str]]) -> list[str]:
    """A line for each claim that its first kind has fewer collisions than its second, by the figures of all runs."""
    one_scene = np.zeros(1, int)
    pairs = [(_collisions(found, fewer), _collisions(found, than)) for fewer, than in claims]
    chances = holm([permutation_p(first, second, one_scene) for first, second in pairs])
    lines = []
    for (fewer, than), (first, second), p in zip(claims, pairs, chances, strict=True):
        by = difference(second, first, one_scene)
        verdict = "undecided" if p > LEVEL else "yes" if by.value > 0 else "no, more"
        lines.append(f"{fewer}, fewer collisions than {than}: {verdict}; {by} fewer, p = {p:.2g} (Holm)")
    return lines


def _collisions(found: Mapping[str, Mapping[str, Mapping[str, float]]], kind: str) -> np.ndarray:
    """(seeds, 1), of the runs of a kind where everything is perturbed."""
    return np.array([[seen["all"]["collisions"]] for name, seen in found.items() if kind_and_seed(name)[0] == kind])


def main() -> None:
    """Walk, print a table, and write the record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--seed", type=int, default=0, help="of starts, chances and perturbations")
    parser.add_argument("--episodes", type=int, default=EPISODES_PER_TARGET, help="to each target")
    parser.add_argument("--fewer", nargs=2, action="append", default=[], metavar=("A", "B"), help="a claim to judge")
    parser.add_argument("--json", type=Path, help="where the record is written")
    args = parser.parse_args()
    runs = learnt(args.runs)
    kinds = [*dict.fromkeys(kind_and_seed(name)[0] for name in runs)]
    if unknown := {kind for claim in args.fewer for kind in claim} - {*kinds}:
        parser.error(f"--fewer {', '.join(sorted(unknown))}: the runs are of {', '.join(kinds)}")
    (scene,) = load_scenes(args.scene)
    found: dict[str, dict[str, dict[str, float]]] = defaultdict(dict)
    print("| trained on | seen on the way | " + " | ".join(FIGURES) + " |\n|" + "---|" * (2 + len(FIGURES)))
    for seen in SEEN:
        takes = None
        if seen != "none":
            asked = perturbations_named([seen])
            takes = takes_seen([scene], asked, (FEATURES,), None, takes=TAKES, seed=args.seed)
        for run in args.runs:
            found[run.name][seen] = figures(run, scene, takes, args.episodes, args.seed)
        for kind in kinds:
            own = [found[name][seen] for name in runs if kind_and_seed(name)[0] == kind]
            columns = {name: [values[name] for values in own] for name in FIGURES}
            shown = (f"{np.mean(c):.3f} ({min(c):.3f} to {max(c):.3f})" for c in columns.values())
            print(f"| {kind} | {seen} | " + " | ".join(shown) + " |", flush=True)
    if args.json:
        record = {
            "episodes": args.episodes,
            "seed": args.seed,
            "versions": package_versions(),
            "hardware": hardware(),
            "runs": runs,
            "figures": found,
        }
        args.json.write_text(json.dumps(record) + "\n")
    for line in judged(found, args.fewer):
        print(line)


if __name__ == "__main__":
    main()
