"""Anticipation where a robot needs it: agents of the paper's rewards and of two rivals in the room, off the grid."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain

import numpy as np

from clearway.agents.on_learnt_map import MOST_A_POSE, frames_of
from clearway.evaluation.across_seeds import mean_estimate
from clearway.experiments.groups import PAIR_AND_RIVALS, REWARD_PAIRS, WALKED
from clearway.experiments.hindrance import feasible, hindrance
from clearway.experiments.job import any_walked, trial_path, unfinished
from clearway.experiments.live_trial import FIGURES, read_live
from clearway.experiments.plan import NEAREST, RANDOM_WALK, Job, LiveTrial, PlannedRun, WalkerName
from clearway.experiments.section import Claim, ReportTable, Section, Value
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import further, judged_less, judged_more, with_failures
from clearway.live.conditions import Condition, sweep_settings
from clearway.reward import BUMP, CLEARANCE, COLLISION_AWARE, SHORTEST

NAME = "off-grid"
EPISODES_PER_TARGET, STEP_LIMIT = 4, 40
WORDS = {
    "contacts": "fewer contacts",
    "least clearance": "a larger least clearance",
    "within 10 cm": "less time within 10 cm",
    "within 30 cm": "less time within 30 cm",
    "in the collision zone": "less time in the collision zone",
}
LOST = 0.05
"""Share of episodes by which one kind may arrive less often and still be told better; few are walked."""
TOUCHING = ("contacts", "least clearance")
STAYING_NEAR = ("within 10 cm", "within 30 cm", "in the collision zone")
"""Of both kinds of figures six claims are made: five seeds of an agent decide no more after Holm's correction. Three
more, of staying near, are of a family of their own."""


Row = tuple[str, str]
"""Learner and agent, by its reward; of agents that need no training what stands for these in a table."""


def settings(setting: Setting) -> list[Condition]:
    """Of the rooms: nothing changed, each perturbation alone at full strength, all at once; of a smoke run the ends."""
    found = sweep_settings((1.0,))
    return found if setting.budget.whole_grid else [found[0], found[-1]]


def jobs(setting: Setting) -> list[Job]:
    """What must be done; where scenes cannot be walked in, what is done already."""
    return feasible(setting.out, chain(*_planned(setting).values()), hindrance(setting.scenes))


def section(setting: Setting) -> Section:
    """What came of it."""
    planned, why = _planned(setting), hindrance(setting.scenes)
    if why and not any_walked(setting.out, chain(*planned.values())):
        return Section(name=NAME, title="Off the grid", text=f"Nothing was walked. {why}")
    found = {row: _scores(setting, own) for row, own in planned.items()}
    missing = unfinished(setting.out, chain(*planned.values()))
    return Section(
        name=NAME,
        title="Off the grid",
        text=(
            f"Agents that were trained on the pictures of the grid, in the rooms themselves: {EPISODES_PER_TARGET} "
            f"episodes a target, {STEP_LIMIT} steps at most, under each setting of a sweep at full strength. Agents of "
            "one seed have the same starts and chances. Claims are of means over the settings. Who goes by the nearest "
            "picture knows those of the grid as it was built, and where the actions of random walkers led there."
            + (f" No more can be walked here: {why}" if why and missing else "")
        ),
        tables=(_table(setting, found),),
        claims=further(_claims(setting, found)),
        missing=missing,
    )


def _planned(setting: Setting) -> dict[Row, tuple[Job, ...]]:
    """Jobs, one a seed: of those that are trained, then of two that walk to the targets of the first of them."""
    found = {
        (name, reward.name): _tried(setting, setting.runs(learner, reward), "agent")
        for name, learner in setting.learners.items()
        for reward in PAIR_AND_RIVALS
    }
    beside = setting.runs(next(iter(setting.learners.values())), PAIR_AND_RIVALS[0])
    frames = f"{frames_of(setting.world(), MOST_A_POSE):,} frames"
    found[NEAREST, frames] = _tried(setting, beside, NEAREST)
    found[WALKED, RANDOM_WALK] = _tried(setting, beside, RANDOM_WALK)
    return found


def _tried(setting: Setting, runs: Sequence[PlannedRun], walker: WalkerName) -> tuple[Job, ...]:
    episodes, asked = min(EPISODES_PER_TARGET, setting.budget.episodes_per_target), tuple(settings(setting))
    return tuple(Job(run, (LiveTrial(asked, episodes, STEP_LIMIT, run.seed, walker),)) for run in runs)


def _scores(setting: Setting, jobs: Iterable[Job]) -> np.ndarray:
    """(R, K, M, J) of the runs that are complete."""
    found = []
    for job in jobs:
        (trial,) = job.trials
        path = trial_path(setting.out, job.run, trial)
        if path.exists():
            found.append(read_live(path, settings(setting), trial.episodes_per_target))
    count = setting.world().target_count
    return np.stack(found) if found else np.empty((0, len(settings(setting)), count, len(FIGURES)))


def _table(setting: Setting, found: Mapping[Row, np.ndarray]) -> ReportTable:
    """A row for each kind of agent under all settings together, then under each."""
    scenes = setting.world().target_scene.numpy()
    rows: list[tuple[Value, ...]] = []
    labels = [one.label for one in settings(setting)]
    for number, label in enumerate(["all settings, mean", *labels]):
        for (learner, agent), scores in found.items():
            own = scores.mean(1) if number == 0 else scores[:, number - 1]
            estimates = [mean_estimate(own[..., index], scenes) if len(own) else None for index in range(len(FIGURES))]
            figures = (value for each in estimates for value in ((each.value, each.ends) if each else (None, None)))
            rows.append((label, learner, agent, len(own), *figures))
    headings = (heading for name in FIGURES for heading in (name, f"95 % of {name}"))
    notes = (
        "Least clearance: of an episode, metres. The last three are shares of the time; the collision zone is that of "
        "the nearest pose of the grid as it was built.",
    )
    return ReportTable(NAME, "Off the grid", ("setting", "learner", "agent", "seeds", *headings), tuple(rows), notes)


def _claims(setting: Setting, found: Mapping[Row, np.ndarray]) -> Iterator[Claim]:
    """Three families for each learner: what agents touch or come near to; how long they stay near; also than `bump`."""
    for learner in setting.learners:
        own = {agent: scores.mean(1) for (name, agent), scores in found.items() if name == learner}
        for figure in TOUCHING:
            for first, second in REWARD_PAIRS:
                yield _claim(setting, f"{learner}, touching", figure, first.name, second.name, own)
        for figure in STAYING_NEAR:
            for first in (COLLISION_AWARE, CLEARANCE):
                yield _claim(setting, f"{learner}, staying near", figure, first.name, SHORTEST.name, own)
        for figure in STAYING_NEAR:
            yield _claim(setting, f"{learner}, staying near, bump", figure, COLLISION_AWARE.name, BUMP.name, own)


def _claim(setting: Setting, family: str, figure: str, first: str, second: str, own: Mapping[str, np.ndarray]) -> Claim:
    scenes = setting.world().target_scene.numpy()
    one, other = (own[name][..., FIGURES.index(figure)] for name in (first, second))
    judged = judged_more if figure == "least clearance" else judged_less
    text = f"{family}: {first}, {WORDS[figure]} than {second}"
    arrived, others = (own[name][..., FIGURES.index("success")] for name in (first, second))
    return with_failures(judged(text, figure, one, other, scenes), arrived, others, scenes, lost=LOST)
