"""`evaluate` and `load_agent`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias, get_args

from clearway.api.arguments import as_choice, as_path, as_seed, as_whole
from clearway.api.scenes import Scenes, load_scenes
from clearway.api.training import TrainResult
from clearway.errors import ArgumentError
from clearway.evaluation.episodes import EPISODES_PER_TARGET, STEP_CAP
from clearway.evaluation.files import write_evaluations
from clearway.evaluation.report import Evaluation
from clearway.evaluation.run import evaluate_run
from clearway.evaluation.tables import Level, Width, markdown_table
from clearway.learn import load
from clearway.learn.load import TrainedAgent
from clearway.scenes.scene import Scene

Run: TypeAlias = TrainedAgent | TrainResult | str | os.PathLike[str]


@dataclass(frozen=True)
class EvaluateResult:
    """What came of an evaluation. Shown at the end of a notebook's cell, it is its table.

    Attributes:
        agent: the agent.
        evaluations: of the agent with sampled actions, which is the paper's way, then of its other ways of choosing
            them, of the exact optima, a random walk and shortest paths.
        scenes: where it walked.
    """

    agent: TrainedAgent
    evaluations: tuple[Evaluation, ...]
    scenes: tuple[Scene, ...]

    def __repr__(self) -> str:
        average = self.evaluations[0].average
        solved = f"{average.solved_targets} of {average.target_count} targets solved"
        return f"<EvaluateResult: {solved}, {average.values['steps']:.4g} steps>"

    @property
    def figures(self) -> Mapping[str, float]:
        """The agent's figures with sampled actions, by name (`docs/metrics.md`): the mean over scenes."""
        return self.evaluations[0].average.values

    @property
    def intervals(self) -> Mapping[str, tuple[float, float]]:
        """The 95 % bootstrap interval of each of the `figures`."""
        return self.evaluations[0].average.intervals

    @property
    def solved_targets(self) -> int:
        """Targets that the agent reached in every episode, with sampled actions."""
        return self.evaluations[0].average.solved_targets

    def markdown(self, level: Level = "average", *, width: Width = "page") -> str:
        """The table in Markdown.

        Args:
            level: a row an agent ("average"), or one for each of its "scenes" or "targets".
            width: "terminal", "page" or "all": how many columns.

        Raises:
            ArgumentError: there is no such level or width.
        """
        as_choice("level", level, get_args(Level))
        as_choice("width", width, get_args(Width))
        return markdown_table(self.evaluations, level, width=width)

    def text(self, level: Level = "average") -> str:
        """The table as `clearway evaluate` prints it, without colours. Raises ArgumentError: no such level."""
        from rich.console import Console

        from clearway.evaluation.tables import rich_tables

        as_choice("level", level, get_args(Level))
        console = Console(width=TEXT_WIDTH, color_system=None, markup=False, legacy_windows=False)
        with console.capture() as captured:
            console.print(rich_tables(self.evaluations, [level]))
        return captured.get()

    def to_json(self) -> dict[str, object]:
        """All figures as JSON values: the sampled agent's, and all the others' under "others"."""
        first, *others = (evaluation.to_json() for evaluation in self.evaluations)
        return {**first, "others": others}

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Leave evaluation.json and evaluation.md in a folder, as `clearway evaluate` does in the run's."""
        path = as_path("folder", folder)
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as fault:
            raise ArgumentError(f"folder={path}: not a folder to write to ({fault.strerror}). Give another") from fault
        write_evaluations(path, self.to_json(), self.evaluations)

    def _repr_markdown_(self) -> str:
        return self.markdown()


TEXT_WIDTH = 120  # columns


def load_agent(run: str | os.PathLike[str], checkpoint: str | os.PathLike[str] | None = None) -> TrainedAgent:
    """The trained agent of a run folder, from its newest checkpoint or the one given.

    Raises:
        ArgumentError: an argument is no path.
        ClearwayError: there is no such run, the checkpoint is damaged or lies in another folder.
    """
    chosen = None if checkpoint is None else as_path("checkpoint", checkpoint)
    return load.load_agent(as_path("run", run), chosen)


def evaluate(
    run: Run,
    scenes: Scenes | None = None,
    *,
    episodes: int = EPISODES_PER_TARGET,
    step_cap: int = STEP_CAP,
    seed: int = 0,
) -> EvaluateResult:
    """Evaluate a trained agent by the paper's protocol, beside exact optima, a random walk and shortest paths.

    Args:
        run: a run folder, what `train` returned, or an agent.
        scenes: those of the training, as files, folders of them, or scenes; None: those that were trained on in memory,
            else the files that the run names.
        episodes: episodes a target.
        step_cap: steps after which an episode has failed.
        seed: of starts, sampled actions and the bootstrap.

    Raises:
        ArgumentError: an argument is of the wrong kind or out of range.
        ClearwayError: the run cannot be read, or a scene is missing or not the one that the agent was trained on.
    """
    count, most = as_whole("episodes", episodes, 1), as_whole("step_cap", step_cap, 1)
    number = as_seed("seed", seed)
    agent = _agent(run)
    found: list[Scene] | None = None
    if scenes is not None:
        found = load_scenes(scenes)
    elif isinstance(run, TrainResult):
        found = list(run.scenes)
    places = load.run_scenes(agent.record, found)
    evaluations = evaluate_run(agent, places, episodes_per_target=count, step_cap=most, seed=number)
    return EvaluateResult(agent, tuple(evaluations), tuple(places))


def _agent(run: Run) -> TrainedAgent:
    if isinstance(run, TrainedAgent):
        return run
    if isinstance(run, TrainResult):
        return run.agent
    if isinstance(run, str | os.PathLike):
        return load_agent(run)
    problem = f"run={run!r:.80}: expected a run folder, what train returned, or an agent"
    raise ArgumentError(f"{problem}. Give one of these")
