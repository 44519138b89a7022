"""What figures 5 and 6 share: success on unseen targets, stricter scores, and the random walk's beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.evaluation.across_seeds import mean_estimate
from clearway.evaluation.metrics import SC_DETOUR, SC_STEPS
from clearway.experiments.groups import Group, Scores, compared
from clearway.experiments.plan import TargetSets
from clearway.experiments.section import Series, Value
from clearway.experiments.setting import Setting
from clearway.reward import Reward
from clearway.world.world import World

METRICS = ("sc", "sc_4x", "spl")
HEADINGS = ("sc", "95 % of sc", "sc within 4 x shortest", "95 % of that", "SPL", "95 % of SPL")
TARGET_HEADINGS = ("scene", "target", "learner", "agent", "seed", *METRICS)
BAND = "Bars: 95 % intervals over seeds, for these targets"
NOTE = (
    "sc: share of episodes that reach the target in under 500 steps. It flatters: a random walk reaches much within "
    "500 steps, so beside it stand the share within 4 times the shortest path, and SPL. Episodes end when both shares "
    "are settled; SPL takes later arrivals for failures. Intervals are over seeds, for these targets."
)
OWN_GOALS = (
    "{}: never given means that the environment never paid for these targets. The learner has set itself every pose "
    "that it has passed, these among them, so this measures what it learns without being asked, not pictures unseen."
)


def told_of_own_goals(setting: Setting) -> list[str]:
    """A note on learners that set themselves goals, where there are any."""
    names = [name for name, learner in setting.learners.items() if getattr(learner, "goals", None) == "seen"]
    return [OWN_GOALS.format(", ".join(names))] if names else []


@dataclass(frozen=True)
class Tried:
    """Figures of some agents on targets that they were not trained on; `target_scene`: (M,) int."""

    scores: Scores
    target_scene: np.ndarray

    def cells(self) -> tuple[Value, ...]:
        """The figures under `HEADINGS`."""
        if not len(self.scores):
            return (None,) * len(HEADINGS)
        estimates = [mean_estimate(self.scores.of(metric), self.target_scene) for metric in METRICS]
        return tuple(value for estimate in estimates for value in (estimate.value, estimate.ends))

    def by_target(self, world: World, learner: str, agent: str) -> list[tuple[Value, ...]]:
        """A row under `TARGET_HEADINGS` for each target and seed, targets being those of the world."""
        return [
            (
                *(world.scene_names[scene], world.scene_state(index), learner, agent, seed),
                *(float(self.scores.of(metric)[row, index]) for metric in METRICS),
            )
            for index, scene in enumerate(self.target_scene.tolist())
            for row, seed in enumerate(self.scores.seeds)
        ]


def tried(
    setting: Setting, rewards: Sequence[Reward], targets: TargetSets, *, trained: TargetSets | None = None
) -> list[Group]:
    """A group for each learner and reward, tried on targets until success is settled.

    Args:
        setting: see there.
        rewards: to be compared.
        targets: to be tried on.
        trained: to be trained on; None: the paper's.
    """
    farthest = max(
        int(scene.distances_to(np.array(own)).max()) for scene, own in zip(setting.scenes, targets, strict=True) if own
    )
    step_limit = max(SC_STEPS, SC_DETOUR * farthest)
    return compared(setting, rewards, targets=trained, tried_on=targets, step_limit=step_limit)


def together(parts: Sequence[Tried]) -> Tried:
    """Several sets of targets as one, each counting alike, of the seeds that all of them have."""
    seeds = tuple(seed for seed in parts[0].scores.seeds if all(seed in part.scores.seeds for part in parts))
    values = [part.scores.values[[part.scores.seeds.index(seed) for seed in seeds]] for part in parts]
    scenes = 1 + max(int(part.target_scene.max()) for part in parts)
    return Tried(
        Scores(seeds, np.concatenate(values, axis=1)),
        np.concatenate([number * scenes + part.target_scene for number, part in enumerate(parts)]),
    )


def lines(kinds: dict[str, list[tuple[float, Tried]]]) -> tuple[Series, ...]:
    """By label the success score over something, with intervals where there are several seeds."""
    found = [_line(label, [(x, own) for x, own in points if len(own.scores)]) for label, points in kinds.items()]
    return tuple(line for line in found if line.x)


def _line(label: str, points: Sequence[tuple[float, Tried]]) -> Series:
    estimates = [mean_estimate(own.scores.of("sc"), own.target_scene) for _, own in points]
    ends = [found.interval for found in estimates]
    complete = all(each is not None for each in ends)
    low = [each[0] for each in ends if each is not None] if complete else None
    high = [each[1] for each in ends if each is not None] if complete else None
    return Series(label, [x for x, _ in points], [found.value for found in estimates], low, high)
