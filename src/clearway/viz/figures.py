"""What all matplotlib figures share: how they are made, styled and saved. Matplotlib is imported on first use."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clearway import colours
from clearway.files import written_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.patheffects import AbstractPathEffect

Look = dict[str, Any]
"""Keyword arguments of matplotlib's artists."""

DPI = 160
STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.edgecolor": colours.FAINT_INK,
    "axes.labelcolor": colours.INK,
    "axes.linewidth": 0.8,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "text.color": colours.INK,
    "xtick.color": colours.FAINT_INK,
    "ytick.color": colours.FAINT_INK,
    "grid.color": "#e3e5e8",
    "grid.linewidth": 0.8,
    "hatch.linewidth": 0.7,
    "legend.frameon": False,
}


@dataclass(frozen=True)
class LineStyle:
    """How one agent or run is drawn: colours differ in lightness too, and the dashes differ without colour."""

    colour: str
    halo: str
    dashes: tuple[float, ...] = ()

    @property
    def pattern(self) -> Any:
        """Matplotlib's linestyle."""
        return (0, self.dashes) if self.dashes else "-"


LINES = (
    LineStyle("#0b3d91", "#ffffff"),
    LineStyle("#3ddc84", "#16351f", (5, 1.6)),
    LineStyle("#8e2c9c", "#ffffff", (1.2, 1.2)),
    LineStyle("#ffffff", "#22272e", (7, 2, 1.5, 2)),
)
"""Of the first, second, ... agent on a map."""

BY_REWARD = {"shortest": LINES[0], "collision-aware": LINES[1]}
"""Of the demo's and the example's agents, in their order; the viewer has the same (`view/page/looks.js`)."""

CURVES = (
    LineStyle("#0b3d91", "#ffffff"),
    LineStyle("#d55e00", "#ffffff", (5, 1.6)),
    LineStyle("#1b9e77", "#ffffff", (1.2, 1.2)),
    LineStyle("#8e2c9c", "#ffffff", (7, 2, 1.5, 2)),
    LineStyle("#7a6a00", "#ffffff", (3, 2)),
    LineStyle("#22272e", "#ffffff", (1, 3)),
    LineStyle("#56b4e9", "#ffffff", (10, 2)),
    LineStyle("#c2185b", "#ffffff", (4, 1.5, 1, 1.5, 1, 1.5)),
)
"""Of the first, second, ... run in a plot on white."""


def counted(count: int, noun: str) -> str:
    """For example "1 step" and "2 steps"."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def halo(colour: str, width_pt: float) -> list[AbstractPathEffect]:
    """What draws the halo of a line."""
    from matplotlib.patheffects import Normal, Stroke

    return [Stroke(linewidth=width_pt, foreground=colour), Normal()]


@contextmanager
def new_figure(width_in: float, height_in: float, path: Path) -> Iterator[Figure]:
    """A figure to draw on; saved to `path` as PNG, whole or not at all, when the block ends well."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(width_in, height_in), dpi=DPI, facecolor=colours.PAPER, layout="constrained")
        FigureCanvasAgg(figure)
        yield figure
        with written_whole(path) as part:
            figure.savefig(part, format="png")
