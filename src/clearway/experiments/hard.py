"""Tables 2 and 3: the two rewards on hard targets, after the main experiment's frames and after twice as many."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from clearway.experiments.groups import PAIR, Group, all_jobs, all_missing, compared
from clearway.experiments.hard_targets import hard_targets
from clearway.experiments.kept import keep, kept
from clearway.experiments.navigation_tables import navigation_tables
from clearway.experiments.paper_numbers import TABLE_2, TABLE_3, PaperRow
from clearway.experiments.plan import Job, TargetSets
from clearway.experiments.section import Section
from clearway.experiments.setting import Setting
from clearway.experiments.table1 import claims

FILE = "hard_targets.json"
RULE = "hard targets: random-walk steps times share of collision poses on shortest paths, at least 4 cells apart"


@dataclass(frozen=True)
class HardTable:
    """One of the paper's tables on hard targets.

    Attributes:
        number: the paper's.
        frames_factor: its agents are trained so many times as long as in the main experiment.
        paper: the paper's own row by the name of a reward.
    """

    number: int
    frames_factor: int
    paper: Mapping[str, PaperRow]

    def jobs(self, setting: Setting) -> list[Job]:
        """What must be done."""
        return all_jobs(self._groups(setting))

    def section(self, setting: Setting) -> Section:
        """What came of it."""
        groups, name = self._groups(setting), f"table{self.number}"
        times = "" if self.frames_factor == 1 else f"{self.frames_factor} times "
        title = f"Hard targets after {times}the main experiment's frames"
        return Section(
            name=name,
            title=f"{title} (the paper's table {self.number})",
            text=f"Agents trained and tried on {RULE}; the targets are in {FILE}.",
            tables=navigation_tables(name, title, setting, chosen(setting), groups, self.paper),
            claims=tuple(claims(setting, groups)),
            missing=all_missing(groups, setting.out),
        )

    def _groups(self, setting: Setting) -> list[Group]:
        return compared(setting, PAIR, targets=chosen(setting), frames_factor=self.frames_factor)


TABLE2, TABLE3 = HardTable(2, 1, TABLE_2), HardTable(3, 2, TABLE_3)


def chosen(setting: Setting) -> TargetSets:
    """The hard targets of the setting's scenes; found once, then read from their file."""
    path = setting.out / FILE
    question = {"rule": RULE, "scenes": {file.name: file.digest for file in setting.files}}
    targets = kept(path, question, "targets")
    if targets is None:
        targets = {scene.name: hard_targets(scene) for scene in setting.scenes}
        keep(path, question, {"targets": targets})
    return tuple(tuple(targets[scene.name]) for scene in setting.scenes)
