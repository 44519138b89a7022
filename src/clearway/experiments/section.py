"""What an experiment comes to, as data: tables, figures and verdicts, for every form of the report alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from clearway.evaluation.across_seeds import Estimate

Verdict = Literal["holds", "does not hold", "undecided"]
Value = str | int | float | None


def _plain(value: Value) -> Value:
    """A number of NumPy's as one of Python's."""
    return value.item() if isinstance(value, np.generic) else value


@dataclass(frozen=True)
class ReportTable:
    """A table.

    Attributes:
        name: of its CSV file.
        title: above it.
        headings: of the columns.
        rows: as many values each; None where there is none yet.
        notes: below it.
        folded: in the page it shows when asked for.
    """

    name: str
    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[Value, ...], ...]
    notes: tuple[str, ...] = ()
    folded: bool = False

    def __post_init__(self) -> None:
        """Every row must fit the headings; NumPy's numbers become Python's."""
        object.__setattr__(self, "rows", tuple(tuple(map(_plain, row)) for row in self.rows))
        assert all(len(row) == len(self.headings) for row in self.rows), f"{self.name}: a row of another length"


@dataclass(frozen=True)
class Series:
    """A line or a set of points.

    Attributes:
        label: in the legend.
        x, y: of the points.
        low, high: around y, where there is an interval.
        points: without a line between them.
        highlighted: points that stand out.
    """

    label: str
    x: Sequence[float]
    y: Sequence[float]
    low: Sequence[float] | None = None
    high: Sequence[float] | None = None
    points: bool = False
    highlighted: bool = False

    def __post_init__(self) -> None:
        """NumPy's numbers become Python's."""
        for name in ("x", "y", "low", "high"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, tuple(map(_plain, getattr(self, name))))


@dataclass(frozen=True)
class ReportFigure:
    """A figure whose series share the axes.

    Attributes:
        name: of its file.
        title: above it.
        x_label, y_label: of the axes.
        series: lines and points.
        linear_below: beyond it the vertical axis is logarithmic; None: nowhere.
        band: what the bands or bars around the lines are; empty where there are none.
    """

    name: str
    title: str
    x_label: str
    y_label: str
    series: tuple[Series, ...]
    linear_below: float | None = None
    band: str = ""


@dataclass(frozen=True)
class ReportMap:
    """A scene from above with the ways that agents took to one target; states in the scene's own numbering.

    Attributes:
        name: of its file.
        title: above it.
        scene: its name.
        target: state.
        walks: states one after another, by the agent's name.
    """

    name: str
    title: str
    scene: str
    target: int
    walks: Mapping[str, tuple[int, ...]]


@dataclass(frozen=True)
class Claim:
    """A claim, and what was found.

    Attributes:
        text: the claim.
        verdict, evidence: for people.
        numbers: the evidence by name, for programs.
        further: the paper does not ask this.
        p: that chance alone tells the two kinds apart as much; None where too few runs decide nothing, and of what is
            counted.
        counted: of runs enough, by counting them, not by an estimate.
    """

    text: str
    verdict: Verdict
    evidence: str
    numbers: Mapping[str, Estimate] = field(default_factory=dict)
    further: bool = False
    p: float | None = None
    counted: bool = False

    @property
    def learner(self) -> str:
        """Whom it is of: what stands before a colon; empty where there is none."""
        learner, colon, _ = self.text.partition(": ")
        return learner if colon else ""

    @property
    def told(self) -> str:
        """The text without its learner."""
        return self.text.removeprefix(f"{self.learner}: ")

    @property
    def judged(self) -> bool:
        """It rests on runs enough; without, the verdict is undecided."""
        return self.counted or self.p is not None


@dataclass(frozen=True)
class Section:
    """An experiment's part of the report.

    Attributes:
        name: as on the command line.
        title: of the section.
        text: what was done, in a few sentences.
        tables, figures, maps, claims: what came of it.
        missing: runs that are not complete, by name; `clearway reproduce` fills it in from the jobs, of which there may
            be fewer: a section that has none to offer names them itself.
        unjudged: why its claims are not judged where they are not, in words that end a sentence; empty: runs of a kind
            are too few.
    """

    name: str
    title: str
    text: str
    tables: tuple[ReportTable, ...] = ()
    figures: tuple[ReportFigure, ...] = ()
    maps: tuple[ReportMap, ...] = ()
    claims: tuple[Claim, ...] = ()
    missing: tuple[str, ...] = ()
    unjudged: str = ""

    @property
    def pictures(self) -> tuple[ReportFigure | ReportMap, ...]:
        """Figures, then maps."""
        return (*self.figures, *self.maps)
