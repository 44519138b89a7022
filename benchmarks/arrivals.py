"""How often agents hold wrongly that they have arrived, and how often they do not where they have.

    python benchmarks/arrivals.py rooms-validation --quantiles 0.4 0.5 0.6 0.7 0.8    # by these rooms it was chosen
    python benchmarks/arrivals.py rooms-test --json record.json                       # these rooms chose nothing
    python benchmarks/arrivals.py rooms-test --encoder random-resnet50

Scenes are files or folders of them, with pictures, of rooms that can be built again. The signal is that of an exported
run: features of what is seen against those of the target's picture, with a threshold from the scene's own pictures
(`agents/arrival.py`). Who walks knows the way, or walks at random: the signal does not steer. Pictures are the scene's
own, or perturbed takes that the threshold has never seen; the target's picture stays as it is. Intervals are of the
mean over scenes; see `by_scene`.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from by_scene import interval

from clearway.agents.agent import FEATURES, POSE, Agent, Decisions, Observation, State
from clearway.agents.arrival import QUANTILE, Arrival, fitted_arrival
from clearway.agents.by_pose import RandomWalk, shortest_paths
from clearway.api.scenes import load_scenes
from clearway.deploy.from_run import compared_numbers
from clearway.evaluation.episodes import run_episodes
from clearway.evaluation.goals import drawn_goals
from clearway.evaluation.takes import Takes
from clearway.learn.provenance import hardware, package_versions
from clearway.live.conditions import REFERENCE
from clearway.perception.encode import encode_scenes
from clearway.scenes.scene import Scene
from clearway.views.seen import TAKES, takes_seen
from clearway.world.world import World, make_world

STEP_LIMIT = 100
WALKERS: dict[str, Callable[[World], Agent]] = {
    "shortest path": shortest_paths,
    "random walk": lambda world: RandomWalk(),
}


@dataclass(frozen=True)
class Rates:
    """Of one scene.

    Attributes:
        false: share of episodes in which it said so elsewhere before.
        beside: share of those false ones that were all at most a move or a turn from the target.
        missed: share of episodes that came to the target in which it did not say so there.
    """

    false: float
    beside: float
    missed: float


class Telling:
    """Another agent, with the signal; keeps where it was given.

    Args:
        agent: who walks, by poses at most.
        arrival: the signal.
    """

    sees = (POSE, FEATURES)

    def __init__(self, agent: Agent, arrival: Arrival) -> None:
        self._agent, self._arrival = agent, arrival
        self.told: list[tuple[int, int]] = []  # pose, target

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """See `Agent.reset`."""
        kept = {"looked_for": target[FEATURES], "goal": target[POSE]}
        return {**self._agent.reset(target, seed), **kept}

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """See `Agent.act`."""
        decisions, after = self._agent.act(observation, state)
        arrived = self._arrival(observation[FEATURES], state["looked_for"])
        self.told += zip(observation[POSE][arrived].tolist(), state["goal"][arrived].tolist(), strict=True)
        return replace(decisions, arrived=arrived), {**state, **after}


def rates(scene: Scene, takes: Takes | None, walker: str, quantile: float, goals: int, seed: int) -> Rates:
    """Of one scene; an episode to each of some goals."""
    assert scene.features is not None and scene.encoder is not None
    arrival = fitted_arrival(
        np.asarray(scene.features), compared_numbers(scene.encoder, scene.features.shape[1]), quantile
    )
    assert arrival is not None, "a room has different pictures"
    world: World = make_world([scene], {scene.name: drawn_goals(scene, goals, seed)})
    agent = Telling(WALKERS[walker](world), arrival)
    table = run_episodes(
        world, agent, scenes=[scene], takes=takes, episodes_per_target=1, step_limit=STEP_LIMIT, seed=seed
    )
    assert table.false_arrivals is not None and table.told_arrival is not None
    wrong = table.false_arrivals > 0
    steps = scene.distances_to(np.arange(scene.state_count))  # (S, S), by target
    far = {goal for pose, goal in agent.told if pose != goal and steps[goal, pose] > 1}
    goals_of = world.target_state.cpu().numpy()[table.target]
    beside = np.array([goal not in far for goal in goals_of.tolist()])
    told = table.told_arrival[table.reached]
    return Rates(
        float(wrong.mean()),
        float(beside[wrong].mean()) if wrong.any() else np.nan,
        float(1 - told.mean()) if len(told) else np.nan,
    )


def measured(
    scenes: Sequence[Scene], takes: Takes | None, quantiles: Sequence[float], goals: int, seed: int
) -> dict[str, dict[str, list[Rates]]]:
    """By walker, then by quantile: rates of each scene."""
    found: dict[str, dict[str, list[Rates]]] = {}
    for walker in WALKERS:
        for quantile in quantiles:
            each = [None if takes is None else takes.of_scene(number) for number in range(len(scenes))]
            rows = [rates(*part, walker, quantile, goals, seed) for part in zip(scenes, each, strict=True)]
            found.setdefault(walker, {})[f"{quantile:g}"] = rows
    return found


def table(found: Mapping[str, Mapping[str, Mapping[str, Sequence[Rates]]]]) -> str:
    """As Markdown, a row a way of seeing, of walking and a quantile."""
    lines = ["| pictures | walker | quantile | false arrivals | of these all beside it | missed |", "|" + "---|" * 6]
    for pictures, walkers in found.items():
        for walker, by_quantile in walkers.items():
            for quantile, rows in by_quantile.items():
                columns = [np.array([getattr(row, name) for row in rows]) for name in ("false", "beside", "missed")]
                lines.append(f"| {pictures} | {walker} | {quantile} | " + " | ".join(map(shown, columns)) + " |")
    return "\n".join(lines)


def shown(values: np.ndarray) -> str:
    """Mean and interval, per cent."""
    if np.isnan(values).all():
        return ""
    kept = values[~np.isnan(values)]
    low, high = interval(kept)
    return f"{100 * kept.mean():.1f} % ({100 * low:.1f}-{100 * high:.1f})"


def main() -> None:
    """Measure, print, and write the record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--goals", type=int, default=20, help="of each scene")
    parser.add_argument("--takes", type=int, default=TAKES, help="of each pose, perturbed")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--encoder", help="default: that of the scenes")
    parser.add_argument("--quantiles", nargs="+", type=float, default=[QUANTILE])
    parser.add_argument("--json", type=Path, help="where the record is written")
    args = parser.parse_args()
    scenes = load_scenes(args.scenes)
    if args.encoder:
        scenes = encode_scenes(scenes, args.encoder)
    takes = takes_seen(scenes, REFERENCE, (FEATURES,), None, takes=args.takes, seed=args.seed)
    seen = {"own": None, "perturbed": takes}
    found = {name: measured(scenes, here, args.quantiles, args.goals, args.seed) for name, here in seen.items()}
    encoder = scenes[0].encoder
    print(f"{len(scenes)} scenes, {args.goals} goals each, encoder {encoder and encoder.name}\n\n{table(found)}")
    if args.json:
        kept = json.loads(json.dumps(found, default=asdict).replace("NaN", "null"))
        asked = {name: str(value) for name, value in vars(args).items() if name not in ("scenes", "json")}
        record = {"scenes": [scene.name for scene in scenes], "asked": asked, "rates": kept}
        record |= {"hardware": hardware(), "versions": package_versions()}
        args.json.write_text(json.dumps(record) + "\n")


if __name__ == "__main__":
    main()
