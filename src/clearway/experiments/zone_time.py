"""Anticipation on the grid: how long agents stay where the paper's reward would have them leave, bump or not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from clearway.experiments.groups import WALKED, Group, Scores, all_jobs, compared, random_walk
from clearway.experiments.learnt_maps import ABOUT_MAPS, on_maps
from clearway.experiments.plan import RANDOM_WALK, Job
from clearway.experiments.section import Claim, ReportTable, Section, Value
from clearway.experiments.setting import TABLE_1_REWARDS, Setting
from clearway.experiments.verdicts import further, judged_less, with_failures
from clearway.reward import BUMP, COLLISION_AWARE, SHORTEST

NAME = "zone-time"
FIGURES = {
    "share_collision": "share of steps in the collision zone",
    "collision_visits": "steps in the collision zone an episode",
    "share_precollision": "share of steps in the precollision zone",
    "steps": "steps",
}
WORDS = {
    "share_collision": "a smaller share of steps in the collision zone",
    "collision_visits": "fewer steps in the collision zone",
}
"""What is judged. Who leaves the collision zone for the precollision zone does as the reward says."""


def jobs(setting: Setting) -> list[Job]:
    """What must be done: the main experiment's agents."""
    return all_jobs(_groups(setting))


def section(setting: Setting) -> Section:
    """What came of it."""
    groups = _groups(setting)
    return Section(
        name=NAME,
        title="Time in the zones",
        text=(
            "The main experiment's agents: how many of their steps end in the collision zone, where a move forward or "
            "back is blocked, and in the precollision zone beside it. The target's pose is in no zone."
        ),
        tables=(_table(setting, groups),),
        claims=further(_claims(setting, groups)),
    )


def _groups(setting: Setting) -> list[Group]:
    return compared(setting, TABLE_1_REWARDS)


def _table(setting: Setting, groups: Sequence[Group]) -> ReportTable:
    world, trial = setting.world(), setting.trial()
    scenes = world.target_scene.numpy()
    found: dict[tuple[str, str], Scores] = {
        (group.learner, group.agent): group.scores(setting.out, world.target_count) for group in groups
    }
    found |= {mapped.called: mapped.scores for mapped in on_maps(setting, trial)}
    rows: list[tuple[Value, ...]] = [(*kind, len(own), *own.estimates(FIGURES, scenes)) for kind, own in found.items()]
    rows.append((WALKED, RANDOM_WALK, None, *random_walk(world, trial).estimates(FIGURES, scenes)))
    headings = (heading for words in FIGURES.values() for heading in (words, f"95 % of {words}"))
    return ReportTable(NAME, "Steps in the zones", ("learner", "agent", "seeds", *headings), tuple(rows), (ABOUT_MAPS,))


def _claims(setting: Setting, groups: Sequence[Group]) -> Iterator[Claim]:
    """The collision-aware agents stay in the collision zone for less of their time, and for fewer steps."""
    world = setting.world()
    scenes = world.target_scene.numpy()
    found = {(group.learner, group.agent): group.scores(setting.out, world.target_count) for group in groups}
    for learner in setting.learners:
        ours = found[learner, COLLISION_AWARE.name]
        for figure in WORDS:
            for other in (SHORTEST, BUMP):
                theirs = found[learner, other.name]
                text = f"{learner}: {COLLISION_AWARE.name}, {WORDS[figure]} than {other.name}"
                claim = judged_less(text, FIGURES[figure], ours.of(figure), theirs.of(figure), scenes)
                yield with_failures(claim, ours.of("success"), theirs.of("success"), scenes)
