"""Is an agent good enough? Its episodes against criteria of success, path length and collisions.

No mean hides a target: each must be solved, and the worst has a criterion of its own.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from clearway.evaluation import metrics
from clearway.world.world import World


@dataclass(frozen=True)
class Criteria:
    """What is asked of an agent, besides that it solves every target.

    Attributes:
        path_ratio: most steps of all targets together, as a multiple of the shortest path.
        worst_path_ratio: most steps of any single target, likewise.
        collisions: an episode has fewer than these on average.
    """

    path_ratio: float = 1.05
    worst_path_ratio: float = 1.15
    collisions: float = 0.05


@dataclass(frozen=True)
class Quality:
    """What an agent's episodes come to. A target is solved when all of them end at it in under 500 steps.

    Attributes:
        target_count, solved_targets: how many there are, and how many of them are solved.
        steps, shortest_path_steps, collisions: an episode's, means as in tables (over scenes of their targets' means).
        worst_path_ratio: largest ratio of a target's steps to those of the shortest paths.
        worst_scene, worst_target: that target, in its scene's own numbering.
    """

    target_count: int
    solved_targets: int
    steps: float
    shortest_path_steps: float
    collisions: float
    worst_path_ratio: float
    worst_scene: str
    worst_target: int

    @property
    def path_ratio(self) -> float:
        """Steps as a multiple of the shortest path."""
        return self.steps / self.shortest_path_steps

    def met(self, criteria: Criteria) -> dict[str, bool]:
        """Whether each criterion holds, by name; "all" of them together at the end."""
        held = {
            "solved_targets": self.solved_targets == self.target_count,
            "path_ratio": self.path_ratio <= criteria.path_ratio,
            "worst_path_ratio": self.worst_path_ratio <= criteria.worst_path_ratio,
            "collisions": self.collisions < criteria.collisions,
        }
        return {**held, "all": all(held.values())}

    def to_json(self) -> dict[str, object]:
        """All figures as JSON values."""
        return {**asdict(self), "path_ratio": self.path_ratio}


def quality(world: World, per_target: np.ndarray) -> Quality:
    """The quality that episodes show.

    Args:
        world: M targets.
        per_target: (M, J) their figures, as of `metrics.by_target`.
    """
    names = metrics.METRIC_NAMES
    mean = metrics.average(metrics.by_scene(per_target, world.target_scene.cpu().numpy()))
    average = dict(zip(names, mean.tolist(), strict=True))
    ratios = per_target[:, names.index("path_ratio")]
    worst = int(ratios.argmax())
    return Quality(
        target_count=world.target_count,
        solved_targets=int(np.sum(per_target[:, names.index("sc")] == 1)),
        steps=average["steps"],
        shortest_path_steps=average["shortest_path_steps"],
        collisions=average["collisions"],
        worst_path_ratio=float(ratios[worst]),
        worst_scene=world.scene_names[int(world.target_scene[worst])],
        worst_target=world.scene_state(worst),
    )
