"""Tables 2 and 3: the rewards on hard targets, after the main experiment's frames and after twice as many."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from clearway.experiments.convergence import settling
from clearway.experiments.groups import PAIR, Group, all_jobs, compared, of_same_seeds
from clearway.experiments.hard_targets import hard_targets
from clearway.experiments.kept import keep, kept
from clearway.experiments.navigation_tables import navigation_tables
from clearway.experiments.other_learners import other_learners
from clearway.experiments.paper_numbers import TABLE_2, TABLE_3, PaperRow
from clearway.experiments.plan import Job, TargetSets
from clearway.experiments.section import Claim, Section
from clearway.experiments.setting import TABLE_1_REWARDS, Setting
from clearway.experiments.table1 import claims
from clearway.experiments.verdicts import judged_more, judged_no_more
from clearway.world.world import World

FILE = "hard_targets.json"
NO_EASY = "No complete runs on the usual targets yet (experiment table1)."
RULE = (
    "hard targets: the largest product of a random walk's steps and the share of collision poses on shortest paths, "
    "at least 4 cells apart or as far as they can be"
)


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
        return all_jobs((*self._groups(setting), *other_learners(setting, chosen(setting))))

    def section(self, setting: Setting) -> Section:
        """What came of it."""
        groups, others = self._groups(setting), other_learners(setting, chosen(setting))
        name = f"table{self.number}"
        frames = " and ".join(dict.fromkeys(f"{group.runs[0].learner.frames:,}" for group in groups))
        times = "" if self.frames_factor == 1 else f"{self.frames_factor} times "
        title = f"Hard targets after {times}the main experiment's frames"
        where = f" on hard targets after {times}the frames" if times else " on hard targets"
        tables = navigation_tables(name, title, setting, chosen(setting), groups, self.paper, others)
        settled, sooner = settling(name, setting, groups, where)
        return Section(
            name=name,
            title=f"{title} (the paper's table {self.number})",
            text=(
                f"Agents trained for {frames} frames and tried on {RULE}. {FILE} holds the targets, how hard they are "
                "and how far apart."
            ),
            tables=(*tables, settled),
            claims=(*claims(setting, groups, where), *sooner, *self._beside_easy(setting, groups)),
        )

    def _beside_easy(self, setting: Setting, groups: Sequence[Group]) -> Iterator[Claim]:
        """Hard targets are harder than the main experiment's after its frames, and no more so after twice as many.

        Under both of the paper's rewards together; undecided, as it counts, until the main experiment is there.
        """
        scenes = np.arange(len(setting.scenes))
        main, world, hard_world = compared(setting, PAIR), setting.world(), setting.world(chosen(setting))
        for learner in setting.learners:
            easy, hard = _detours(setting, main, learner, world), _detours(setting, groups, learner, hard_world)
            if self.frames_factor == 1:
                text = f"{learner}: hard targets are harder (larger detours)"
                claim = judged_more(text, "x shortest paths", hard, easy, scenes, rewards=len(PAIR))
            else:
                text = f"{learner}: {self.frames_factor} times the frames repair hard targets (no larger detours)"
                claim = judged_no_more(text, "x shortest paths", hard, easy, scenes, rewards=len(PAIR))
            yield claim if len(easy) else replace(claim, evidence=NO_EASY)

    def _groups(self, setting: Setting) -> list[Group]:
        return compared(setting, TABLE_1_REWARDS, targets=chosen(setting), frames_factor=self.frames_factor)


def _detours(setting: Setting, groups: Sequence[Group], learner: str, world: World) -> np.ndarray:
    """(R, C) steps over the shortest paths' in each scene: a learner's runs of seeds complete under both rewards."""
    own = [group for group in groups if group.learner == learner and group.runs[0].reward in PAIR]
    found = of_same_seeds([group.scores(setting.out, world.target_count) for group in own])
    return np.concatenate([each.detours(world.target_scene.numpy()) for each in found])


TABLE2, TABLE3 = HardTable(2, 1, TABLE_2), HardTable(3, 2, TABLE_3)


def chosen(setting: Setting) -> TargetSets:
    """The hard targets of the setting's scenes; found once, then read from their file."""
    path = setting.out / FILE
    question = {"rule": RULE, "scenes": {file.name: file.digest for file in setting.files}}
    found = kept(path, question, "found")
    if found is None or set(found) != {scene.name for scene in setting.scenes}:
        found = {scene.name: asdict(hard_targets(scene)) for scene in setting.scenes}
        keep(path, question, {"found": found})
    return tuple(tuple(found[scene.name]["targets"]) for scene in setting.scenes)
