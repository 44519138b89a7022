"""Algorithms of other packages (`clearway.plugins`), behind a check of their classes.

An entry point of the group `clearway.algorithms` is a frozen dataclass derived from `Learner` (docs/python.md). Its
trainers and agents stand behind guards in `foreign` and `foreign_agent`.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import MISSING, fields

from clearway.errors import ClearwayError, PluginError, RunError, is_out_of_memory, kind_and_reason
from clearway.learn.kinds import field_types
from clearway.learn.learner import Learner
from clearway.learn.peers import LostPeer
from clearway.plugins import Plugin, find_plugin, load_plugin, place_in
from clearway.reward import Reward

CONSTANTS = {"algorithm": "ClassVar[str]", "acts_on": "ClassVar[str]", "sees_takes": "ClassVar[bool]"}
ARGUMENTS = (
    *("scenes", "targets", "reward", "seed", "out", "resume", "copy_to", "zone_level", "perturb", "takes", "device"),
    *("feature_store", "threads", "workers", "ray", "until_solved", "track", "on_begin", "show_progress"),
)
"""Arguments of `clearway.train`, which takes settings beside them."""


def plugged_algorithm(plugin: Plugin) -> type[Learner]:
    """The config class that a plugin is.

    Raises:
        PluginError: it cannot be imported, or is none that can be trained, kept and read again.
    """
    kind = load_plugin(plugin)
    if not isinstance(kind, type) or not issubclass(kind, Learner):
        raise PluginError(f"{plugin}: is {kind!r:.60}, expected a class derived from clearway.Learner. Ask its authors")
    if fault := _fault(kind, plugin.name):
        raise PluginError(f"{plugin}: {fault}")
    try:
        with faults_of(kind, "its class"):
            field_types(kind)
            kind()
    except RunError as refusal:
        raise PluginError(f"{plugin}: {refusal}") from refusal
    return kind


def _fault(kind: type[Learner], name: str) -> str:
    """Why a class is no algorithm of that name, with the remedy; empty where it is one."""
    for own in kind.__mro__:
        if issubclass(own, Learner) and "__dataclass_params__" not in vars(own):
            return f"{own.__name__} is no dataclass, and loses its settings. Write @dataclass(frozen=True) above it"
    settings = {field.name: field for field in fields(kind)}
    for constant, wanted in CONSTANTS.items():
        if constant in settings:
            return f"{constant} is among its settings. Write {constant}: {wanted}"
    found = getattr(kind, "algorithm", None)
    if found != name:
        return f"its algorithm is {found!r:.40}. Write algorithm: ClassVar[str] = {name!r}"
    for setting in settings.values():
        if not setting.init or (setting.default is MISSING and setting.default_factory is MISSING):
            return f"its setting {setting.name} has no default, or no place in the constructor. Give it both"
        if setting.name in ARGUMENTS:
            return f"its setting {setting.name} has the name of an argument of clearway.train. Rename it"
    if not callable(kind.trainer) or kind.trainer is Learner.trainer:
        return "has no method trainer(world, reward, seed). Give it one"
    return ""


@contextmanager
def faults_of(learner: Learner | type[Learner], what: str, passing: tuple[type[Exception], ...] = ()) -> Iterator[None]:
    """Tell of what an algorithm raises as its package's fault, in one line.

    Errors of clearway's own, a lack of memory, lost workers and what algorithms of ours raise pass as they are.

    Args:
        learner: the algorithm.
        what: is asked of it.
        passing: further errors that pass.

    Raises:
        PluginError: another package's algorithm failed.
    """
    try:
        yield
    except (Exception, SystemExit) as fault:  # another's code: anything can come of it; the user is told whose
        passes = isinstance(fault, (ClearwayError, LostPeer, *passing)) or is_out_of_memory(fault)
        plugin = None if passes else find_plugin("algorithms", learner.algorithm)
        if plugin is None:
            raise
        told = f"{what} failed ({kind_and_reason(fault)}){place_in(plugin, fault)}"
        raise PluginError(f"{plugin}: {told}. Ask its authors") from fault


def paid_by(learner: Learner, reward: Reward) -> Reward:
    """The reward as training pays it, see `Learner.paid`.

    Raises:
        RunError: the learner cannot be paid so.
        PluginError: another package's fails, or gives no reward.
    """
    with faults_of(learner, "paid"):
        paid: object = learner.paid(reward)
        if not isinstance(paid, Reward):
            raise TypeError(f"gives {paid!r:.40}, expected a Reward")
    return paid
