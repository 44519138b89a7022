"""Runs of the first format of run.json, in which every algorithm had the settings of all three."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from clearway.learn.learner import Learner, setting_names
from clearway.learn.ppo import PPO


def own_settings(kind: type[Learner], settings: Mapping[str, Any]) -> dict[str, Any]:
    """The algorithm's own settings among those of a run of the first format, which are PPO's.

    The others had no effect, or one value that the algorithm allowed.
    """
    foreign = set(setting_names(PPO)) - set(setting_names(kind))
    return {name: value for name, value in settings.items() if name not in foreign}
