"""Rewards by name: ours, those of installed packages, and a user's own."""

from __future__ import annotations

from clearway.errors import PluginError, kind_and_reason
from clearway.plugins import find_plugin, imported, load_plugin, offered
from clearway.reward.reward import REWARDS, Reward
from clearway.reward.terms import RewardError
from clearway.spelling import did_you_mean


def reward_named(name: str | Reward) -> Reward:
    """The reward of a name: one of `REWARDS`, another package's (`plugins`), or a user's own as `package.module:name`.

    What is named is a `Reward`, or a function without arguments that gives one.

    Raises:
        RewardError: there is none.
        PluginError: two packages offer one of this name, or it cannot be imported.
    """
    if isinstance(name, Reward):
        return name
    if isinstance(name, str) and name in REWARDS:
        return REWARDS[name]
    if isinstance(name, str) and (plugin := find_plugin("rewards", name)):
        return _made(str(plugin), load_plugin(plugin))
    if not isinstance(name, str) or ":" not in name:
        names = (*REWARDS, *offered("rewards"))
        told = f"reward={name!r:.80} is unknown.{did_you_mean(name, names)}"
        raise RewardError(f"{told} Use one of {', '.join(map(repr, names))}, a Reward, or package.module:name")
    try:
        found = imported(name)
    except PluginError as fault:
        raise RewardError(f"reward={fault}") from fault
    return _made(f"reward={name!r}", found)


def _made(source: str, found: object) -> Reward:
    """What was found under a name, or what it gives when it is called."""
    try:
        made = found() if callable(found) else found
    except (Exception, SystemExit) as fault:  # it may raise anything
        reason = kind_and_reason(fault)
        raise RewardError(f"{source}: cannot be made ({reason}). Correct it") from fault
    if not isinstance(made, Reward):
        raise RewardError(f"{source}: gives {made!r:.60}, expected a clearway.Reward. Correct it")
    return made
