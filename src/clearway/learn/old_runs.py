"""Runs that earlier versions recorded in another way.

In the first format of run.json every algorithm had the settings of all three. Later on, the reward and the algorithm's
settings could each clip, and run.json held the reward as it was given rather than as it was paid. Settings that came
later than a run have the value that changes nothing, `LATER`; names of planned runs leave them out where they have it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from types import MappingProxyType
from typing import Any

from clearway.learn.a3c.config import A3C
from clearway.learn.learner import Learner, setting_names
from clearway.learn.ppo import PPO
from clearway.reward import Reward

LATER: Mapping[str, object] = MappingProxyType(
    {"goals": "given", "sent_gradients": "float32", "episode_targets": "drawn", "lr_warm_up": 0}
)
"""Settings that earlier versions did not have, and what was done then; A3C kept its targets."""


def with_later(kind: type[Learner], settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of a run, with those that came later where the algorithm has them."""
    then = {**LATER, "episode_targets": "kept"} if issubclass(kind, A3C) else LATER
    return {name: value for name, value in then.items() if name in setting_names(kind)} | dict(settings)


def without_later(learner: Learner) -> dict[str, Any]:
    """Settings as they were written before those of `LATER`, where these change nothing."""
    before = with_later(type(learner), {})
    return {name: value for name, value in asdict(learner).items() if name not in before or value != before[name]}


def own_settings(kind: type[Learner], settings: Mapping[str, Any]) -> dict[str, Any]:
    """The algorithm's own settings among those of a run of the first format, which are PPO's.

    The others had no effect, or one value that the algorithm allowed.
    """
    foreign = set(setting_names(PPO)) - set(setting_names(kind))
    return {name: value for name, value in settings.items() if name not in foreign}


def clipped_once(learner: Learner, reward: Reward) -> tuple[Learner, Reward]:
    """Settings and reward that agree in clipping: either of them was enough."""
    if reward.clip and learner.clip_rewards is False:
        learner = replace(learner, **{"clip_rewards": True})
    return learner, learner.paid(reward)
