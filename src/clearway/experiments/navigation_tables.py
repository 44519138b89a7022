"""The paper's kind of table: steps and collisions by scene and on average, agents beside references.

These are exact figures, a random walk, agents on learnt maps and, where an experiment has them, other learners.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from typing import TypeAlias

import numpy as np

from clearway.evaluation.across_seeds import mean_estimate
from clearway.evaluation.episodes import episode_starts
from clearway.evaluation.metrics import by_scene
from clearway.evaluation.optimum import OPTIMUM, SOFT_FIXED_POINT, world_yardsticks
from clearway.evaluation.protocol import SHORTEST_PATH
from clearway.experiments.groups import EXACT, WALKED, Group, Scores, random_walk
from clearway.experiments.learnt_maps import ABOUT_MAPS, on_maps
from clearway.experiments.other_learners import ABOUT_OTHERS
from clearway.experiments.paper_numbers import THE_PAPER, PaperRow, reminder
from clearway.experiments.plan import RANDOM_WALK, TargetSets
from clearway.experiments.section import ReportTable, Value
from clearway.experiments.setting import Setting
from clearway.reward import Reward
from clearway.world.world import World

METRICS = ("steps", "collisions")
TARGET_METRICS = ("steps", "shortest_path_steps", "collisions", "success", "sc", "sc_4x", "spl")
PAPER_COLUMN = "the paper's average of these scenes"
NAMED_FAILURES = 8  # of each kind of agent, in the note below the table
Found: TypeAlias = tuple[tuple[str, str], Scores]
"""A learner and what tells its agents from others, and their figures."""


def navigation_tables(
    name: str,
    title: str,
    setting: Setting,
    targets: TargetSets,
    groups: Sequence[Group],
    paper: Mapping[str, PaperRow],
    others: Sequence[Group] = (),
) -> tuple[ReportTable, ReportTable]:
    """Means by scene, and all targets one by one.

    Args:
        name, title: of the tables.
        setting: see there.
        targets: that all groups were tried on.
        groups: rows of the tables; of their rewards exact references are given.
        paper: the paper's own row by the name of a reward.
        others: further rows, to which neither belongs.
    """
    world = setting.world(targets)
    found: list[Found] = [
        ((group.learner, group.agent), group.scores(setting.out, world.target_count)) for group in groups
    ]
    for group in others:
        frames = f"{group.runs[0].learner.frames:,} frames"
        found.append(((group.learner, frames), group.scores(setting.out, world.target_count)))
    of_paper = [paper.get(group.runs[0].reward.name) for group in groups]
    rewards = list(dict.fromkeys(group.runs[0].paid for group in groups))
    trial = setting.trial(targets)
    exact = _references(world, rewards, episode_starts(world, trial.episodes_per_target, trial.seed))
    walked = random_walk(world, trial)
    found += [(mapped.called, mapped.scores) for mapped in on_maps(setting, trial)]
    rows: list[tuple[Value, ...]] = []
    for metric in METRICS:
        for (kind, values), published in zip_longest(found, of_paper):
            own = published.average(metric, world.scene_names) if published else None
            rows.append(_group_row(world, kind, values, metric, own))
        for reward, row in paper.items():
            scenes = row.by_scene(metric, world.scene_names)
            rows.append(_reference_row(metric, THE_PAPER, reward, scenes, row.average(metric, world.scene_names)))
        for reference, agent, figures in [*exact, (WALKED, RANDOM_WALK, {m: walked.of(m)[0] for m in METRICS})]:
            means = _by_scene(world, figures[metric])
            rows.append(_reference_row(metric, reference, agent, means, float(np.mean(means))))
    left = ("figure", "learner", "agent", "seeds", "failed targets")
    by_scene_headings = (heading for scene in world.scene_names for heading in (scene, f"95 % of {scene}"))
    headings = (*left, *by_scene_headings, "average", "95 %", PAPER_COLUMN)
    notes = (
        reminder(setting.original, original_targets=targets == setting.targets),
        "Failed targets: of those of all seeds, the ones that an episode did not reach; it counts with all its steps.",
        *_failures(world, found),
        f"{SOFT_FIXED_POINT.capitalize()}: where the published loss comes to rest, exactly (entropy weight 0.01; "
        "rewards clipped unless it says otherwise). Exact figures are means over the starts of all agents.",
        ABOUT_MAPS,
        *([ABOUT_OTHERS] if others else []),
    )
    return ReportTable(name, title, headings, tuple(rows), notes), _target_table(name, title, world, found)


def _group_row(
    world: World, kind: tuple[str, str], values: Scores, metric: str, of_paper: float | None
) -> tuple[Value, ...]:
    learnt = (metric, *kind, len(values))
    if not len(values):
        return (*learnt, None, *(None for _ in world.scene_names for _ in range(2)), None, None, of_paper)
    target_scene, own = world.target_scene.numpy(), values.of(metric)
    parts = [target_scene == scene for scene in range(len(world.scene_names))]
    scenes = [mean_estimate(own[:, part], target_scene[part]) for part in parts]
    estimate = mean_estimate(own, target_scene)
    figures = (value for scene in scenes for value in (scene.value, scene.ends))
    return (*learnt, values.failed(), *figures, estimate.value, estimate.ends, of_paper)


def _reference_row(
    metric: str, kind: str, name: str, means: Sequence[float | None], average: float | None
) -> tuple[Value, ...]:
    return (metric, kind, name, None, None, *(value for mean in means for value in (mean, None)), average, None, None)


def _failures(world: World, found: Sequence[Found]) -> list[str]:
    """Which targets failed, by kind of agent."""
    notes = []
    for (learner, agent), values in found:
        pairs = np.argwhere(values.of("success") < 1).tolist()
        places = [
            f"{world.scene_names[world.target_scene[index]]} {world.scene_state(index)} (seed {values.seeds[row]})"
            for row, index in pairs
        ]
        more = f" and {len(places) - NAMED_FAILURES} more, see all targets" if len(places) > NAMED_FAILURES else ""
        if places:
            notes.append(f"Failed, {learner}, {agent}: {', '.join(places[:NAMED_FAILURES])}{more}.")
    return notes


def _by_scene(world: World, by_target: np.ndarray) -> list[float]:
    """(M,) -> C means."""
    return by_scene(by_target[:, None], world.target_scene.numpy())[:, 0].tolist()


def _references(
    world: World, rewards: Sequence[Reward], starts: np.ndarray
) -> list[tuple[str, str, dict[str, np.ndarray]]]:
    """Kind, name, and steps and collisions, (M,) each, of the shortest path and of the rewards' exact policies.

    Args:
        world: see there.
        rewards: as agents were paid them.
        starts: (M, E) int64 that the agents walked from. A hundred starts are luck: their shortest paths differ from
            those of all starts by up to a tenth, more than agents from optima.
    """
    found: list[tuple[str, str, dict[str, np.ndarray]]] = []
    for reward in rewards:
        exact = [each.yardstick for each in world_yardsticks(world, reward, starts=starts)]
        if not found:
            shortest = np.array([each.shortest_path_steps for each in exact])
            found.append((EXACT, SHORTEST_PATH, {"steps": shortest, "collisions": np.zeros(len(exact))}))
        for name, policies in ((OPTIMUM, [e.optimal for e in exact]), (SOFT_FIXED_POINT, [e.soft for e in exact])):
            label = f"{name} ({reward.name}{'' if reward.clip else ', unclipped'})"
            found.append((EXACT, label, {m: np.array([getattr(policy, m) for policy in policies]) for m in METRICS}))
    return found


def _target_table(name: str, title: str, world: World, found: Sequence[Found]) -> ReportTable:
    """A row for each target and kind of agent, those that failed first: nothing is hidden in a mean."""
    rows: list[tuple[Value, ...]] = []
    for index, scene in enumerate(world.target_scene.tolist()):
        for kind, values in found:
            place = (world.scene_names[scene], world.scene_state(index), *kind)
            rows += [
                (*place, seed, *(float(values.of(metric)[row, index]) for metric in TARGET_METRICS))
                for row, seed in enumerate(values.seeds)
            ]
    headings = ("scene", "target", "learner", "agent", "seed", *TARGET_METRICS)
    success = headings.index("success")
    rows.sort(key=lambda row: row[success] == 1.0)
    return ReportTable(f"{name}_targets", f"{title}: every target", headings, tuple(rows), folded=True)
