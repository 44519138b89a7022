"""All experiments by name: what each needs, and what comes of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from clearway.experiments import (
    ablations,
    analysis,
    fig3,
    fig4,
    fig5,
    fig6,
    hard_tables,
    memory,
    off_grid,
    table1,
    zone_levels,
    zones_or_step,
)
from clearway.experiments.plan import Job
from clearway.experiments.section import Section
from clearway.experiments.setting import Setting


@dataclass(frozen=True)
class Experiment:
    """One table or figure of the paper, or an experiment of one's own.

    Attributes:
        jobs: what must be trained and tried.
        section: its part of the report, from what is complete.
    """

    jobs: Callable[[Setting], list[Job]]
    section: Callable[[Setting], Section]


EXPERIMENTS: dict[str, Experiment] = {
    "table1": Experiment(table1.jobs, table1.section),
    "fig3": Experiment(fig3.jobs, fig3.section),
    "fig4": Experiment(fig4.jobs, fig4.section),
    "table2": Experiment(hard_tables.TABLE2.jobs, hard_tables.TABLE2.section),
    "table3": Experiment(hard_tables.TABLE3.jobs, hard_tables.TABLE3.section),
    "fig5": Experiment(fig5.jobs, fig5.section),
    "fig6": Experiment(fig6.jobs, fig6.section),
    "analysis": Experiment(analysis.jobs, analysis.section),
    "memory": Experiment(memory.jobs, memory.section),
    "zones-or-step": Experiment(zones_or_step.jobs, zones_or_step.section),
    "zone-levels": Experiment(zone_levels.jobs, zone_levels.section),
    "ablations": Experiment(ablations.jobs, ablations.section),
    "off-grid": Experiment(off_grid.jobs, off_grid.section),
}
"""Those of the command line (`choices.ExperimentName`). A program may add its own, which it alone knows then."""
