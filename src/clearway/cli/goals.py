"""`clearway evaluate --goals`: goals drawn anew in any scenes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING

from clearway.cli.arguments import scene_files
from clearway.cli.console import print_json, stdout_console
from clearway.errors import ClearwayError

if TYPE_CHECKING:
    from clearway.evaluation.goals import GoalEvaluation


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
    json: bool,
) -> None:
    """Walk to goals drawn in some scene files, and print what came of it."""
    from clearway.api.evaluation import load_agent
    from clearway.api.goals import evaluate_goals

    if not files:
        raise ClearwayError("--goals: no scenes. Name scene files behind the run")
    trained = load_agent(agent, checkpoint)
    found = evaluate_goals(
        trained,
        scene_files(files),
        goals=goals,
        step_limit=step_limit,
        seed=seed,
        perturb=perturb,
        takes=takes,
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

    from clearway.evaluation.goals import GoalFigures

    episodes = found[0].average.episodes
    title = f"{episodes} goals in {len(found[0].scenes)} scenes"
    if (perturbed := found[0].perturbed) is not None:
        title += f", pictures perturbed: {perturbed['label']}"
    table = Table(title=title, title_justify="left")
    table.add_column("agent")
    names = [field.name for field in fields(GoalFigures) if field.name != "episodes"]
    for name in names:
        table.add_column(name.replace("_", " "), justify="right")
    for one in found:
        figures = asdict(one.average)
        shares = ("success", "success_4x", "spl")
        cells = [f"{100 * figures[name]:.1f} %" if name in shares else f"{figures[name]:.3g}" for name in names]
        table.add_row(one.agent, *cells)
    return table
