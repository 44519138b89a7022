"""The paper's kind of table: steps and collisions by scene and on average, agents beside exact references."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from clearway.envs.world import World
from clearway.evaluate.across_seeds import mean_estimate
from clearway.evaluate.metrics import by_scene
from clearway.evaluate.optimum import OPTIMUM, SOFT_FIXED_POINT, world_yardsticks
from clearway.experiments.groups import RANDOM_WALK, Group, Scores, random_walk
from clearway.experiments.paper_numbers import REMINDER, REMINDER_ORIGINAL, PaperRow
from clearway.experiments.plan import TargetSets
from clearway.experiments.section import ReportTable, Value
from clearway.experiments.setting import Setting
from clearway.reward import Reward

METRICS = ("steps", "collisions")
TARGET_METRICS = ("steps", "shortest_path_steps", "collisions", "success", "sc", "spl")
PAPER_COLUMN = "the paper's average"
EXACT = "exact"


def navigation_tables(
    name: str, title: str, setting: Setting, targets: TargetSets, groups: Sequence[Group], paper: Mapping[str, PaperRow]
) -> tuple[ReportTable, ReportTable]:
    """Means by scene, and all targets one by one.

    Args:
        name, title: of the tables.
        setting: see there.
        targets: that all groups were tried on.
        groups: rows of the tables.
        paper: the paper's own row by the name of a reward.
    """
    world = setting.world(targets)
    found = [(group, group.scores(setting.out, world.target_count)) for group in groups]
    rewards = list(dict.fromkeys(group.runs[0].reward for group in groups))
    exact = _references(world, rewards)
    walked = random_walk(world, setting.trial(targets))
    rows: list[tuple[Value, ...]] = []
    for metric in METRICS:
        for group, values in found:
            of_paper = paper.get(group.runs[0].reward.name)
            own = of_paper.of(metric, "average") if of_paper else None
            rows.append(_group_row(world, group, values, metric, own))
        rows += [_reference_row(world, agent, figures[metric], metric) for agent, figures in exact]
        rows.append(_reference_row(world, RANDOM_WALK, walked.of(metric)[0], metric, kind="walked"))
    left = ("figure", "learner", "agent", "seeds", "failed targets")
    headings = (*left, *world.scene_names, "average", "95 %", PAPER_COLUMN)
    notes = (
        REMINDER_ORIGINAL if setting.original else REMINDER,
        "Failed targets: of all seeds, those that some episode did not reach; it counts with all its steps.",
        f"{SOFT_FIXED_POINT.capitalize()}: where the published loss comes to rest, exactly.",
    )
    return ReportTable(name, title, headings, tuple(rows), notes), _target_table(name, title, world, found)


def _group_row(world: World, group: Group, values: Scores, metric: str, of_paper: float | None) -> tuple[Value, ...]:
    learnt = (metric, group.learner, group.agent, len(values))
    if not len(values):
        return (*learnt, None, *(None for _ in world.scene_names), None, None, of_paper)
    target_scene = world.target_scene.numpy()
    failed = int((values.of("success") < 1).sum())
    estimate = mean_estimate(values.of(metric), target_scene)
    means = _by_scene(world, values.of(metric).mean(0))
    return (*learnt, failed, *means, estimate.value, estimate.ends, of_paper)


def _reference_row(world: World, name: str, by_target: np.ndarray, metric: str, kind: str = EXACT) -> tuple[Value, ...]:
    means = _by_scene(world, by_target)
    return (metric, kind, name, None, None, *means, float(np.mean(means)), None, None)


def _by_scene(world: World, by_target: np.ndarray) -> list[float]:
    """(M,) -> C means."""
    return by_scene(by_target[:, None], world.target_scene.numpy())[:, 0].tolist()


def _references(world: World, rewards: Sequence[Reward]) -> list[tuple[str, dict[str, np.ndarray]]]:
    """Steps and collisions, (M,) each, of the shortest path and of each reward's exact policies."""
    found: list[tuple[str, dict[str, np.ndarray]]] = []
    for reward in rewards:
        exact = [each.yardstick for each in world_yardsticks(world, replace(reward, clip=True))]
        if not found:
            shortest = np.array([each.shortest_path_steps for each in exact])
            found.append(("shortest path", {"steps": shortest, "collisions": np.zeros(len(exact))}))
        for name, policies in ((OPTIMUM, [e.optimal for e in exact]), (SOFT_FIXED_POINT, [e.soft for e in exact])):
            figures = {metric: np.array([getattr(policy, metric) for policy in policies]) for metric in METRICS}
            found.append((f"{name} ({reward.name})", figures))
    return found


def _target_table(name: str, title: str, world: World, found: Sequence[tuple[Group, Scores]]) -> ReportTable:
    """A row for each target and kind of agent: nothing is hidden in a mean."""
    rows: list[tuple[Value, ...]] = []
    for index, scene in enumerate(world.target_scene.tolist()):
        for group, values in found:
            place = (world.scene_names[scene], world.scene_state(index), group.learner, group.agent)
            rows += [
                (*place, seed, *(float(values.of(metric)[row, index]) for metric in TARGET_METRICS))
                for row, seed in enumerate(values.seeds)
            ]
    headings = ("scene", "target", "learner", "agent", "seed", *TARGET_METRICS)
    return ReportTable(f"{name}_targets", f"{title}: every target", headings, tuple(rows), folded=True)
