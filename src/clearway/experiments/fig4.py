"""Figure 4: the same agents halfway and in the end, and the whole of their training."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.experiments.convergence import settling
from clearway.experiments.groups import PAIR, WALKED, Group, Scores, all_jobs, compared, random_walk
from clearway.experiments.job import run_folder
from clearway.experiments.learnt_maps import ABOUT_MAPS, on_maps
from clearway.experiments.plan import RANDOM_WALK, Job
from clearway.experiments.section import Claim, ReportFigure, ReportTable, Section, Series, Value
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import judged_less, judged_no_more, with_failures
from clearway.reward import COLLISION_AWARE, SHORTEST

METRICS = {"steps": 1.0, "collisions": 0.1}
"""What is shown, and where its curves' axis turns logarithmic, so that the end of training can be seen too."""
CURVE_POINTS = 50
BAND = "Lines: mean of the seeds; bands: smallest to largest"


def jobs(setting: Setting) -> list[Job]:
    """What must be done: the main experiment's agents, kept halfway too."""
    return all_jobs(_groups(setting))


def section(setting: Setting) -> Section:
    """What came of it."""
    groups = _groups(setting)
    settled, sooner = settling("fig4", setting, [group for group in groups if not group.trial.halfway])
    return Section(
        name="fig4",
        title="Speed of convergence (the paper's figure 4)",
        text=(
            "The main experiment's agents tried halfway and in the end of their training; below, episodes ended during "
            "training (not every learner draws their targets evenly). The paper prints its figures as a picture alone."
        ),
        tables=(_table(setting, groups), settled),
        figures=tuple(_curves(setting, groups)),
        claims=(*_claims(setting, groups), *sooner),
    )


def _groups(setting: Setting) -> list[Group]:
    return [group for halfway in (True, False) for group in compared(setting, PAIR, halfway=halfway)]


def _table(setting: Setting, groups: Sequence[Group]) -> ReportTable:
    world, trial = setting.world(), setting.trial()
    scenes = world.target_scene.numpy()
    found: list[tuple[tuple[Value, ...], Scores]] = []
    for group in groups:
        values = group.scores(setting.out, world.target_count)
        frames = group.runs[0].halfway if group.trial.halfway else group.runs[0].learner.frames
        found.append(((group.learner, group.agent, frames, len(values)), values))
    for mapped in on_maps(setting, trial):
        found.append(((mapped.agent, None, mapped.frames, len(mapped.scores)), mapped.scores))
    found.append(((WALKED, RANDOM_WALK, None, None), random_walk(world, trial)))
    rows = tuple((*who, own.failed(), *own.estimates(METRICS, scenes)) for who, own in found)
    headings = (
        "learner",
        "agent",
        "frames",
        "seeds",
        "failed targets",
        "steps",
        "95 %",
        "collisions",
        "95 % of collisions",
    )
    return ReportTable("fig4", "Halfway and in the end", headings, rows, (ABOUT_MAPS,))


def _claims(setting: Setting, groups: Sequence[Group]) -> list[Claim]:
    """The collision-aware agent is ahead halfway, and has then nearly come to its end."""
    world = setting.world()
    scenes = world.target_scene.numpy()
    found = []
    for learner in setting.learners:
        halfway = {
            group.agent: group.scores(setting.out, world.target_count)
            for group in groups
            if group.learner == learner and group.trial.halfway
        }
        ours, baseline = halfway[COLLISION_AWARE.name], halfway[SHORTEST.name]
        for metric in METRICS:
            text = f"{learner}: learns faster (fewer {metric} halfway)"
            claim = judged_less(text, f"{metric} halfway", ours.of(metric), baseline.of(metric), scenes)
            found.append(with_failures(claim, ours.of("success"), baseline.of("success"), scenes))
        (end,) = (
            group.scores(setting.out, world.target_count)
            for group in groups
            if (group.learner, group.agent, group.trial.halfway) == (learner, COLLISION_AWARE.name, False)
        )
        text = f"{learner}: halfway is close to the end (no more steps)"
        claim = judged_no_more(text, "steps", ours.of("steps"), end.of("steps"), scenes)
        found.append(with_failures(claim, ours.of("success"), end.of("success"), scenes))
    return found


def _curves(setting: Setting, groups: Sequence[Group]) -> list[ReportFigure]:
    figures = []
    for learner in setting.learners:
        own = [group for group in groups if group.learner == learner and not group.trial.halfway]
        for metric, linear_below in METRICS.items():
            for axis in ("frames", "seconds"):
                series = tuple(line for group in own if (line := _curve(setting, group, axis, metric)) is not None)
                if series:
                    name = f"fig4_{learner}_{metric}_{axis}"
                    title = f"{learner}: {metric} of training episodes"
                    what = f"training {axis}", f"{metric} an episode"
                    figures.append(ReportFigure(name, title, *what, series, linear_below, band=BAND))
    return figures


def _curve(setting: Setting, group: Group, axis: str, metric: str) -> Series | None:
    """Mean, smallest and largest over seeds on a common axis; as far as all seeds have come."""
    rows = [[row for row in run_folder(setting.out, run).metrics() if row["episodes"]] for run in group.runs]
    rows = [own for own in rows if len(own) > 1]
    if not rows:
        return None
    first, last = max(own[0][axis] for own in rows), min(own[-1][axis] for own in rows)
    if last <= first:
        return None
    x = np.linspace(first, last, CURVE_POINTS)
    y = np.stack([np.interp(x, [row[axis] for row in own], [row[metric] for row in own]) for own in rows])
    return Series(group.agent, x.tolist(), y.mean(0).tolist(), y.min(0).tolist(), y.max(0).tolist())
