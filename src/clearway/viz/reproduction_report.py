"""The report of a reproduction: its sections, with what they were made of and how far they go."""

from __future__ import annotations

from pathlib import Path

from clearway.experiments.provenance import made_by
from clearway.experiments.reproduce import Reproduction
from clearway.experiments.setting import ABOUT_LEARNERS
from clearway.viz.report import write_report

TITLE = "The paper's experiments, redone"


def write_reproduction(found: Reproduction, title: str = TITLE) -> Path:
    """Write all forms of the report into the reproduction's folder and give back the page's path.

    On top stands what it has less of than the paper; at the end how it was made: commands, scenes, seeds, learners,
    versions and machines.
    """
    setting, budget = found.setting, found.setting.budget
    learners = (
        f"{name}: {ABOUT_LEARNERS[name]}{', changed' * bool(found.changes)}, {learner.frames:,} frames"
        for name, learner in setting.learners.items()
    )
    changed = f"Changed in every learner compared: {', '.join(found.changes)}." if found.changes else ""
    warning = " ".join(filter(None, (budget.warning(len(setting.scenes)), changed)))
    facts = {
        "commands": "; ".join(found.commands) or "a program",
        "scenes": ", ".join(f"{scene.name} ({scene.state_count} poses)" for scene in setting.scenes),
        "features": setting.encoder,
        "seeds": ", ".join(map(str, setting.seeds)),
        "on the grid": (
            f"{budget.episodes_per_target} episodes a target, at most {budget.step_limit:,} steps where a section does "
            "not say otherwise"
        ),
        "learners": "; ".join(learners),
        **made_by(setting.out, found.jobs),
    }
    return write_report(setting.out, title, found.sections, facts, warning, setting.scenes)
