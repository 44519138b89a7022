"""Whether agents are good enough: every training by itself, against criteria that no mean can hide a target from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from clearway.evaluation.criteria import Criteria, Quality, quality
from clearway.experiments.convergence import settling_table
from clearway.experiments.groups import WALKED, Group, Scores, all_jobs, compared, random_walk
from clearway.experiments.learnt_maps import ABOUT_MAPS, on_maps
from clearway.experiments.plan import RANDOM_WALK, Job
from clearway.experiments.section import Claim, ReportTable, Section, Value
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import LEAST_RUNS, TOO_FEW, further
from clearway.reward import COLLISION_AWARE
from clearway.world.world import World

NAME = "quality"
CRITERIA = Criteria()
CALLED = {
    "solved_targets": "targets solved",
    "path_ratio": "x the shortest path",
    "worst_path_ratio": "worst target",
    "collisions": "collisions",
}
"""What is judged, by the criterion's name."""
HEADINGS = ("learner", "agent", "seed", *CALLED.values(), "which is the worst", "misses")


def jobs(setting: Setting) -> list[Job]:
    """What must be done: the main experiment's agents under the collision-aware reward."""
    return all_jobs(_groups(setting))


def section(setting: Setting) -> Section:
    """What came of it."""
    groups = _groups(setting)
    world = setting.world()
    found = {group.learner: _by_seed(world, group.scores(setting.out, world.target_count)) for group in groups}
    return Section(
        name=NAME,
        title="Good enough?",
        text=(
            "Every training under the collision-aware reward against criteria: each target solved (all its episodes "
            f"arrive in under 500 steps), steps at most {CRITERIA.path_ratio - 1:.0%} above the shortest paths, on no "
            f"target above {CRITERIA.worst_path_ratio - 1:.0%}, and fewer than {CRITERIA.collisions:g} collisions an "
            "episode."
        ),
        tables=(_table(setting, world, found), settling_table(NAME, setting, groups)),
        claims=further(_claims(setting, found)),
    )


def _groups(setting: Setting) -> list[Group]:
    return compared(setting, (COLLISION_AWARE,))


def _by_seed(world: World, scores: Scores) -> dict[int, Quality]:
    """The quality of each run, by its seed."""
    return {seed: quality(world, own) for seed, own in zip(scores.seeds, scores.values, strict=True)}


def _missed(found: Quality) -> list[str]:
    """What the criteria call those that are not met."""
    met = found.met(CRITERIA)
    return [called for name, called in CALLED.items() if not met[name]]


def _table(setting: Setting, world: World, found: Mapping[str, Mapping[int, Quality]]) -> ReportTable:
    trial = setting.trial()
    rows = [
        _row((learner, COLLISION_AWARE.name, seed), own)
        for learner, runs in found.items()
        for seed, own in runs.items()
    ]
    for mapped in on_maps(setting, trial):
        rows += [_row((*mapped.called, seed), own) for seed, own in _by_seed(world, mapped.scores).items()]
    (walked,) = _by_seed(world, random_walk(world, trial)).values()
    rows.append(_row((WALKED, RANDOM_WALK, None), walked))
    notes = (
        "Of all targets; means over scenes of their targets' means. The worst target is the one whose steps exceed its "
        "shortest paths' the most, in its scene's own numbering.",
        ABOUT_MAPS,
    )
    return ReportTable(NAME, "Against the criteria", HEADINGS, tuple(rows), notes)


def _row(who: tuple[Value, ...], found: Quality) -> tuple[Value, ...]:
    return (
        *who,
        f"{found.solved_targets} of {found.target_count}",
        found.path_ratio,
        found.worst_path_ratio,
        found.collisions,
        f"{found.worst_scene}, {found.worst_target}",
        ", ".join(_missed(found)) or "none",
    )


def _claims(setting: Setting, found: Mapping[str, Mapping[int, Quality]]) -> Iterator[Claim]:
    """Every training of a learner meets all criteria. This is counted, not estimated: there is no p."""
    for learner, runs in found.items():
        missed = [_missed(own) for own in runs.values()]
        met = missed.count([])
        told = f"{met} of {len(runs)} trainings meet all criteria"
        names = [name for name in CALLED.values() if any(name in own for own in missed)]
        told += f"; missed: {', '.join(names)}." if names else "."
        yield _judged(f"{learner}: every training is good enough", met, len(runs), len(setting.seeds), told)


def _judged(text: str, met: int, complete: int, planned: int, told: str) -> Claim:
    """Of at least `LEAST_RUNS` trainings one that misses a criterion is enough to say no; yes needs all planned."""
    if complete < LEAST_RUNS:
        return Claim(text, "undecided", f"{told} {TOO_FEW}")
    if met < complete:
        return Claim(text, "does not hold", told, counted=True)
    if complete < planned:
        return Claim(text, "undecided", f"{told} Still to come: {planned - complete}.", counted=True)
    return Claim(text, "holds", told, counted=True)
