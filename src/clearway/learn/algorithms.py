"""The algorithms by name. Another one is a file with a config class, see `learner`, and a line here.

That of another package needs no line: it is a class derived from `Learner` under an entry point, see `plugged`.
"""

from __future__ import annotations

from typing import TypeVar

from clearway.errors import RunError
from clearway.learn.a2c import A2C
from clearway.learn.a3c.config import A3C
from clearway.learn.adapt import Adapt
from clearway.learn.bc import BC
from clearway.learn.learner import Learner, setting_names
from clearway.learn.plugged import plugged_algorithm
from clearway.learn.ppo import PPO
from clearway.learn.q_learning import QLearning
from clearway.learn.recurrent import Recurrent
from clearway.plugins import find_plugin, unknown

OURS = (PPO, A2C, A3C, BC, QLearning, Recurrent, Adapt)
ALGORITHMS: dict[str, type[Learner]] = {kind.algorithm: kind for kind in OURS}
Kind = TypeVar("Kind", bound=Learner)


OWN_WAY = {"episode_targets"}
"""Settings in which algorithms differ by nature."""


def algorithm(name: str) -> type[Learner]:
    """The config class of that name, ours or another package's.

    Raises:
        RunError: there is none.
        PluginError: two packages offer one of this name, or it cannot be used.
    """
    if name in ALGORITHMS:
        return ALGORITHMS[name]
    plugin = find_plugin("algorithms", name)
    if plugin is None:
        raise RunError(f"algorithm {name!r:.40}: {unknown('algorithms', name, ALGORITHMS)}")
    return plugged_algorithm(plugin)


def carried_over(learner: Learner, kind: type[Kind]) -> Kind:
    """The settings of another algorithm: this learner's where both have a setting of that name, else its own defaults.

    Of `OWN_WAY` only what was set otherwise than by default is carried.

    Raises:
        RunError: they cannot work together.
    """
    shared = set(setting_names(type(learner))) & set(setting_names(kind))
    left = {name for name in OWN_WAY & shared if getattr(learner, name) == getattr(type(learner), name)}
    return kind(**{name: getattr(learner, name) for name in shared - left})
