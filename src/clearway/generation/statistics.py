"""A plan in figures, from its cells alone, so that drawn plans and real ones are measured alike.

On a grid of 0.5 m, where a wall begins 0.35 m from the middle of the cell before it, a pose's view is blank (something
nearer than 0.6 m ahead) exactly where the cell ahead cannot be entered.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from clearway.scenes import graph as graphs
from clearway.scenes.actions import BLOCKED, Action
from clearway.scenes.floor_plans import FloorPlan
from clearway.scenes.grid import HEADING_COUNT
from clearway.scenes.plan_scenes import plan_poses


@dataclass(frozen=True)
class PlanStatistics:
    """A plan in figures.

    Attributes:
        cells: that can be entered.
        blocked_share: of the smallest rectangle around them, what cannot be entered.
        dead_ends: cells with one way out at most.
        mean_path_steps: mean shortest path over ordered pairs of distinct poses, turns included.
        longest_path_steps: longest of these.
        blank_share: poses that look at something nearer than 0.6 m.
        parts: connected parts; figures of paths leave out pairs of different parts.
    """

    cells: int
    blocked_share: float
    dead_ends: int
    mean_path_steps: float
    longest_path_steps: int
    blank_share: float
    parts: int

    def to_json(self) -> dict[str, float]:
        """As JSON values."""
        return asdict(self)


FIGURES = ("cells", "blocked_share", "dead_ends", "mean_path_steps", "longest_path_steps", "blank_share")
"""What is published beside real plans."""


def plan_statistics(plan: FloorPlan) -> PlanStatistics:
    """The figures of a plan whose cells are 0.5 m."""
    _, _, graph = plan_poses(plan)
    extent = np.ptp(plan.cells, axis=0) + 1
    open_ahead = graph[:, Action.MOVE_FORWARD] != BLOCKED  # (S,)
    ways = open_ahead.reshape(-1, HEADING_COUNT).sum(axis=1)  # (C,)
    steps = graphs.distances(graph)
    between = steps[steps > 0]
    return PlanStatistics(
        cells=len(plan.cells),
        blocked_share=float(1 - len(plan.cells) / extent.prod()),
        dead_ends=int((ways <= 1).sum()),
        mean_path_steps=float(between.mean()) if len(between) else 0.0,
        longest_path_steps=int(steps.max()),
        blank_share=float((~open_ahead).mean()),
        parts=int(graphs.components(graph).max()) + 1,
    )
