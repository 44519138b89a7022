"""The quality benchmark's table, verdict and picture."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from learning_curve import CRITERIA, CRITERION_NAMES, Curve

from clearway.viz.curves import Panel, draw_curves


def percent_above(path_ratio: float) -> float:
    """How much longer than the shortest path, %."""
    return 100 * (path_ratio - 1)


HEADINGS = (
    "seed",
    "solved",
    "steps",
    "× shortest",
    "worst target",
    "collisions (95 %)",
    "frames",
    "s",
    *(f"s to {what}" for what in ("solved", "steps", "worst", "collisions", "all")),
    "frames to all",
)


@dataclass(frozen=True)
class Reference:
    """An exact policy: steps and collisions an episode, means as in tables, over all starts."""

    name: str
    steps: float
    collisions: float
    path_ratio: float


def row(curve: Curve) -> list[str]:
    """A seed's line of the table."""
    found = curve.quality
    low, high = curve.evaluation.average.intervals["collisions"]
    first = {name: curve.first(name) for name in CRITERION_NAMES}
    return [
        str(curve.seed),
        f"{found.solved_targets}/{found.target_count}",
        f"{found.steps:.2f}",
        f"{found.path_ratio:.3f}",
        f"{found.worst_path_ratio:.3f} ({found.worst_scene} {found.worst_target})",
        f"{found.collisions:.4f} ({low:.4f}–{high:.4f})",
        f"{curve.frames:,}",
        f"{curve.seconds:.0f}",
        *(f"{check.seconds:.0f}" if check else "–" for check in first.values()),
        f"{first['all'].frames:,}" if first["all"] else "–",
    ]


def line(curve: Curve) -> str:
    """A seed's line while others are still training."""
    cells = dict(zip(HEADINGS, row(curve), strict=True))
    return "  ".join(f"{heading} {text}" for heading, text in cells.items())


def table(curves: Sequence[Curve], exact: Sequence[Reference]) -> str:
    """All seeds and the exact policies in Markdown."""
    lines = [HEADINGS, ["---"] * len(HEADINGS), *(row(curve) for curve in curves)]
    for one in exact:
        cells = [one.name, "", f"{one.steps:.2f}", f"{one.path_ratio:.3f}", "", f"{one.collisions:.4f}"]
        lines.append(cells + [""] * (len(HEADINGS) - len(cells)))
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def verdict(curves: Sequence[Curve]) -> str:
    """How many seeds meet all criteria at the end, and how soon they did."""
    met = sum(curve.quality.met(CRITERIA)["all"] for curve in curves)
    text = f"All criteria met at the end: {met} of {len(curves)} seeds."
    for name, what in (("solved_targets", "all targets solved"), ("all", "all criteria met")):
        seconds = sorted(check.seconds if (check := curve.first(name)) else float("inf") for curve in curves)
        middle = statistics.median(seconds)
        spread = f"{middle:.0f} s, median of {len(seconds)} seeds ({seconds[0]:.0f} to {seconds[-1]:.0f} s)"
        text += f" Until {what}: {spread if middle < float('inf') else 'not reached by most seeds'}."
    return text.replace("to inf s", "to never")


def draw_quality(curves: Sequence[Curve], path: Path, title: str) -> None:
    """The learning curves of all seeds over training time, the criteria as dashed lines."""
    panels = (
        Panel("solved_targets", "targets solved", from_zero=True, goal=curves[0].quality.target_count),
        Panel("excess", "steps above the shortest path, %", linear_below=1.0, goal=percent_above(CRITERIA.path_ratio)),
        Panel(
            "worst_excess", "of the worst target, %", linear_below=1.0, goal=percent_above(CRITERIA.worst_path_ratio)
        ),
        Panel("collisions", "collisions an episode", linear_below=0.01, goal=CRITERIA.collisions),
    )
    rows = {f"seed {curve.seed}": _curve_rows(curve) for curve in curves}
    draw_curves(rows, path, x="seconds", title=title, panels=panels)


def _curve_rows(curve: Curve) -> list[dict[str, float]]:
    """What the picture shows of a seed."""
    return [
        {
            "frames": check.frames,
            "seconds": check.seconds,
            "solved_targets": check.quality.solved_targets,
            "excess": percent_above(check.quality.path_ratio),
            "worst_excess": percent_above(check.quality.worst_path_ratio),
            "collisions": check.quality.collisions,
        }
        for check in curve.checks
    ]
