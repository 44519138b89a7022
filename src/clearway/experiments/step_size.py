"""Do zones make learning faster, or would a larger or better conditioned step? Both rewards, at several step sizes.

The learning rate is multiplied, and the features are taken as they are or centred and whitened. Five seeds decide at
most six claims of a table after Holm's correction, so there are six.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from clearway.experiments.convergence import (
    ONE_TARGET,
    frames_until_settled,
    mark_steps,
    settled_by_seed,
    settling_table,
)
from clearway.experiments.groups import PAIR, Group, all_jobs, compared
from clearway.experiments.navigation_tables import navigation_tables
from clearway.experiments.plan import Job
from clearway.experiments.section import Claim, Section
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import further, judged_less
from clearway.learn.learner import Learner
from clearway.learn.settings import with_settings
from clearway.reward import COLLISION_AWARE, SHORTEST

NAME = "step-size"
CHANGED = ("lr_start", "lr_end", "centre_features", "whiten_features")


@dataclass(frozen=True)
class StepSize:
    """A learner's steps.

    Attributes:
        rate: multiplies its learning rates.
        whitened: its features are centred and whitened, else taken as they are.
    """

    rate: float
    whitened: bool

    def of(self, learner: Learner) -> Learner:
        """The learner with these steps."""
        rates = [f"{name}={self.rate * getattr(learner, name)!r}" for name in ("lr_start", "lr_end")]
        whitened = str(self.whitened).lower()
        return with_settings(learner, [*rates, f"centre_features={whitened}", f"whiten_features={whitened}"])

    def __str__(self) -> str:
        """Words for people."""
        return f"{self.rate:g} x rate, {'whitened' if self.whitened else 'features as they are'}"


LARGEST = 4.0
ALL = tuple(StepSize(rate, whitened) for whitened in (False, True) for rate in (0.5, 1.0, 2.0, LARGEST))
AS_IT_IS = StepSize(1.0, whitened=False)
LARGER = (StepSize(LARGEST, whitened=False), StepSize(1.0, whitened=True), StepSize(LARGEST, whitened=True))
"""Of which claims are made one by one."""


def jobs(setting: Setting) -> list[Job]:
    """What must be done."""
    return all_jobs(_groups(setting))


def section(setting: Setting) -> Section:
    """What came of it."""
    groups = _groups(setting)
    tables = navigation_tables(NAME, "Steps and collisions", setting, setting.targets, groups, {}) if groups else ()
    return Section(
        name=NAME,
        title="Zones, at several step sizes",
        text=(
            "The paper's two rewards, with learning rates of half to four times a learner's own, on features as they "
            "are and on centred and whitened ones. If zones make learning faster at all of them, it is not that they "
            "make a small step larger; if the shortest-path reward with a larger or better conditioned step settles as "
            "soon as zones do without, such a step does as much."
        ),
        tables=(*tables, settling_table(NAME, setting, groups)) if groups else (),
        claims=further(_claims(setting, groups)),
    )


def _learners(setting: Setting) -> dict[str, Learner]:
    """Those that have such settings, and do not whiten as they are."""
    found = {}
    for name, learner in setting.learners.items():
        if set(CHANGED) <= {field.name for field in fields(learner)} and AS_IT_IS.of(learner) == learner:
            found[name] = learner
    return found


def _steps(setting: Setting) -> tuple[StepSize, ...]:
    """All; of a smoke run those of which claims are made one by one."""
    return ALL if setting.budget.whole_grid else (AS_IT_IS, *LARGER)


def _called(learner: str, step: StepSize) -> str:
    return f"{learner}, {step}"


def _groups(setting: Setting) -> list[Group]:
    learners = {
        _called(name, step): step.of(own) for name, own in _learners(setting).items() for step in _steps(setting)
    }
    return compared(replace(setting, learners=learners), PAIR)


def _claims(setting: Setting, groups: list[Group]) -> Iterator[Claim]:
    """Zones settle sooner at every step size; without them a larger step settles sooner than zones as published."""
    mark, out = mark_steps(setting, setting.targets), setting.out
    arms = {(group.learner, group.agent): group for group in groups}
    frames = {kind: frames_until_settled(out, arm, mark)[0] for kind, arm in arms.items()}
    zones, none = COLLISION_AWARE.name, SHORTEST.name
    steps = _steps(setting)
    for learner in _learners(setting):
        ours, theirs = (
            _together(out, [arms[_called(learner, step), reward] for step in steps], mark) for reward in (zones, none)
        )
        text = f"{learner}: {zones} settles sooner than {none}"
        what = "frames until settled"
        yield judged_less(f"{text}, mean of all step sizes", what, ours, theirs, np.zeros(len(steps), np.int64))
        for step in LARGER:
            ours, theirs = (frames[_called(learner, step), reward] for reward in (zones, none))
            yield judged_less(f"{text}, {step}", what, ours, theirs, ONE_TARGET)
        published = frames[_called(learner, AS_IT_IS), zones]
        for step in LARGER[:2]:
            text = f"{learner}: {none} with {step}, settles sooner than {zones} with {AS_IT_IS}"
            yield judged_less(text, what, frames[_called(learner, step), none], published, ONE_TARGET)


def _together(out: Path, arms: Sequence[Group], mark: float) -> np.ndarray:
    """(R, N) frames until settled in N arms, of the R seeds that are complete in each."""
    found = [settled_by_seed(out, arm, mark) for arm in arms]
    complete = [seed for seed in found[0] if all(seed in own for own in found)]
    return np.array([[own[seed][0] for own in found] for seed in complete], np.float64).reshape(-1, len(arms))
