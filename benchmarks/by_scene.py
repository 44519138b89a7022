"""Figures of agents by scene, and intervals of their means.

Scenes are drawn anew, 2,000 times (Efron & Tibshirani 1993).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from clearway.evaluation.bootstrap import RESAMPLES, intervals
from clearway.evaluation.goals import GoalEvaluation
from clearway.experiments.correction import holm

SHOWN = ("success", "success_4x", "spl", "collisions", "steps", "false_arrivals", "missed_arrivals", "success_stopped")
COUNTS = ("collisions", "steps")


def column(evaluation: GoalEvaluation, name: str) -> np.ndarray:
    """(scenes,) a figure of each scene; NaN where there is none."""
    values = [getattr(figures, name) for figures in evaluation.scenes.values()]
    return np.array([np.nan if value is None else value for value in values], float)


def interval(values: np.ndarray) -> tuple[float, float]:
    """Of the mean over scenes, 95 %."""
    drawn = np.random.default_rng(0).integers(len(values), size=(RESAMPLES, len(values)))
    low, high = intervals(np.nanmean(values[drawn], axis=1))
    return float(low), float(high)


def p_of_mean(values: np.ndarray) -> float:
    """Two-sided p of a mean over scenes (scenes,) that is zero: twice the share of redrawn means on its other side."""
    drawn = np.random.default_rng(0).integers(len(values), size=(RESAMPLES, len(values)))
    means = values[drawn].mean(axis=1)
    return min(1.0, 2 * (1 + min(int((means <= 0).sum()), int((means >= 0).sum()))) / (RESAMPLES + 1))


def shown(name: str, values: np.ndarray) -> str:
    """Mean and interval."""
    if np.isnan(values).all():
        return ""
    low, high = interval(values)
    if name in COUNTS:
        return f"{np.nanmean(values):.2f} ({low:.2f} to {high:.2f})"
    return f"{100 * np.nanmean(values):.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def print_table(found: Mapping[str, GoalEvaluation]) -> None:
    """A line an agent."""
    print("| " + " | ".join(("agent", *SHOWN)) + " |\n|" + "---|" * (len(SHOWN) + 1))
    for name, evaluation in found.items():
        print("| " + " | ".join((name, *(shown(figure, column(evaluation, figure)) for figure in SHOWN))) + " |")
    first = next(iter(found.values()))
    tour = f"; tour: {first.tour}" if first.tour else ""
    print(f"\n{first.average.episodes} episodes in {len(first.scenes)} scenes{tour}")


def print_difference(one: GoalEvaluation, other: GoalEvaluation, name: str, what: str) -> None:
    """By how much a figure of one is higher than that of the other, scene by scene."""
    print(f"{what}: {shown(name, column(one, name) - column(other, name))}")


def print_higher(one: GoalEvaluation, others: Mapping[str, GoalEvaluation], name: str) -> None:
    """Claims that a figure of one is higher than that of each of the others; p is corrected for all of them (Holm)."""
    ps = [p_of_mean(column(one, name) - column(other, name)) for other in others.values()]
    for (told, other), p in zip(others.items(), holm(ps), strict=True):
        print_difference(one, other, name, f"{name} higher than {told}, p = {p:.2g} (Holm, {len(ps)} claims)")


def write_record(path: Path, about: Mapping[str, Any], found: Mapping[str, GoalEvaluation]) -> None:
    """Write figures of every scene, by agent, beside what is to be said about all of them."""
    path.write_text(json.dumps({**about, **{name: one.to_json() for name, one in found.items()}}) + "\n")
