"""`clearway evaluate --goals`: goals drawn anew in any scenes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from clearway.cli.arguments import scene_files
from clearway.cli.console import print_json, stdout_console
from clearway.errors import ClearwayError

if TYPE_CHECKING:
    from clearway.evaluation.goals import GoalEvaluation

NUMBERS = ("collisions", "steps")  # figures that are no shares


def evaluate_at_goals(
    agent: Path,
    checkpoint: Path | None,
    files: Sequence[Path],
    *,
    goals: int,
    step_limit: int,
    seed: int,
    perturb: Sequence[str],
    takes: int,
    tour: int,
    json: bool,
) -> None:
    """Walk to goals drawn in some scene files, and print what came of it."""
    from clearway.api.goals import evaluate_goals, goal_agent

    if not files:
        raise ClearwayError("--goals: no scenes. Name scene files behind the run")
    found = evaluate_goals(
        goal_agent(agent, checkpoint),
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
    stdout_console().print(_table(found))


def _table(found: Sequence[GoalEvaluation]) -> object:
    """A row an agent: means over scenes."""
    from rich.table import Table

    from clearway.evaluation.goals import FIGURES

    episodes = found[0].average.episodes
    title = f"{episodes} goals in {len(found[0].scenes)} scenes"
    if (perturbed := found[0].perturbed) is not None:
        title += f", pictures perturbed: {perturbed['label']}"
    if (tour := found[0].tour) is not None:
        title += f", after tours of {tour['steps']} steps ({tour['collisions']:.3g} collisions each)"
    table = Table(title=title, title_justify="left")
    table.add_column("agent")
    names = [field.name for field in FIGURES if field.name != "episodes"]
    for name in names:
        table.add_column(name.replace("_", " "), justify="right")
    for one in found:
        table.add_row(one.agent, *(_cell(name, value) for name, value in asdict(one.average).items() if name in names))
    return table


def _cell(name: str, value: float | None) -> str:
    if value is None:
        return ""
    return f"{value:.3g}" if name in NUMBERS else f"{100 * value:.1f} %"
