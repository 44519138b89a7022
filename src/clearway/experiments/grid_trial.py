"""Agents on the grid, by the scenes' own pictures or by perturbed ones; what came of episodes is kept in a file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from clearway.agents.agent import FEATURES, Agent
from clearway.agents.by_features import FeatureAgent
from clearway.agents.on_learnt_map import nearest_picture
from clearway.evaluation.episode_files import write_episodes
from clearway.evaluation.episodes import EpisodeTable, joined, run_episodes
from clearway.evaluation.takes import Takes
from clearway.experiments.plan import NEAREST, PlannedRun, Trial, targets_by_scene, told_of
from clearway.learn.checkpoint import newest_checkpoint
from clearway.learn.load import load_agent, load_network
from clearway.learn.run_folder import RunFolder
from clearway.scenes.scene import Scene
from clearway.views.seen import takes_seen
from clearway.world.world import World, make_world


def walk_on_grid(path: Path, folder: RunFolder, scenes: Sequence[Scene], run: PlannedRun, trial: Trial) -> None:
    """Walk a run's agent, or another beside it, and write what came of every episode.

    Args:
        path: the file to write.
        folder: of the run.
        scenes: of the run.
        run, trial: see there.

    Raises:
        ClearwayError: there is no such agent, or perturbed pictures cannot be taken.
    """
    targets = targets_by_scene(run.scenes, trial.targets)
    if trial.perturbed is None:
        world = make_world(scenes, targets)
        table = _walked(world, load_agent(folder.path, _kept(folder, run, trial)).on_poses(world), scenes, trial)
    else:
        table = _on_perturbed(folder, scenes, targets, run, trial)
    write_episodes(path, table, {**told_of(run, trial), "halfway": trial.halfway})


def _kept(folder: RunFolder, run: PlannedRun, trial: Trial) -> Path | None:
    """The checkpoint that is tried; None: the newest."""
    return newest_checkpoint(folder.milestone(run.halfway)) if trial.halfway else None


def _walked(
    world: World, agent: Agent, scenes: Sequence[Scene], trial: Trial, takes: Takes | None = None
) -> EpisodeTable:
    return run_episodes(
        world,
        agent,
        scenes=scenes,
        takes=takes,
        episodes_per_target=trial.episodes_per_target,
        step_limit=trial.step_limit,
        seed=trial.seed,
    )


def _on_perturbed(
    folder: RunFolder, scenes: Sequence[Scene], targets: Mapping[str, Sequence[int]], run: PlannedRun, trial: Trial
) -> EpisodeTable:
    """Scene after scene, whose pictures the agent sees by its own features of them."""
    assert trial.perturbed is not None
    asked, tables = trial.perturbed, []
    takes = takes_seen(scenes, asked.perturbations, (FEATURES,), None, takes=asked.takes, seed=trial.seed, workers=1)
    worlds = [make_world([scene], {scene.name: targets[scene.name]}) for scene in scenes]
    states = found = 0
    for number, (world, agent) in enumerate(zip(worlds, _walkers(folder, worlds, run, trial), strict=True)):
        table = _walked(world, agent, scenes[number : number + 1], trial, takes.of_scene(number))
        tables.append(replace(table, target=table.target + found, start=table.start + states))
        states, found = states + world.state_count, found + world.target_count
    return joined(tables)


def _walkers(folder: RunFolder, worlds: Sequence[World], run: PlannedRun, trial: Trial) -> Iterator[Agent]:
    """Who walks in each scene, by features of what is seen."""
    if trial.walker == NEAREST:
        yield from (nearest_picture(world, trial.seed) for world in worlds)
    else:
        network = load_network(folder.path, _kept(folder, run, trial))
        yield from (FeatureAgent(network.in_scene(number)) for number in range(len(worlds)))
