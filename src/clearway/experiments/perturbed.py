"""What perturbed pictures do to agents on the grid, and what it brings to be trained on some; of four rewards."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np

from clearway.agents.on_learnt_map import MOST_A_POSE, frames_of
from clearway.experiments.groups import (
    EXACT,
    PAIR,
    PAIR_AND_RIVALS,
    REWARD_PAIRS,
    WALKED,
    Scores,
    random_walk,
    scores_of,
)
from clearway.experiments.hindrance import feasible, hindrance
from clearway.experiments.job import any_walked, unfinished
from clearway.experiments.plan import NEAREST, RANDOM_WALK, Job, PerturbedPictures, PlannedRun, WalkerName
from clearway.experiments.section import Claim, ReportTable, Section, Value
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import further, judged_less, judged_more, with_failures
from clearway.live.conditions import REFERENCE
from clearway.live.words import GEOMETRY
from clearway.reward import COLLISION_AWARE

NAME = "perturbed"
STEP_LIMIT = 500
EVERYTHING = PerturbedPictures(REFERENCE)
"""What agents are trained on beside the scenes' own pictures."""
OWN, ALL = "own pictures", "everything perturbed"
SEEN: Mapping[str, PerturbedPictures | None] = {
    OWN: None,
    "camera and furniture perturbed": PerturbedPictures(GEOMETRY),
    ALL: EVERYTHING,
}
"""What is seen on the way."""
TOO, ALONE = "perturbed pictures too", "own pictures alone"
"""What agents are trained on."""
METRICS = ("success", "sc_4x", "spl", "collisions")
HEADINGS = ("success", "within 4 x shortest", "SPL", "collisions")


Row = tuple[str, str, str, str | None]
"""What is seen on the way, learner, agent, and what it was trained on; of those that are not trained what stands for
learner and agent in a table, and None."""


def jobs(setting: Setting) -> list[Job]:
    """What must be done; where no other pictures of the scenes can be taken, what is done already."""
    return feasible(setting.out, chain(*_planned(setting).values()), _why_nothing(setting))


def section(setting: Setting) -> Section:
    """What came of it."""
    planned, why = _planned(setting), _why_nothing(setting)
    others = [job for (seen, *_), own in planned.items() if seen != OWN for job in own]
    if why and not any_walked(setting.out, others):  # own pictures are other experiments', too
        return Section(name=NAME, title="Perturbed pictures", text=f"Nothing was walked. {why}")
    count = setting.world().target_count
    found = {row: scores_of(setting.out, own, count) for row, own in planned.items()}
    missing = unfinished(setting.out, chain(*planned.values()))
    left_out = [name for name in setting.learners if name not in {row[1] for row in planned}]
    return Section(
        name=NAME,
        title="Perturbed pictures",
        text=(
            "Agents on the grid. Where the table says so, they were trained on "
            f"{EVERYTHING.takes} perturbed pictures of every pose beside its own. In episodes of at most {STEP_LIMIT} "
            "steps they see the poses' own pictures, or "
            f"{EVERYTHING.takes} others of each, one a step and none twice to the bit, that no training has seen. "
            "Targets are seen in their own. Moves stay those of the grid, wherever a picture shows the furniture. "
            "Agents of one seed have the same starts, chances and pictures."
            + (f" {', '.join(left_out)}: learns from no perturbed pictures, and is left out." if left_out else "")
            + (f" No more can be walked here: {why}" if why and missing else "")
        ),
        tables=(_table(setting, found),),
        claims=further(_claims(setting, found)),
        missing=missing,
    )


def _why_nothing(setting: Setting) -> str | None:
    if not any(learner.sees_takes for learner in setting.learners.values()):
        return f"No learner of {', '.join(setting.learners)} learns from perturbed pictures."
    return hindrance(setting.scenes, pictured=True)


def _seen(setting: Setting) -> Mapping[str, PerturbedPictures | None]:
    """What is seen; in a smoke run, which compares the first pair of rewards alone, the ends."""
    return SEEN if setting.budget.whole_grid else {seen: SEEN[seen] for seen in (OWN, ALL)}


def _planned(setting: Setting) -> dict[Row, tuple[Job, ...]]:
    """Jobs, one a seed: by what is seen those that are trained, then the nearest picture, beside the first of them."""
    trained = dict[tuple[str, str, str], tuple[PlannedRun, ...]]()
    for name, learner in setting.learners.items():
        if not learner.sees_takes:
            continue
        for reward in PAIR_AND_RIVALS if setting.budget.whole_grid else PAIR:
            runs = setting.runs(learner, reward)
            trained[name, reward.name, TOO] = tuple(replace(run, perturbed=EVERYTHING) for run in runs)
            if reward == COLLISION_AWARE:
                trained[name, reward.name, ALONE] = runs
    found = dict[Row, tuple[Job, ...]]()
    frames = f"{frames_of(setting.world(), MOST_A_POSE):,} frames"
    for seen, pictures in _seen(setting).items() if trained else ():
        for kind, runs in trained.items():
            found[seen, *kind] = _tried(setting, runs, pictures)
        if pictures is not None:
            found[seen, NEAREST, frames, None] = _tried(setting, next(iter(trained.values())), pictures, NEAREST)
    return found


def _tried(
    setting: Setting, runs: Sequence[PlannedRun], pictures: PerturbedPictures | None, walker: WalkerName = "agent"
) -> tuple[Job, ...]:
    """Each run tried by its own seed."""
    trial = setting.trial(step_limit=STEP_LIMIT)
    return tuple(Job(run, (replace(trial, seed=run.seed, perturbed=pictures, walker=walker),)) for run in runs)


def _table(setting: Setting, found: Mapping[Row, Scores]) -> ReportTable:
    """A row for what is seen and each kind of agent."""
    world = setting.world()
    scenes = world.target_scene.numpy()
    rows: list[tuple[Value, ...]] = [(*row, len(own), *own.estimates(METRICS, scenes)) for row, own in found.items()]
    walked = random_walk(world, setting.trial(step_limit=STEP_LIMIT))
    means = (float(np.mean(walked.in_scenes(metric, scenes))) for metric in METRICS)
    for how, agent, figures in ((WALKED, RANDOM_WALK, means), (EXACT, "shortest path", (1.0, 1.0, 1.0, 0.0))):
        rows.append((None, how, agent, None, None, *(value for figure in figures for value in (figure, None))))
    headings = (heading for name in HEADINGS for heading in (name, f"95 % of {name}"))
    notes = ("Who goes by the nearest picture knows the poses' own, and where the actions of random walkers led.",)
    left = ("seen on the way", "learner", "agent", "trained on", "seeds")
    return ReportTable(NAME, "Perturbed pictures", (*left, *headings), tuple(rows), notes)


def _claims(setting: Setting, found: Mapping[Row, Scores]) -> Iterator[Claim]:
    """Of rewards where everything is perturbed, and of what agents are trained on; six for each learner."""
    for learner in dict.fromkeys(name for _, name, _, trained_on in found if trained_on):
        for first, second in REWARD_PAIRS if setting.budget.whole_grid else REWARD_PAIRS[:1]:
            text = f"{learner}: {ALL}, {first.name}, fewer collisions than {second.name}"
            pair = (found[ALL, learner, reward.name, TOO] for reward in (first, second))
            yield _claim(setting, text, "collisions", *pair)
        (too, alone), (too_on_own, alone_on_own) = (
            [found[seen, learner, COLLISION_AWARE.name, trained_on] for trained_on in (TOO, ALONE)]
            for seen in (ALL, OWN)
        )
        for metric, what in (("collisions", "fewer collisions"), ("spl", "higher SPL")):
            text = f"{learner}: {ALL}, {COLLISION_AWARE.name}, {what} if trained on {TOO} than on {ALONE}"
            yield _claim(setting, text, metric, too, alone)
        text = f"{learner}: {OWN}, {COLLISION_AWARE.name}, fewer collisions if trained on {ALONE} than on {TOO}"
        yield _claim(setting, text, "collisions", alone_on_own, too_on_own)


def _claim(setting: Setting, text: str, metric: str, first: Scores, second: Scores) -> Claim:
    judged = judged_more if metric == "spl" else judged_less
    target_scene = setting.world().target_scene.numpy()
    claim = judged(text, metric, first.of(metric), second.of(metric), target_scene)
    return with_failures(claim, first.of("success"), second.of("success"), target_scene)
