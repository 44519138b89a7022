"""`clearway video`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from clearway.cli.arguments import check_at_least, check_seeds, scene_files
from clearway.cli.console import say
from clearway.cli.generate import chosen_room
from clearway.errors import ClearwayError


@dataclass(frozen=True)
class Video:
    """Film an episode of a trained agent: its view, the target, the map, and what it thinks of each action.

    Example: clearway video runs/bathroom --out episode.mp4
    """

    folder: Annotated[Path, tyro.conf.Positional]
    """The run folder; or generalist, which comes with clearway."""
    scene: str | None = None
    """Name of the scene, by default the first; of the generalist, a scene file with pictures."""
    room: int | None = None
    """Seed of a room for the generalist, made at once: kitchen, living room, bedroom and bathroom in turn."""
    target: int | None = None
    """State of the target in the scene's numbering, trained on or not; by default the first one trained on; of the
    generalist, the farthest from its start of 20 drawn by the seed."""
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
        from clearway.choices import is_generalist
        from clearway.evaluation.single import single_episode
        from clearway.learn.load import load_agent, run_scenes
        from clearway.viz.video import frames, walked, write_video

        check_at_least(1, most_steps=self.most_steps, frames_per_s=self.frames_per_s)
        check_seeds(seed=self.seed)
        if is_generalist(self.folder):
            self._generalist()
            return
        if self.room is not None:
            raise ClearwayError("--room: goes with the generalist, the only one that knows any room. Leave it out")
        agent = load_agent(self.folder)
        scenes = run_scenes(agent.record, scene_files(self.scenes) if self.scenes else None)
        world, trajectory = single_episode(
            agent, scenes, self.scene, self.target, selection=self.selection, step_limit=self.most_steps, seed=self.seed
        )
        shown = walked(world, agent.on_poses(world), 0, trajectory, scenes=scenes)
        write_video(self.out, frames(scenes, shown), self.frames_per_s)
        say(f"film: {self.out}, {len(trajectory.actions)} steps")

    def _generalist(self) -> None:
        from clearway.agents.generalist import Generalist
        from clearway.api.scenes import load_scene
        from clearway.evaluation.single import episode_in
        from clearway.mapping.held import Laid
        from clearway.viz.video import frames, walked, write_video

        if self.selection != "sampled" or self.scenes:
            option = "--scenes" if self.scenes else "--selection"
            raise ClearwayError(f"{option}: says nothing to the generalist. Leave it out")
        if self.room is not None and self.scene is not None:
            raise ClearwayError("--room makes a room, and --scene names one. Leave one of the two out")
        if self.room is None and self.scene is None:
            raise ClearwayError("the generalist walks in a scene. Give --scene FILE or --room SEED")
        found = load_scene(self.scene) if self.scene is not None else chosen_room(int(self.room or 0))
        generalist = Generalist.shipped().stepping([found])
        (scene,) = generalist.seen([found])
        make = generalist.on_poses
        world, trajectory = episode_in(scene, make, self.target, step_limit=self.most_steps, seed=self.seed)
        agent = make(world)
        laid = Laid.around(scene, int(trajectory.states[0]))
        shown = walked(world, agent, 0, trajectory, lambda state: agent.holds(state, laid))
        write_video(self.out, frames([scene], shown), self.frames_per_s)
        say(f"film: {self.out}, {len(trajectory.actions)} steps")
