"""A trained agent in a line."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from clearway.learn.load import TrainedAgent


def described(agent: TrainedAgent) -> str:
    """An agent in a line, without its tensors."""
    record = agent.record
    scenes = ", ".join(scene.name for scene in record.scenes[:3]) + (", ..." if len(record.scenes) > 3 else "")
    return f"<{type(agent).__name__}: {record.learner.algorithm}, {agent.frames:,} frames in {scenes}>"
