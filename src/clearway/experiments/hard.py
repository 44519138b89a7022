"""Tables 2 and 3: the two rewards on hard targets, after the main experiment's frames and after twice as many."""

from __future__ import annotations

import json

from clearway.experiments.groups import all_jobs, all_missing, compared
from clearway.experiments.hard_targets import hard_targets
from clearway.experiments.navigation_tables import navigation_tables
from clearway.experiments.paper_numbers import TABLE_2, TABLE_3, PaperRow
from clearway.experiments.plan import Job, TargetSets
from clearway.experiments.section import Section
from clearway.experiments.setting import Setting
from clearway.experiments.table1 import claims
from clearway.files import written_whole
from clearway.reward import COLLISION_AWARE, SHORTEST

REWARDS = (SHORTEST, COLLISION_AWARE)
FILE = "hard_targets.json"
RULE = "hard targets: random-walk steps times share of collision poses on shortest paths, at least 4 cells apart"


def jobs_at(setting: Setting, frames_factor: float) -> list[Job]:
    """What must be done for agents trained so many times as long as in the main experiment."""
    return all_jobs(compared(setting, REWARDS, targets=chosen(setting), frames_factor=frames_factor))


def section_at(setting: Setting, name: str, frames_factor: float, paper: dict[str, PaperRow]) -> Section:
    """What came of it."""
    groups = compared(setting, REWARDS, targets=chosen(setting), frames_factor=frames_factor)
    times = (
        "the main experiment's frames"
        if frames_factor == 1
        else f"{frames_factor:g} times the main experiment's frames"
    )
    return Section(
        name=name,
        title=f"Hard targets after {times} (the paper's {name[:-1]} {name[-1]})",
        text=f"Agents trained and tried on {RULE}; the targets are in {FILE}.",
        tables=navigation_tables(name, f"Hard targets, {times}", setting, chosen(setting), groups, paper),
        claims=tuple(claims(setting, groups)),
        missing=all_missing(groups, setting.out),
    )


def chosen(setting: Setting) -> TargetSets:
    """The hard targets of the setting's scenes; found once, then read from their file."""
    path = setting.out / FILE
    wanted = {file.name: file.digest for file in setting.files}
    if path.exists():
        content = json.loads(path.read_text(encoding="utf-8"))
        if content["scenes"] == wanted:
            return tuple(tuple(content["targets"][name]) for name in wanted)
    found = {scene.name: hard_targets(scene) for scene in setting.scenes}
    with written_whole(path) as part:
        part.write_text(
            json.dumps({"rule": RULE, "scenes": wanted, "targets": found}, indent=2) + "\n", encoding="utf-8"
        )
    return tuple(found[name] for name in wanted)


def table2_jobs(setting: Setting) -> list[Job]:
    """What must be done for table 2."""
    return jobs_at(setting, 1)


def table2(setting: Setting) -> Section:
    """Table 2."""
    return section_at(setting, "table2", 1, TABLE_2)


def table3_jobs(setting: Setting) -> list[Job]:
    """What must be done for table 3."""
    return jobs_at(setting, 2)


def table3(setting: Setting) -> Section:
    """Table 3."""
    return section_at(setting, "table3", 2, TABLE_3)
