"""How much of everything an experiment spends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from clearway.choices import BudgetName, RoomName
from clearway.evaluation.episodes import EPISODES_PER_TARGET, STEP_LIMIT
from clearway.rooms import ROOM_NAMES

LEARNT_FRAMES = 100_000
"""Fewer than any run that learns from rewards took to settle in a default room; the quickest took 168,000."""


@dataclass(frozen=True)
class Budget:
    """What the experiments may spend.

    Attributes:
        name: as on the command line.
        rooms: which of the default rooms.
        frames: of a run under the published settings in the main experiment (the paper: 10 M).
        default_frames: of a run of the default recipe there; None: as many as the recipe says.
        seeds: agents of each kind.
        episodes_per_target, step_limit: of every evaluation.
        unseen_targets: tried at each distance in a scene, at most.
        most_scenes: scenes taken of a folder of dumps; None: all.
        whole_grid: solve all settings of the analysis, not a few of them.
        mark: stands on top of the report, where its figures say nothing and no claim is judged, "{frames}" for those of
            the main experiment; empty for none.
    """

    name: BudgetName
    rooms: tuple[RoomName, ...]
    frames: int
    default_frames: int | None
    seeds: int
    episodes_per_target: int
    step_limit: int
    unseen_targets: int
    most_scenes: int | None = None
    whole_grid: bool = True
    mark: str = ""

    def changed(self, rooms: Sequence[RoomName] | None = None, frames: int | None = None) -> Budget:
        """The budget with other rooms, or with the same number of frames for every learner; None changes nothing.

        So many that something is learnt take its mark away.
        """
        found = self if rooms is None else replace(self, rooms=tuple(dict.fromkeys(rooms)))
        if frames is None:
            return found
        return replace(found, frames=frames, default_frames=frames, mark=self.mark if frames < LEARNT_FRAMES else "")

    def warning(self, scenes: int) -> str:
        """What stands on top of a report of so many scenes: where it has less of anything than the paper."""
        if self.mark:
            frames = sorted({self.frames, self.default_frames or self.frames})
            return self.mark.format(frames=" to ".join(f"{count:,}" for count in frames))
        found = []
        if scenes < len(PAPER.rooms):
            found.append(f"{scenes} of {len(PAPER.rooms)} scenes")
        if self.frames < PAPER.frames:
            found.append(f"{self.frames:,} frames in the main experiment instead of the paper's {PAPER.frames:,}")
        if self.episodes_per_target < PAPER.episodes_per_target:
            episodes = f"{self.episodes_per_target} episodes a target"
            found.append(f"{episodes} instead of {PAPER.episodes_per_target}, of {self.step_limit:,} steps at most")
        return f"Less than the paper's budget: {'; '.join(found)}." if found else ""


PAPER = Budget("paper", ROOM_NAMES, 10_000_000, None, 5, EPISODES_PER_TARGET, STEP_LIMIT, 20)
"""The paper's frames, with five seeds instead of one."""

SMOKE = Budget(
    "smoke",
    ("bathroom",),
    12_000,
    12_000,
    2,
    10,
    500,
    5,
    most_scenes=1,
    whole_grid=False,
    mark=(
        "Smoke budget: shows that everything runs here, and what a report looks like. It cannot show which agent is "
        "better, and judges nothing: its trainings end, after {frames} frames in the main experiment, before anything "
        "is learnt."
    ),
)
"""Shows within minutes that everything runs; its figures say nothing about the paper."""

BUDGETS: dict[BudgetName, Budget] = {"paper": PAPER, "smoke": SMOKE}
