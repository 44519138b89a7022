"""`clearway evaluate`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from clearway.cli.arguments import check_at_least, check_seeds, scene_files
from clearway.cli.console import print_json, stderr_console


@dataclass(frozen=True)
class Evaluate:
    """Evaluate a trained agent by the paper's protocol, beside a random and a shortest-path agent.

    Example: clearway evaluate runs/bathroom
    """

    folder: Annotated[Path, tyro.conf.Positional]
    """The run folder."""
    episodes: int = 100
    """Episodes a target."""
    step_cap: int = 10_000
    """Steps after which an episode has failed."""
    seed: int = 0
    """Of starts and sampled actions."""
    scenes: tuple[Path, ...] = ()
    """Scene files or folders, where they are no longer where they were at training."""
    checkpoint: Path | None = None
    """A checkpoint folder of the run; by default the newest."""
    targets: bool = False
    """Print a row for each target too."""
    pictures: Path | None = None
    """Folder for maps with the paths of an episode, contact sheets and learning curves."""
    json: bool = False
    """Print JSON: the sampled agent's figures, and the other agents' under "others"."""

    def run(self) -> None:
        """Evaluate, print, and leave evaluation.json and evaluation.md in the run folder."""
        from clearway.evaluate.files import write_evaluations
        from clearway.evaluate.run import evaluate_run
        from clearway.learn.load import load_agent, run_scenes

        check_at_least(1, episodes=self.episodes, step_cap=self.step_cap)
        check_seeds(seed=self.seed)
        agent = load_agent(self.folder, self.checkpoint)
        scenes = run_scenes(agent.record, scene_files(self.scenes) if self.scenes else None)
        evaluations = evaluate_run(
            agent, scenes, episodes_per_target=self.episodes, step_cap=self.step_cap, seed=self.seed
        )
        first, *others = (evaluation.to_json() for evaluation in evaluations)
        content = {**first, "others": others}
        write_evaluations(self.folder, content, evaluations)
        if self.pictures:
            from clearway.viz.run_pictures import draw_run_pictures

            draw_run_pictures(self.folder, agent, scenes, self.pictures, seed=self.seed)
            stderr_console().print(f"pictures: {self.pictures}", highlight=False)
        if self.json:
            print_json(content)
            return
        from rich.console import Console

        from clearway.evaluate.tables import rich_table

        console = Console()
        if self.targets:
            console.print(rich_table(evaluations, "targets"))
        console.print(rich_table(evaluations, "scenes"))
        if len(scenes) > 1:
            console.print(rich_table(evaluations, "average"))
