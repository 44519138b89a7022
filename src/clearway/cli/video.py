"""`clearway video`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from clearway.cli.arguments import check_at_least, check_seeds, scene_files
from clearway.cli.console import say


@dataclass(frozen=True)
class Video:
    """Film an episode of a trained agent: its view, the target, the map, and what it thinks of each action.

    Example: clearway video runs/bathroom --out episode.mp4
    """

    folder: Annotated[Path, tyro.conf.Positional]
    """The run folder."""
    scene: str | None = None
    """Name of the scene; by default the first."""
    target: int | None = None
    """State of the target in the scene's numbering, trained on or not; by default the first one trained on."""
    out: Path = Path("episode.mp4")
    """The film: .mp4 or .gif."""
    seed: int = 0
    """Of start and actions."""
    selection: Literal["sampled", "argmax", "argmax-untried"] = "sampled"
    """How actions are chosen."""
    most_steps: int = 200
    """The film ends after so many steps."""
    frames_per_s: int = 3
    """Steps a second."""
    scenes: tuple[Path, ...] = ()
    """Scene files or folders, where they are no longer where they were at training."""

    def run(self) -> None:
        """Walk the episode and write the film."""
        from clearway.evaluation.single import single_episode
        from clearway.learn.load import load_agent, run_scenes
        from clearway.viz.video import frames, walked, write_video

        check_at_least(1, most_steps=self.most_steps, frames_per_s=self.frames_per_s)
        check_seeds(seed=self.seed)
        agent = load_agent(self.folder)
        scenes = run_scenes(agent.record, scene_files(self.scenes) if self.scenes else None)
        world, trajectory = single_episode(
            agent, scenes, self.scene, self.target, selection=self.selection, step_limit=self.most_steps, seed=self.seed
        )
        shown = walked(world, agent.on_poses(world), 0, trajectory)
        write_video(self.out, frames(scenes, shown), self.frames_per_s)
        say(f"film: {self.out}, {len(trajectory.actions)} steps")
