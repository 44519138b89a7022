"""`clearway evaluate --goals`: goals drawn anew in any scenes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from clearway.choices import GENERALIST
from clearway.cli.arguments import scene_files
from clearway.cli.console import print_json, stdout_console
from clearway.cli.live import Live, status_line
from clearway.errors import ClearwayError

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table

    from clearway.agents.generalist import Generalist
    from clearway.choices import PlanKind, SplitName
    from clearway.evaluation.goals import GoalEvaluation
    from clearway.learn.load import TrainedAgent
    from clearway.live.conditions import Perturbations

NUMBERS = ("collisions", "steps")  # figures that are no shares
SETTING_WIDTH = 16
HEADINGS = {
    "success_4x": "within\n4 x",
    "spl": "SPL",
    "false_arrivals": "false\narrivals",
    "missed_arrivals": "missed\narrivals",
    "success_stopped": "success\nstopped",
}


def evaluate_at_goals(
    agent: TrainedAgent | Generalist,
    files: Sequence[Path],
    *,
    goals: int,
    step_limit: int,
    seed: int,
    perturb: Perturbations,
    takes: int,
    tour: int,
    json: bool,
) -> None:
    """Walk to goals drawn in some scene files, and print what came of it."""
    from clearway.api.goals import evaluate_goals

    if not files:
        raise ClearwayError("no scenes to walk in. Name scene files behind the agent, or give --rooms validation")
    found = evaluate_goals(
        agent,
        scene_files(files),
        goals=goals,
        step_limit=step_limit,
        seed=seed,
        perturb=perturb,
        takes=takes,
        tour=tour,
        show_progress=True,
    )
    if json:
        own, *others = (one.to_json() for one in found)
        print_json({**own, "others": others})
        return
    stdout_console().print(_explained(_table(found), step_limit, seed))


def check_knows_any_room(agent: object) -> None:
    """Raise ClearwayError where an agent walks in the scenes of its training alone, and rooms would be made for it."""
    from clearway.learn.foreign_agent import goes_anywhere
    from clearway.learn.load import TrainedAgent

    if isinstance(agent, TrainedAgent) and not goes_anywhere(agent):
        problem = f"--rooms: an agent of the algorithm {agent.record.learner.algorithm} walks in its own alone"
        raise ClearwayError(f"{problem}. Leave it out, or evaluate {GENERALIST}")


def generated(split: SplitName, kind: PlanKind, count: int) -> list[Path]:
    """The files of the first so many rooms or flats of a split, made and kept in the user's cache folder."""
    from clearway.api.generation import generate

    return generate(kind, count, split=split, encoder="none", show_progress=True)


def evaluate_at_goals_live(
    agent: TrainedAgent | Generalist,
    files: Sequence[Path],
    options: Live,
    *,
    goals: int,
    step_limit: int,
    seed: int,
    tour: int,
    json: bool,
) -> None:
    """Walk off the grid to goals drawn in some scene files, and print what came of it under each setting."""
    from clearway.api.live import evaluate_live

    if not files:
        raise ClearwayError("no scenes to walk in. Name scene files behind the agent, or give --rooms validation")
    with status_line() as show:
        found = evaluate_live(
            agent,
            scene_files(files),
            goals=goals,
            step_limit=step_limit,
            seed=seed,
            perturb=options.perturbations,
            sweep=options.strengths if options.sweep else (),
            tour=tour,
            show=show,
        )
    if json:
        print_json({"results": [one.to_json() for one in found]})
        return
    stdout_console().print(_explained(_live_table(found), step_limit, seed))


def _live_table(found: Sequence[GoalEvaluation]) -> Table:
    """A row a setting: means over scenes, and success as a share of that of the first one."""
    average = found[0].average
    title = f"{found[0].agent} off the grid: {_counted(found[0])}"
    if (tour := found[0].tour) is not None:
        title += f", after tours of {tour['steps']} steps"
    names = [name for name, value in asdict(average).items() if name != "episodes" and value is not None]
    table = _empty(title, "", names, HEADINGS | {"collisions": "contacts"})
    if len(found) > 1:
        table.add_column("of\nfirst", justify="right")
    for one in found:
        told = asdict(one.average)
        cells = [_cell(name, told[name]) for name in names]
        if len(found) > 1:
            cells.append(_cell("", told["success"] / average.success if average.success else None))
        table.add_row(str((one.perturbed or {})["label"]), *cells)
    return table


def _table(found: Sequence[GoalEvaluation]) -> Table:
    """A row an agent: means over scenes."""
    from clearway.evaluation.goals import FIGURES

    title = _counted(found[0])
    if (perturbed := found[0].perturbed) is not None:
        title += f", pictures perturbed: {perturbed['label']}"
    if (tour := found[0].tour) is not None:
        title += f", after tours of {tour['steps']} steps ({tour['collisions']:.3g} collisions each)"
    names = [field.name for field in FIGURES if field.name != "episodes"]
    table = _empty(title, "agent", names, HEADINGS)
    for one in found:
        table.add_row(one.agent, *(_cell(name, value) for name, value in asdict(one.average).items() if name in names))
    return table


def _counted(found: GoalEvaluation) -> str:
    goals, scenes = found.average.episodes, len(found.scenes)
    return f"{goals} goal{'s' * (goals > 1)} in {scenes} scene{'s' * (scenes > 1)}"


def _explained(table: Table, step_limit: int, seed: int) -> Group:
    """The table, and what its figures mean; fits 80 columns whole."""
    from clearway.terminal import noted

    notes = (
        f"One episode a goal from a random start, at most {step_limit:,} steps, seed {seed}.",
        "Means over scenes. Within 4 x: in at most four times the shortest path's steps.",
        "SPL: success weighted by path length. False arrivals: episodes in which it said",
        "to be there elsewhere; missed: in which it did not say so at the goal. Success",
        "stopped: were an episode to end where it first says to be there.",
    )
    return noted(table, notes)


def _empty(title: str, first: str, names: Sequence[str], headings: dict[str, str]) -> Table:
    """A table without rows that fits 80 columns whole: what a row is, then figures."""
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0), pad_edge=False)
    table.add_column(first, min_width=SETTING_WIDTH, max_width=SETTING_WIDTH, overflow="fold")
    for name in names:
        table.add_column(headings.get(name, name), justify="right")
    return table


def _cell(name: str, value: float | None) -> str:
    if value is None:
        return ""
    return f"{value:.3g}" if name in NUMBERS else f"{100 * value:.1f} %"
