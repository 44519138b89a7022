"""`clearway evaluate`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from clearway.choices import GENERALIST, GOAL_STEPS, GOALS, HELD_OUT, PlanKind, SplitName, is_generalist
from clearway.cli.arguments import scene_files
from clearway.cli.console import print_json, say, say_held_out, stdout_console
from clearway.cli.live import EPISODES as LIVE_EPISODES
from clearway.cli.live import STEP_LIMIT as LIVE_STEP_LIMIT
from clearway.cli.live import Live, evaluate_live
from clearway.errors import ClearwayError

if TYPE_CHECKING:
    from clearway.api.evaluation import EvaluateResult

ROOMS = 10  # of --rooms where no --count is given


@dataclass(frozen=True)
class Evaluate:
    """Evaluate a trained agent by the paper's protocol, beside a random and a shortest-path agent; or off the grid.

    Example: clearway evaluate runs/bathroom
    """

    folder: Annotated[Path, tyro.conf.Positional]
    """The run folder; the .onnx file of an exported agent; or, with --goals or --live, generalist, which comes with
    clearway; with --goals also a file that it was exported to."""
    files: Annotated[tuple[Path, ...], tyro.conf.Positional] = ()
    """Scene files or folders, as --scenes; with --goals any scenes."""
    episodes: int | None = None
    """Episodes a target; by default 100, live 10."""
    step_limit: int | None = None
    """Steps after which an episode has failed; by default 10000, live 100."""
    seed: int = 0
    """Of starts and sampled actions."""
    scenes: tuple[Path, ...] = ()
    """Scene files or folders, where they are no longer where they were at training; of an .onnx file its scene's."""
    beside: tuple[str, ...] = ()
    """Further agents to compare with: names of plugins, or package.module:name."""
    checkpoint: Path | None = None
    """A checkpoint folder of the run; by default the newest."""
    targets: bool = False
    """Print a row for each target too."""
    all: bool = False
    """Print a row for each way of acting, and for the exact optima; by default for the agent, a random walk, shortest
    paths, and those of --beside. JSON and the files in the run folder hold all."""
    pictures: Path | None = None
    """Folder for maps with the paths of an episode, contact sheets and learning curves."""
    goals: int | None = None
    """Walk to so many goals a scene, drawn by the seed among all its poses, one episode of 500 steps each; the
    generalist and agents of the algorithm recurrent do in any scenes with pictures, the generalist with --live too
    (by default 20)."""
    perturb: tuple[str, ...] = ()
    """With --goals: what is seen on the way is perturbed, the goals' pictures are not. all; geometry: all but light and
    pixel-noise; none; names of the perturbations below, at full strength; or NAME=STRENGTH. A later word changes an
    earlier one."""
    takes: int | None = None
    """With --perturb: pictures of each pose, each perturbed in its own way, one of which a step shows; by default 4."""
    rooms: SplitName | None = None
    """Walk in the first generated rooms of this split, made once and kept in the user's cache folder, instead of scene
    files; 20 goals a room unless --goals says otherwise. Choose on validation; test is for what is published."""
    kind: PlanKind | None = None
    """With --rooms: room, the default, or flat."""
    count: int | None = None
    """With --rooms: so many of them; by default 10."""
    tour: int = 0
    """With --goals: steps in which an agent with a map may look around in each scene first; live under each setting."""
    held_out: bool = False
    """Evaluate at five targets a scene that trainings in generated rooms and flats leave out, and leave held-out.json
    and held-out.md, live held-out-live.json and held-out-live.md, in the run folder."""
    json: bool = False
    """Print JSON: the sampled agent's figures, and the other agents' under "others"."""
    room: Live = field(default_factory=Live)

    def run(self) -> None:
        """Evaluate, print, and leave evaluation.json and evaluation.md in the run folder, or live.json and live.md."""
        if self.rooms is None and (self.kind is not None or self.count is not None):
            option = "--kind" if self.kind is not None else "--count"
            raise ClearwayError(f"{option}: goes with --rooms alone. Add --rooms validation, or another split")
        if self.goals is not None or self.rooms is not None or is_generalist(self.folder):
            if self.room.live:
                self._at_goals_live()
            else:
                self._at_goals()
            return
        if self.perturb or self.takes is not None:
            option = "--perturb" if self.perturb else "--takes"
            raise ClearwayError(f"{option}: goes with --goals alone. Add it; --live has a flag for each perturbation")
        if self.tour:
            raise ClearwayError("--tour: goes with --goals alone. Add it")
        self.room.check()
        self._check_file()
        if self.held_out and self.pictures is not None and not self.room.live:
            raise ClearwayError("--pictures shows the targets of the training. Leave it or --held-out out")
        if not self.room.live:
            self._on_grid()
            return
        if self.beside:
            raise ClearwayError("--beside walks on the grid. Leave it out with --live, or use --against")
        if self.targets:
            raise ClearwayError("--targets prints rows of the evaluation on the grid. Leave it out with --live")
        evaluate_live(
            self.folder,
            self.checkpoint,
            self.files + self.scenes,
            self.room,
            episodes=_or(self.episodes, LIVE_EPISODES),
            step_limit=_or(self.step_limit, LIVE_STEP_LIMIT),
            seed=self.seed,
            pictures=self.pictures,
            held_out=self.held_out,
            json=self.json,
        )

    def _at_goals(self) -> None:
        from clearway.api.arguments import as_whole
        from clearway.api.goals import goal_agent
        from clearway.api.perturbations import perturbations_asked
        from clearway.cli.goals import check_knows_any_room, evaluate_at_goals
        from clearway.views.seen import TAKES

        self._check_goals_alone(self.room.given())
        if self.takes is not None and not self.perturb:
            raise ClearwayError("--takes: without --perturb a pose has one picture. Add --perturb")
        goals = as_whole("goals", _or(self.goals, GOALS), 1)
        agent, perturbations = goal_agent(self.folder, self.checkpoint), perturbations_asked(self.perturb)
        if self.rooms is not None:
            check_knows_any_room(agent)
        evaluate_at_goals(
            agent,
            self._scenes_of_goals(),  # made last, which may take long
            goals=goals,
            step_limit=_or(self.step_limit, GOAL_STEPS),
            seed=self.seed,
            perturb=perturbations,
            takes=_or(self.takes, TAKES),
            tour=self.tour,
            json=self.json,
        )

    def _at_goals_live(self) -> None:
        from clearway.api.arguments import as_whole
        from clearway.api.goals import goal_agent
        from clearway.cli.goals import check_knows_any_room, evaluate_at_goals_live

        self.room.check()
        given = {
            "--against": self.room.against,
            "--selection": self.room.selection != Live().selection,
            "--checkpoint": self.checkpoint,
        }
        self._check_goals_alone(given)
        if self.perturb or self.takes is not None:
            option = "--perturb" if self.perturb else "--takes"
            raise ClearwayError(f"{option}: walks on the grid. Leave it out: --live has a flag for each perturbation")
        goals, agent = as_whole("goals", _or(self.goals, GOALS), 1), goal_agent(self.folder)
        if self.rooms is not None:
            check_knows_any_room(agent)
        evaluate_at_goals_live(
            agent,
            self._scenes_of_goals(),  # made last, which may take long
            self.room,
            goals=goals,
            step_limit=_or(self.step_limit, GOAL_STEPS),
            seed=self.seed,
            tour=self.tour,
            json=self.json,
        )

    def _scenes_of_goals(self) -> tuple[Path, ...]:
        """The scene files given, or the generated rooms asked for."""
        from clearway.cli.goals import generated

        files = self.files + self.scenes
        if self.rooms is None:
            return files
        if files:
            raise ClearwayError(f"--rooms: makes rooms of its own, and {files[0]} is given too. Leave one out")
        return tuple(generated(self.rooms, self.kind or "room", _or(self.count, ROOMS)))

    def _check_goals_alone(self, further: Mapping[str, object]) -> None:
        """Raise ClearwayError where an option is given that does not go with goals."""
        given = {
            **further,
            "--beside": self.beside,
            "--targets": self.targets,
            "--pictures": self.pictures,
            "--held-out": self.held_out,
            "--episodes": self.episodes,
        }
        if asked := [option for option, value in given.items() if value]:
            option = "--goals" if self.goals is not None else "--rooms" if self.rooms is not None else GENERALIST
            raise ClearwayError(
                f"{asked[0]}: not with {option}, which walks once to each goal. Leave one of the two out"
            )

    def _check_file(self) -> None:
        """Raise ClearwayError where an exported agent is given with what a run folder alone can do."""
        needs_run = {"--live": self.room.live, "--checkpoint": self.checkpoint, "--pictures": self.pictures}
        asked = [option for option, given in needs_run.items() if given]
        if asked:
            from clearway.api.evaluation import is_exported

            if is_exported(self.folder):
                raise ClearwayError(f"{asked[0]}: needs a run folder, and {self.folder} is a file. Leave it out")

    def _on_grid(self) -> None:
        from clearway.api.evaluation import evaluate, is_exported, load_agent
        from clearway.evaluation.episodes import EPISODES_PER_TARGET, STEP_LIMIT

        episodes, step_limit = _or(self.episodes, EPISODES_PER_TARGET), _or(self.step_limit, STEP_LIMIT)
        files = scene_files(self.files + self.scenes) if self.files + self.scenes else None
        exported = is_exported(self.folder)
        agent = self.folder if exported else load_agent(self.folder, self.checkpoint)
        result = evaluate(
            agent,
            files,
            targets=HELD_OUT if self.held_out else None,
            beside=self.beside,
            show_progress=True,
            episodes=episodes,
            step_limit=step_limit,
            seed=self.seed,
        )
        if self.held_out:
            say_held_out(_targets_of(result))
        if not exported:
            result.save(self.folder)
        if self.pictures:
            from clearway.viz.run_pictures import draw_run_pictures

            trained = load_agent(self.folder, self.checkpoint)
            draw_run_pictures(self.folder, trained, result.scenes, self.pictures, seed=self.seed)
            say(f"pictures: {self.pictures}")
        if self.json:
            print_json(result.to_json())
            return
        from clearway.evaluation.tables import Level, rich_tables

        levels: list[Level] = ["targets"] if self.targets else []
        levels += ["scenes", "average"] if len(result.scenes) > 1 else ["average"]
        stdout_console().print(rich_tables(result.evaluations, levels, every=self.all))


def _targets_of(result: EvaluateResult) -> dict[str, list[int]]:
    found: dict[str, list[int]] = {}
    for target in result.evaluations[0].targets:
        assert target.target is not None, "a row a target"
        found.setdefault(target.scene, []).append(target.target)
    return found


def _or(given: int | None, default: int) -> int:
    """What was given, else the default."""
    return default if given is None else given
