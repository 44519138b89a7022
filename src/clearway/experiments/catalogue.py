"""All experiments by name: what each needs, and what comes of it."""

from __future__ import annotations

from collections.abc import Collection

from clearway.errors import RunError
from clearway.experiments import (
    ablations,
    across_rooms,
    analysis,
    clipping,
    fig3,
    fig4,
    fig5,
    fig6,
    hard_tables,
    memory,
    off_grid,
    perturbed,
    quality,
    rewards,
    shuffles,
    step_size,
    table1,
    zone_levels,
    zone_time,
    zones_or_step,
)
from clearway.experiments.experiment import Experiment
from clearway.experiments.plugged import plugged_experiment
from clearway.plugins import find_plugin, unknown

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
    "quality": Experiment(quality.jobs, quality.section),
    "zones-or-step": Experiment(zones_or_step.jobs, zones_or_step.section),
    "shuffles": Experiment(shuffles.jobs, shuffles.section),
    "step-size": Experiment(step_size.jobs, step_size.section),
    "clipping": Experiment(clipping.jobs, clipping.section),
    "zone-time": Experiment(zone_time.jobs, zone_time.section),
    "zone-levels": Experiment(zone_levels.jobs, zone_levels.section),
    "ablations": Experiment(ablations.jobs, ablations.section),
    "across-rooms": Experiment(across_rooms.jobs, across_rooms.section),
    "perturbed": Experiment(perturbed.jobs, perturbed.section),
    "off-grid": Experiment(off_grid.jobs, off_grid.section),
    "rewards": Experiment(rewards.jobs, rewards.section),
}
"""Ours. A program may add its own, which it alone knows then; what a package offers, every command knows."""


def experiment(name: str) -> Experiment:
    """The experiment of that name: one of `EXPERIMENTS`, or another package's.

    Raises:
        RunError: there is none.
        PluginError: two packages offer one of this name, or it cannot be imported, or is no experiment.
    """
    if name in EXPERIMENTS:
        return EXPERIMENTS[name]
    plugin = find_plugin("experiments", name)
    if plugin is None:
        raise RunError(f"experiment {name!r:.40}: {unknown('experiments', name, EXPERIMENTS)}")
    return plugged_experiment(plugin)


def in_order(names: Collection[str]) -> list[str]:
    """Names of experiments as they stand in a report: ours as above, then those of packages by name."""
    return [*(name for name in EXPERIMENTS if name in names), *sorted({*names}.difference(EXPERIMENTS))]
