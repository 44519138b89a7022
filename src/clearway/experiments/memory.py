"""What memory alone solves: a planner on steps that random walkers have seen, beside agents that learn to walk."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from clearway.agents.on_learnt_map import UNSEEN, MapPlanner, NearestPicture
from clearway.evaluation.across_seeds import failed_targets, mean_estimate
from clearway.evaluation.episodes import run_episodes
from clearway.evaluation.metrics import by_target
from clearway.experiments.groups import RANDOM_WALK, Group, Scores, all_jobs, all_missing, compared, random_walk
from clearway.experiments.kept import keep, kept
from clearway.experiments.plan import Job, Trial
from clearway.experiments.section import Claim, ReportFigure, ReportTable, Section, Series, Value
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import judged_less, with_failures
from clearway.learn.bc import BC
from clearway.learn.learner import Learner
from clearway.learn.q_learning import QLearning
from clearway.reward import COLLISION_AWARE, SHORTEST
from clearway.scenes.actions import ACTION_COUNT
from clearway.world.world import World

FILE = "memory.json"
PLANNER, NEAREST = "planner on a learnt map", "nearest picture"
WALKERS = 100
FRAMES_A_POSE = (1, 2, 4, 8, 16, 32, 64)
"""Frames that the walkers take, for every pose of the scenes; the last has seen every step of the bathroom."""
METRICS = ("success", "steps", "collisions", "spl")
YARDSTICKS: tuple[Learner, ...] = (QLearning(), BC())


@dataclass(frozen=True)
class Mapped:
    """Agents of one kind on maps of so many frames.

    Attributes:
        agent: its kind.
        frames: of all walkers together.
        scores: on the setting's targets, a seed of walkers each.
        exact: for each seed, the share of starts from which the way to a target, of those known, is a shortest one.
    """

    agent: str
    frames: int
    scores: Scores
    exact: tuple[float, ...]


def jobs(setting: Setting) -> list[Job]:
    """What must be done: the main experiment's agents, and the yardsticks that are trained."""
    return all_jobs(_groups(setting))


def section(setting: Setting) -> Section:
    """What came of it."""
    groups, mapped = _groups(setting), list(_mapped(setting))
    return Section(
        name="memory",
        title="What memory alone solves",
        text=(
            f"{WALKERS} random walkers note where each action leads, and nothing else. The {PLANNER} takes shortest "
            f"ways over these steps (breadth-first search) and is told its pose; '{NEAREST}' is told its picture, and "
            "holds that it stands where the most similar one was taken. Where no way is known both act at random. "
            "Beside them: tabular Q-learning, behaviour cloning from shortest paths, and agents that learn to walk."
        ),
        tables=(_table(setting, groups, mapped),),
        figures=(_curve(mapped),),
        claims=tuple(_claims(setting, groups, mapped)),
        missing=all_missing(groups, setting.out),
    )


def seen_by_walkers(world: World, frames: int, seed: int) -> np.ndarray:
    """(S, A) int64, where actions led that `WALKERS` random walkers took in so many frames together; else `UNSEEN`.

    Walkers begin in poses from which a target can be reached, and are never put elsewhere.
    """
    draws = np.random.default_rng(seed)
    tables = world.next_state.cpu().numpy()
    found = np.full(tables.shape, UNSEEN, np.int64)
    here = draws.choice(np.unique(world.start_state.cpu().numpy()), WALKERS)
    for first in range(0, frames, WALKERS):
        walking = slice(0, min(WALKERS, frames - first))
        action = draws.integers(ACTION_COUNT, size=WALKERS)
        after = tables[here, action]
        found[here[walking], action[walking]] = after[walking]
        here = after
    return found


def _mapped(setting: Setting) -> Iterator[Mapped]:
    """Agents on maps, of every number of frames; what was found before is read from its file."""
    world, trial, path = setting.world(), setting.trial(), setting.out / FILE
    question = {
        "scenes": {f.name: [f.digest, list(own)] for f, own in zip(setting.files, setting.targets, strict=True)},
        "trial": trial.name,
    }
    known: dict[str, dict] = kept(path, question, "found") or {}
    for factor in FRAMES_A_POSE:
        frames = -(-factor * world.state_count // WALKERS) * WALKERS
        for kind in (PLANNER, NEAREST):
            found = []
            for seed in setting.seeds:
                key = json.dumps([kind, frames, seed])
                if key not in known:
                    known[key] = _tried(world, trial, kind, frames, seed)
                    keep(path, question, {"found": known})
                found.append(known[key])
            scores = Scores(setting.seeds, np.array([each["scores"] for each in found]))
            yield Mapped(kind, frames, scores, tuple(each["exact"] for each in found))


def _tried(world: World, trial: Trial, kind: str, frames: int, seed: int) -> dict:
    """Figures of one agent on targets, and the share of exactly shortest ways."""
    seen = seen_by_walkers(world, frames, seed)
    if kind == PLANNER:
        planner = MapPlanner(seen)
    else:
        assert world.features is not None, "scenes of an experiment have features"
        planner = NearestPicture(seen, world.features.float().cpu().numpy())
    table = run_episodes(
        world,
        planner,
        episodes_per_target=trial.episodes_per_target,
        step_limit=trial.step_limit,
        seed=trial.seed,
    )
    target = np.repeat(world.target_state.cpu().numpy(), world.start_count.cpu().numpy())
    held = planner.steps_to_go[world.start_state.cpu().numpy(), target]
    return {
        "scores": by_target(table, world.target_count).tolist(),
        "exact": float((held == world.start_steps.cpu().numpy()).mean()),
    }


def _groups(setting: Setting) -> list[Group]:
    frames = setting.budget.default_frames
    trained = {
        each.algorithm: each if frames is None else replace(each, frames=min(each.frames, frames))
        for each in YARDSTICKS
    }
    return compared(setting, (COLLISION_AWARE,)) + compared(replace(setting, learners=trained), (SHORTEST,))


def _table(setting: Setting, groups: Sequence[Group], mapped: Sequence[Mapped]) -> ReportTable:
    world = setting.world()
    scenes = world.target_scene.numpy()
    rows: list[tuple[Value, ...]] = []
    for own in mapped:
        exact = f"{min(own.exact):.1%} to {max(own.exact):.1%}" if own.agent == PLANNER else None
        rows.append((own.agent, "map", own.frames, *_figures(own.scores, scenes), exact))
    for group in groups:
        values = group.scores(setting.out, world.target_count)
        rows.append((group.learner, group.agent, group.runs[0].learner.frames, *_figures(values, scenes), None))
    rows.append((RANDOM_WALK, None, 0, *_figures(random_walk(world, setting.trial()), scenes), None))
    headings = ("agent", "reward", "frames", "seeds", "failed targets")
    estimates = (heading for metric in METRICS for heading in (metric, f"95 % of {metric}"))
    notes = (
        "Shortest ways: share of starts from which the map's way to a target is a shortest path, least to most of the "
        "seeds; who is not told poses may take others.",
    )
    return ReportTable("memory", "Memory alone", (*headings, *estimates, "shortest ways"), tuple(rows), notes)


def _figures(values: Scores, scenes: np.ndarray) -> tuple[Value, ...]:
    if not len(values):
        return (0, None, *(None for _ in METRICS for _ in range(2)))
    estimates = [mean_estimate(values.of(metric), scenes) for metric in METRICS]
    figures = (value for found in estimates for value in (found.value, found.ends))
    return (len(values), failed_targets(values.of("success")), *figures)


def _curve(mapped: Sequence[Mapped]) -> ReportFigure:
    """Share of shortest ways over frames."""
    own = [each for each in mapped if each.agent == PLANNER]
    low, high = ([end(each.exact) for each in own] for end in (min, max))
    line = Series(PLANNER, [each.frames for each in own], [float(np.mean(each.exact)) for each in own], low, high)
    labels = "frames of random walkers", "share of shortest ways"
    return ReportFigure("memory", "What a map holds", *labels, (line,), band="Band: smallest to largest of the seeds")


def _claims(setting: Setting, groups: Sequence[Group], mapped: Sequence[Mapped]) -> Iterator[Claim]:
    """Agents that learn to walk are better than the planner on the largest map: the paper does not ask."""
    world = setting.world()
    scenes = world.target_scene.numpy()
    planner = [each for each in mapped if each.agent == PLANNER][-1]
    theirs = planner.scores
    for group in groups:
        ours = group.scores(setting.out, world.target_count)
        text = f"{group.learner}: fewer steps than a {PLANNER} of {planner.frames:,} frames"
        claim = judged_less(text, "steps", ours.of("steps"), theirs.of("steps"), scenes)
        yield replace(with_failures(claim, ours.of("success"), theirs.of("success")), further=True)
