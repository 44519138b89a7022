"""Learners that are told more than pictures, for other experiments' tables: Q-learning and behaviour cloning."""

from __future__ import annotations

from dataclasses import replace

from clearway.experiments.groups import Group, compared
from clearway.experiments.plan import TargetSets
from clearway.experiments.setting import Setting
from clearway.learn.bc import BC
from clearway.learn.learner import Learner
from clearway.learn.q_learning import QLearning
from clearway.reward import SHORTEST

OTHERS: tuple[Learner, ...] = (QLearning(), BC())
ABOUT_OTHERS = (
    "Q-learning (tabular) is told its pose, behaviour cloning shortest paths. Both learn under the shortest-path "
    "reward, for the frames beside their names; changes of settings do not change them."
)


def other_learners(setting: Setting, targets: TargetSets | None = None) -> list[Group]:
    """Tabular Q-learning, which is told poses, and behaviour cloning, which is told shortest paths: a group each.

    They are trained for their own frames, or the budget's where these are fewer.

    Args:
        setting: see there.
        targets: to be trained and tried on; None: the paper's.
    """
    most = setting.budget.default_frames
    learners = {
        each.algorithm: each if most is None else replace(each, frames=min(each.frames, most)) for each in OTHERS
    }
    return compared(replace(setting, learners=learners), (SHORTEST,), targets=targets)
