"""`evaluate` and `load_agent`."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias, get_args

from clearway.agents.agent import Agent
from clearway.agents.named import AgentMaker, Foreign, agent_maker, named_maker
from clearway.agents.selection import ActionSelection
from clearway.api.arguments import as_choice, as_path, as_seed, as_whole
from clearway.api.scenes import Scenes, load_scenes
from clearway.api.targets import Targets, chosen_targets
from clearway.api.training import TrainResult
from clearway.choices import GENERALIST, HELD_OUT, is_generalist
from clearway.deploy.card import Card
from clearway.deploy.navigator import open_agent
from clearway.errors import ArgumentError
from clearway.evaluation.episodes import EPISODES_PER_TARGET, STEP_LIMIT
from clearway.evaluation.files import write_evaluations
from clearway.evaluation.protocol import evaluate_agents
from clearway.evaluation.runs import evaluate_run
from clearway.evaluation.summary import Evaluation
from clearway.evaluation.tables import Level, Width, markdown_table
from clearway.learn import load
from clearway.learn.load import TrainedAgent
from clearway.scenes.scene import Scene, encoder_names
from clearway.torch_threads import torch_threads
from clearway.world.world import make_world

AGENT = "agent"  # the argument's name
Run: TypeAlias = TrainedAgent | TrainResult | str | os.PathLike[str]


@dataclass(frozen=True)
class EvaluateResult:
    """What came of an evaluation. Shown at the end of a notebook's cell, it is its table.

    Attributes:
        agent: the agent.
        evaluations: of the agent with sampled actions, which is the paper's way, then of its other ways of choosing
            them, of the exact optima, a random walk and shortest paths.
        scenes: where it walked.
        held_out: to targets that are held out of trainings.
    """

    agent: TrainedAgent | Agent
    evaluations: tuple[Evaluation, ...]
    scenes: tuple[Scene, ...]
    held_out: bool = False

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

    def text(self, level: Level = "average", *, all: bool = False) -> str:
        """The table as `clearway evaluate` prints it, as wide as the terminal, without colours.

        Args:
            level: a row an agent ("average"), or one for each of its "scenes" or "targets".
            all: a row for each way of acting and the exact optima too.

        Raises:
            ArgumentError: there is no such level.
        """
        from rich.console import Console

        from clearway.evaluation.tables import rich_tables

        as_choice("level", level, get_args(Level))
        width = shutil.get_terminal_size().columns
        console = Console(width=width, color_system=None, markup=False, legacy_windows=False)
        with console.capture() as captured:
            console.print(rich_tables(self.evaluations, [level], every=all, rest="text(all=True)"))
        return captured.get()

    def to_json(self) -> dict[str, object]:
        """All figures as JSON values: the sampled agent's, and all the others' under "others"."""
        first, *others = (evaluation.to_json() for evaluation in self.evaluations)
        return {**first, "others": others}

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Leave evaluation.json and evaluation.md in a folder, as `clearway evaluate` does in the run's.

        Where targets are held-out ones, held-out.json and held-out.md.
        """
        path = as_path("folder", folder)
        name = HELD_OUT if self.held_out else "evaluation"
        try:
            path.mkdir(parents=True, exist_ok=True)
            write_evaluations(path, self.to_json(), self.evaluations, name)
        except OSError as fault:
            raise ArgumentError(f"folder={path}: not a folder to write to ({fault.strerror}). Give another") from fault

    def _repr_markdown_(self) -> str:
        return self.markdown()


def is_exported(source: Path) -> bool:
    """A path is an exported agent's file, by its name; a folder of such a name is a run."""
    return source.suffix == ".onnx" and not source.is_dir()


def load_agent(run: str | os.PathLike[str], checkpoint: str | os.PathLike[str] | None = None) -> TrainedAgent:
    """The trained agent of a run folder, from its newest checkpoint or the one given.

    Raises:
        ArgumentError: an argument is no path.
        ClearwayError: there is no such run, the checkpoint is damaged or lies in another folder.
    """
    chosen, path = None if checkpoint is None else as_path("checkpoint", checkpoint), as_path("run", run)
    if is_generalist(path):
        problem = f"{GENERALIST}: comes with clearway, for any room, and has no run"
        raise ArgumentError(f"{problem}. Give it goals: clearway.evaluate_goals, clearway.evaluate_live")
    return load.load_agent(path, chosen)


def evaluate(
    agent: Run | Agent | AgentMaker,
    scenes: Scenes | None = None,
    *,
    targets: Targets = None,
    beside: Mapping[str, str | AgentMaker] | Iterable[str] = (),
    episodes: int = EPISODES_PER_TARGET,
    step_limit: int = STEP_LIMIT,
    seed: int = 0,
    show_progress: bool = False,
) -> EvaluateResult:
    """Evaluate an agent by the paper's protocol, beside exact optima, a random walk and shortest paths.

    Args:
        agent: a run folder, what `train` returned, what `load_agent` gave, an exported .onnx file; or an agent of your
            own: an `Agent`, or what makes one for a `World`, a class or a function.
        scenes: files, folders of them, or scenes. For a run those of its training; None: those that were trained on in
            memory, else the files that the run names. An agent without a run needs them.
        targets: state ids by scene name, of an agent without a run; None: those that an exported agent was trained on,
            else five seeded ones. A run has its own. Of either "held-out": five a scene that trainings leave out.
        beside: further agents to compare with: names of plugins or package.module:name, or such names, or what makes an
            agent for a `World`, by what tables are to call them.
        episodes: episodes a target.
        step_limit: steps after which an episode has failed.
        seed: of starts, sampled actions and the bootstrap.
        show_progress: draw a progress bar; where there is no terminal, print a line now and then.

    Raises:
        ArgumentError: an argument is of the wrong kind or out of range.
        ClearwayError: the run cannot be read, a scene is missing or not the one that the agent was trained on, or an
            agent cannot walk there.
    """
    settings: dict[str, Any] = {
        "episodes_per_target": as_whole("episodes", episodes, 1),
        "step_limit": as_whole("step_limit", step_limit, 1),
        "seed": as_seed("seed", seed),
        "show_progress": show_progress,
    }
    others = _makers(beside)
    found = None if scenes is None else load_scenes(scenes)
    if isinstance(agent, str | os.PathLike) and is_exported(as_path("agent", agent)):
        agent = open_agent(as_path("agent", agent))
    if not isinstance(agent, TrainedAgent | TrainResult | str | os.PathLike):
        return _own(agent, found, targets, others, settings)
    held_out = isinstance(targets, str) and targets == HELD_OUT
    if targets is not None and not held_out:
        problem = "targets: a run has its own. Leave them out"
        raise ArgumentError(f"{problem}, give {HELD_OUT!r}, or an agent without a run")
    trained = _trained(agent)
    if found is None and isinstance(agent, TrainResult):
        found = list(agent.scenes)
    places = load.run_scenes(trained.record, found)
    chosen = chosen_targets(places, HELD_OUT, settings["seed"]) if held_out else None
    evaluations = evaluate_run(trained, places, beside=others, targets=chosen, **settings)
    return EvaluateResult(trained, tuple(evaluations), tuple(places), held_out)


def _own(
    agent: object,
    scenes: list[Scene] | None,
    targets: Targets,
    beside: Mapping[str, AgentMaker],
    settings: Mapping[str, Any],
) -> EvaluateResult:
    """The evaluation of an agent that has no run."""
    made = isinstance(agent, Agent) and not isinstance(agent, type)
    if not made and not callable(agent):
        problem = f"agent={agent!r:.80}: expected a run folder, an .onnx file, what train returned, or an agent"
        raise ArgumentError(f"{problem}. Give one of these")
    if scenes is None:
        raise ArgumentError("scenes: none given, and the agent has no run that names them. Give scenes (--scenes FILE)")
    card = getattr(agent, "card", None)
    if isinstance(card, Card):
        _check_fits(card, scenes)
        targets = _targets_of(card) if targets is None else targets
    world = make_world(scenes, chosen_targets(scenes, targets, settings["seed"]))
    own = named_maker(AGENT, (lambda world: agent) if made else agent)(world)
    name = card.scene if isinstance(card, Card) else getattr(agent, "__name__", type(agent).__name__)
    with torch_threads(1):
        evaluations = evaluate_agents(
            world,
            {name: own},
            references={name: make(world) for name, make in beside.items()},
            scenes=scenes,
            selections=get_args(ActionSelection) if isinstance(card, Card) else ("sampled",),
            encoder=encoder_names(scenes),
            **settings,
        )
    walked = own.agent if isinstance(own, Foreign) else own
    return EvaluateResult(walked, tuple(evaluations), tuple(scenes), isinstance(targets, str) and targets == HELD_OUT)


def _check_fits(card: Card, scenes: Sequence[Scene]) -> None:
    """Raise ArgumentError where an exported agent is for another scene, or sees features that the scene does not have.

    Features may be those of a file that does not say what made them; then their number has to do.
    """
    if card.kind == GENERALIST:
        raise ArgumentError("agent: is for any room, without targets of its own. Give it goals (evaluate --goals)")
    if [scene.name for scene in scenes] != [card.scene]:
        given = ", ".join(scene.name for scene in scenes)
        raise ArgumentError(f"scenes: the agent is for scene {card.scene}, given {given}. Give that scene alone")
    scene = scenes[0]
    if card.takes_pictures or scene.features is None:
        return
    wanted, found = card.encoder, scene.encoder
    other = found is not None and found.identity != wanted.get("identity")
    if other or scene.features.shape[1] != card.feature_count:
        given = f"{scene.features.shape[1]} features of {scene.encoder_name}{f' ({found.identity})' if found else ''}"
        expected = f"{card.feature_count} of {wanted.get('name')} ({wanted.get('identity')})"
        problem = f"scenes: scene {scene.name} has {given}, the agent sees {expected}"
        raise ArgumentError(f"{problem}. Encode the scene as for training, or use an agent exported with its encoder")


def _targets_of(card: Card) -> Targets:
    """The targets that an exported agent was trained on; None where its file does not say."""
    kept = card.training.get("targets")
    return {card.scene: kept} if isinstance(kept, list) else None


def _makers(beside: Mapping[str, str | AgentMaker] | Iterable[str]) -> dict[str, AgentMaker]:
    """What makes the agents to compare with, by the name they have in tables."""
    if isinstance(beside, str) or not isinstance(beside, Iterable):
        raise ArgumentError(f"beside={beside!r:.80}: expected names of agents. Give a list of them")
    if not isinstance(beside, Mapping):
        beside = tuple(beside)
        if others := [name for name in beside if not isinstance(name, str)]:
            raise ArgumentError(
                f"beside: holds {others[0]!r:.80}, expected names of agents. Give makers by their names"
            )
    named = beside if isinstance(beside, Mapping) else {name: name for name in beside}
    return {str(name): _maker(str(name), one) for name, one in named.items()}


def _maker(name: str, one: object) -> AgentMaker:
    return agent_maker(one) if isinstance(one, str) else named_maker(f"beside[{name!r}]", one)


def _trained(run: Run) -> TrainedAgent:
    if isinstance(run, TrainedAgent):
        return run
    if isinstance(run, TrainResult):
        return run.agent
    return load_agent(run)
