"""Figure 3: steps and collisions added up over the evaluation's episodes, best and worst agent of each reward."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from clearway.evaluation.across_seeds import mean_estimate
from clearway.evaluation.episodes import EpisodeTable
from clearway.evaluation.metrics import by_scene
from clearway.evaluation.protocol import SHORTEST_PATH
from clearway.experiments.convergence import ONE_TARGET
from clearway.experiments.groups import EXACT, PAIR, WALKED, Group, all_jobs, compared, random_walk
from clearway.experiments.job import episodes_of
from clearway.experiments.learnt_maps import ABOUT_MAPS, on_maps
from clearway.experiments.plan import RANDOM_WALK, Job
from clearway.experiments.section import Claim, ReportFigure, ReportTable, Section, Series, Value
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import judged_less, with_failures
from clearway.reward import COLLISION_AWARE, SHORTEST

FIGURES = {"steps": "steps so far", "collisions": "collisions so far"}


def jobs(setting: Setting) -> list[Job]:
    """What must be done: nothing that the main experiment does not do."""
    return all_jobs(compared(setting, PAIR))


def section(setting: Setting) -> Section:
    """What came of it."""
    groups = compared(setting, PAIR)
    scene_of_target = setting.world().target_scene.numpy()
    figures = [
        ReportFigure(
            f"fig3_{learner}_{scene.name}_{metric}",
            f"{learner}, {scene.name}: {metric} over the episodes",
            "episodes of every target",
            f"{label}, mean over targets",
            tuple(
                series
                for group in groups
                if group.learner == learner
                for series in _best_and_worst(setting, group, metric, np.flatnonzero(scene_of_target == number))
            ),
        )
        for learner in dict.fromkeys(group.learner for group in groups)
        for number, scene in enumerate(setting.scenes)
        for metric, label in FIGURES.items()
    ]
    return Section(
        name="fig3",
        title="Accumulated steps and collisions (the paper's figure 3)",
        text=(
            "Best and worst are the seeds whose sum over all episodes in that scene is smallest and largest, for steps "
            "and for collisions by themselves. The paper prints its figures as a picture alone."
        ),
        tables=(_table(setting, groups),),
        figures=tuple(figure for figure in figures if figure.series),
        claims=tuple(_claims(setting, groups)),
    )


def _table(setting: Setting, groups: Sequence[Group]) -> ReportTable:
    """The best and the worst of each kind of agent over all scenes, by seeds and by targets."""
    world, trial = setting.world(), setting.trial()
    scene, walked = world.target_scene.numpy(), random_walk(world, trial)
    learnt = [(group.learner, group.agent, group.scores(setting.out, world.target_count)) for group in groups]
    learnt += [(*mapped.called, mapped.scores) for mapped in on_maps(setting, trial)]
    rows: list[tuple[Value, ...]] = []
    for metric in FIGURES:
        fewest = walked.of("shortest_path_steps") if metric == "steps" else np.zeros((1, world.target_count))
        rows += [(metric, learner, agent, len(own), *_ends(own.of(metric), scene)) for learner, agent, own in learnt]
        rows += [
            (metric, kind, agent, None, *_ends(values, scene))
            for kind, agent, values in ((EXACT, SHORTEST_PATH, fewest), (WALKED, RANDOM_WALK, walked.of(metric)))
        ]
    notes = (
        "An episode's mean. The best and the worst seed's are over scenes; the worst target is the one with the most, "
        "in each run by itself.",
        ABOUT_MAPS,
    )
    headings = (
        "figure",
        "learner",
        "agent",
        "seeds",
        "best seed",
        "worst seed",
        "worst target",
        "95 %",
        "worst target of any seed",
    )
    return ReportTable("fig3", "Best and worst", headings, tuple(rows), notes)


def _ends(values: np.ndarray, target_scene: np.ndarray) -> tuple[Value, ...]:
    """The best and the worst seed's figure, that of the worst target, its interval, and the worst of all.

    Args:
        values: (R, M).
        target_scene: (M,) int.
    """
    if not len(values):
        return (None,) * 5
    of_seeds = by_scene(values[..., None], target_scene)[..., 0].mean(1)
    worst = values.max(axis=1, keepdims=True)
    estimate = mean_estimate(worst, ONE_TARGET)
    return of_seeds.min(), of_seeds.max(), estimate.value, estimate.ends, worst.max()


def _claims(setting: Setting, groups: Sequence[Group]) -> Iterator[Claim]:
    """The collision-aware agent has fewer collisions in the worst case too."""
    world = setting.world()
    found = {(group.learner, group.agent): group.scores(setting.out, world.target_count) for group in groups}
    for learner in setting.learners:
        pair = [found[learner, reward.name] for reward in (COLLISION_AWARE, SHORTEST)]
        ours, theirs = (own.of("collisions").max(axis=1, keepdims=True) for own in pair)
        text = f"{learner}: fewer collisions in the worst case (the target with the most, in each run)"
        claim = judged_less(text, "collisions on a run's worst target", ours, theirs, ONE_TARGET)
        arrived, others = (own.of("success") for own in pair)
        yield with_failures(claim, arrived, others, world.target_scene.numpy())


def _best_and_worst(setting: Setting, group: Group, metric: str, targets: np.ndarray) -> list[Series]:
    found = [(run.seed, episodes_of(setting.out, run, group.trial)) for run in group.runs]
    sums = [(seed, accumulated(table, metric)[targets].mean(0)) for seed, table in found if table is not None]
    if not sums:
        return []
    ranked = sorted(sums, key=lambda pair: float(pair[1][-1]))
    chosen = {"best": ranked[0], "worst": ranked[-1]} if len(ranked) > 1 else {"only": ranked[0]}
    return [
        Series(f"{group.agent}, {kind} (seed {seed})", list(range(1, len(line) + 1)), line.tolist())
        for kind, (seed, line) in chosen.items()
    ]


def accumulated(table: EpisodeTable, metric: str) -> np.ndarray:
    """(M, E) sums over the first 1 to E episodes of each target."""
    return getattr(table, metric).reshape(int(table.target.max()) + 1, -1).cumsum(1)
