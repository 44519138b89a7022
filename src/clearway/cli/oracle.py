"""`clearway oracle`."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from clearway.choices import ZoneLevel
from clearway.cli.arguments import check_finite, check_seeds, given_targets, scene_files
from clearway.cli.console import print_json, stdout_console
from clearway.cli.reward import RewardChoice, RewardParameters, chosen_reward
from clearway.errors import ClearwayError
from clearway.terminal import noted

if TYPE_CHECKING:
    from clearway.evaluation.optimum import TargetYardstick


@dataclass(frozen=True)
class Oracle:
    """Exact yardsticks without learning: shortest path, optimal policy and soft fixed point of each target.

    Example: clearway oracle bathroom.h5 --reward collision-aware --entropy 0.01
    """

    files: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Scene files, or folders of them."""
    targets: tuple[str, ...] = ()
    """Target states, as for clearway train."""
    reward: RewardChoice = "collision-aware"
    parameters: RewardParameters = field(default_factory=RewardParameters)
    clip: bool = True
    """Clip rewards to [-1, 1], so that the target is worth 1, as in Zhu's training loop."""
    zones: ZoneLevel = "pose"
    """Whether zones are those of poses or of whole cells."""
    entropy: float = 0.01
    """Entropy weight of the soft fixed point."""
    discount: float = 0.99
    """Discount of the reward."""
    seed: int = 0
    """Of the default targets."""
    json: bool = False
    """Print JSON."""

    def run(self) -> None:
        """Solve and print."""
        from clearway.api.targets import chosen_targets
        from clearway.evaluation.optimum import world_yardsticks
        from clearway.scenes.thor_v1 import read_scene
        from clearway.world.world import make_world

        check_seeds(seed=self.seed)
        check_finite(entropy=self.entropy)
        if not 0 < self.discount < 1:
            raise ClearwayError(f"--discount is {self.discount}, expected between 0 and 1. Give such a value")
        if not self.entropy > 0:
            raise ClearwayError(f"--entropy is {self.entropy}, expected more than 0. Give a positive weight")
        scenes = [replace(read_scene(path), features=None) for path in scene_files(self.files)]
        targets = chosen_targets(scenes, given_targets(self.targets, len(scenes)), self.seed)
        world = make_world(scenes, targets, self.zones)
        reward = chosen_reward(self.reward, self.parameters, self.clip)
        found = world_yardsticks(world, reward, discount=self.discount, entropy_weight=self.entropy)
        if self.json:
            print_json([one.to_json() for one in found])
        else:
            _print_table(found)


NOTE = (
    "Means over all starts. Steps: shortest path, optimal and soft policy; in zone: arrivals in the collision zone, of "
    "the policy to the left."
)


def _print_table(found: list[TargetYardstick]) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column("scene", overflow="fold")
    for heading in ("target", "shortest", "optimal", "in zone", "soft", "collisions", "in zone"):
        table.add_column(heading, justify="right", no_wrap=True)
    for one in found:
        optimal, soft = one.yardstick.optimal, one.yardstick.soft
        figures = (optimal.steps, optimal.collision_visits, soft.steps, soft.collisions, soft.collision_visits)
        steps = f"{one.yardstick.shortest_path_steps:.2f}"
        table.add_row(one.scene, str(one.target), steps, *(f"{figure:.3f}" for figure in figures))
    stdout_console().print(noted(table, [NOTE]))
