"""The figures that the paper reports (Gutiérrez-Maestro et al., its tables 1 to 3), to stand beside ours.

One run each, on four AI2-THOR scenes and ImageNet features; scenes are named by their kind.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

KINDS = ("bathroom", "bedroom", "living_room", "kitchen")
AVERAGE = "average"
THE_PAPER = "printed in the paper"


@dataclass(frozen=True)
class PaperRow:
    """One model of one of the paper's tables: steps and collisions by kind of room, and on average."""

    steps: dict[str, float]
    collisions: dict[str, float]

    def by_scene(self, metric: str, scenes: Sequence[str]) -> list[float | None]:
        """The paper's figures for scenes such as "kitchen_02" or "kitchen"; None where it has none."""
        values = self.steps if metric == "steps" else self.collisions
        return [next((values[kind] for kind in KINDS if scene.startswith(kind)), None) for scene in scenes]

    def average(self, metric: str, scenes: Sequence[str]) -> float | None:
        """The paper's own average where all of its scenes are among these, else the mean over those that are."""
        known = [value for value in self.by_scene(metric, scenes) if value is not None]
        kinds = {kind for scene in scenes for kind in KINDS if scene.startswith(kind)}
        if len(known) == len(kinds) == len(KINDS) == len(scenes):
            return (self.steps if metric == "steps" else self.collisions)[AVERAGE]
        return round(sum(known) / len(known), 4) if len(known) == len(scenes) else None


def reminder(original_scenes: bool, original_targets: bool = True) -> str:
    """What to keep in mind where the paper's figures stand beside others."""
    differ = [] if original_scenes else ["scenes", "features"]
    differ += [] if original_targets else ["targets"]
    *most, last = differ or [""]
    other = f" on other {', '.join(most)}{' and ' if most else ''}{last}" if differ else ""
    return f"The paper's figures are of single runs{other}" + ("; compare rewards, not rooms." if differ else ".")


def _row(steps: tuple[float, ...], collisions: tuple[float, ...]) -> PaperRow:
    names = (*KINDS, AVERAGE)
    return PaperRow(dict(zip(names, steps, strict=True)), dict(zip(names, collisions, strict=True)))


TABLE_1 = {
    "shortest": _row((7.17, 14.82, 15.2, 21.38, 14.7), (0.04, 0.12, 0.25, 0.2, 0.15)),
    "collision-aware": _row((7.33, 14.81, 14.9, 20.83, 14.47), (0.03, 0.04, 0.15, 0.12, 0.082)),
}
TABLE_2 = {
    "shortest": _row((7.43, 13.76, 1323.88, 19.17, 341.06), (0.06, 0.15, 247.78, 0.30, 62.07)),
    "collision-aware": _row((7.29, 14.63, 568.78, 18.89, 152.39), (0.03, 0.08, 61.66, 0.25, 15.5)),
}
TABLE_3 = {
    "shortest": _row((7.46, 13.92, 18.12, 18.03, 14.38), (0.04, 0.12, 0.2, 0.19, 0.14)),
    "collision-aware": _row((7.16, 14.15, 17.73, 17.86, 14.225), (0.01, 0.03, 0.05, 0.07, 0.04)),
}
FIGURE_5_AVERAGE_SC = {"shortest": 0.574, "collision-aware": 0.581}
"""Mean success score over unseen targets 1, 2, 4 and 8 steps away."""
