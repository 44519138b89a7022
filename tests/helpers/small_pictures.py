"""Pictures of runs drawn small, of short episodes, for tests that ask whether they are there and what they show."""

from __future__ import annotations

import pytest


def shrink_pictures(patch: pytest.MonkeyPatch) -> None:
    """Let figures and contact sheets be small, and the episodes that they show be chosen from few, short ones."""
    patch.setattr("clearway.viz.figures.DPI", 50)
    patch.setattr("clearway.viz.contact_sheet.VIEW_WIDTH_PX", 48)
    patch.setattr("clearway.evaluation.showcase.EPISODES", 4)
    patch.setattr("clearway.evaluation.showcase.STEP_LIMIT", 60)
