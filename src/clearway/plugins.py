"""Encoders, rewards, agents, importers, algorithms and experiments from other packages, by entry points.

A package offers one in its `pyproject.toml`, by a name of its own:

    [project.entry-points."clearway.encoders"]
    mean-colour = "my_package.encoders:MeanColour"

Looking names up imports none of them. What each kind has to be: `docs/python.md`.
"""

from __future__ import annotations

import sys
from collections.abc import Collection
from dataclasses import dataclass
from traceback import walk_tb
from typing import Literal, get_args

from clearway.errors import PluginError, kind_and_reason
from clearway.spelling import did_you_mean

Kind = Literal["encoders", "rewards", "agents", "importers", "algorithms", "experiments"]
KINDS: tuple[Kind, ...] = get_args(Kind)

BUILT_IN: dict[Kind, tuple[str, ...]] = {
    "encoders": ("auto", "resnet50", "random-resnet50", "depth-grid", "clearway"),
    "rewards": ("collision-aware", "shortest", "bump", "clearance"),
    "agents": ("random", "shortest path"),
    "importers": ("thor-v1", "floor-plan", "images", "savn", "avd", "ai2thor", "mjcf", "miniworld"),
    "algorithms": ("ppo", "a2c", "a3c", "bc", "q-learning", "recurrent", "adapt", "default", "paper", "paper-a3c"),
    "experiments": (
        *("table1", "fig3", "fig4", "table2", "table3", "fig5", "fig6", "analysis", "memory", "quality"),
        *("zones-or-step", "shuffles", "step-size", "clipping", "zone-time", "zone-levels", "ablations"),
        *("across-rooms", "perturbed", "off-grid", "rewards", "all"),
    ),
}
"""Names that are ours, which no other package can take."""


@dataclass(frozen=True)
class Plugin:
    """Something that another package offers; not imported yet.

    Attributes:
        kind: what it is.
        name: by which a user asks for it.
        package: that offers it, as it is installed.
        version: of the package.
        target: module and name in it, such as "my_package.encoders:MeanColour".
    """

    kind: Kind
    name: str
    package: str
    version: str
    target: str

    def __str__(self) -> str:
        return f"{self.kind.removesuffix('s')} {self.name} of the package {self.package} {self.version}"


def plugins(kind: Kind) -> list[Plugin]:
    """What installed packages offer of a kind, by name; names that cannot be used are among them, see `problem`."""
    from importlib.metadata import entry_points

    found = {
        Plugin(
            kind,
            entry.name,
            entry.dist.name if entry.dist else "unknown",
            entry.dist.version if entry.dist else "unknown",
            entry.value,
        )
        for entry in entry_points(group=f"clearway.{kind}")
    }
    return sorted(found, key=lambda plugin: (plugin.name, plugin.package))


def offered(kind: Kind) -> list[str]:
    """Names that installed packages offer of a kind, without our own."""
    return sorted({plugin.name for plugin in plugins(kind)}.difference(BUILT_IN[kind]))


def problem(plugin: Plugin, all_of_kind: list[Plugin]) -> str:
    """Why a plugin cannot be asked for by its name, with the remedy; empty where it can."""
    if plugin.name in BUILT_IN[plugin.kind]:
        return f"{plugin}: clearway has one of this name itself. Rename it, or uninstall {plugin.package}"
    others = [other for other in all_of_kind if other.name == plugin.name and other != plugin]
    if others:
        return f"{plugin}: {others[0].package} offers one of this name too. Uninstall one of the two packages"
    return ""


def unknown(kind: Kind, name: object, ours: Collection[str]) -> str:
    """What is said of a name that neither is one of ours nor is offered by a package, with the remedy."""
    known = (*ours, *offered(kind))
    return f"no such {kind.removesuffix('s')}.{did_you_mean(name, known)} Use one of {', '.join(known)}"


def find_plugin(kind: Kind, name: str) -> Plugin | None:
    """The plugin of that name; None where there is none, or the name is built in.

    Raises:
        PluginError: two packages offer one of this name.
    """
    if name in BUILT_IN[kind]:
        return None
    found = plugins(kind)
    plugin = next((plugin for plugin in found if plugin.name == name), None)
    if plugin is not None and (fault := problem(plugin, found)):
        raise PluginError(fault)
    return plugin


def place_in(plugin: Plugin, fault: BaseException) -> str:
    """Where in a plugin's package something was raised, " at FILE:LINE"; empty where it was not raised there."""
    package = plugin.target.partition(":")[0].partition(".")[0]
    found = ""
    for frame, line in walk_tb(fault.__traceback__):
        if str(frame.f_globals.get("__name__")).partition(".")[0] == package:  # the last one is the innermost
            found = f" at {frame.f_code.co_filename}:{line}"
    return found


def load_plugin(plugin: Plugin) -> object:
    """What a plugin is, imported.

    Raises:
        PluginError: it cannot be imported, whatever its package raises.
    """
    from importlib.metadata import EntryPoint

    try:
        return EntryPoint(plugin.name, plugin.target, f"clearway.{plugin.kind}").load()
    except (Exception, SystemExit) as fault:  # another's code: anything can come of it; the user is told whose
        remedy = f"Ask its authors, or uninstall {plugin.package}"
        told = f"cannot be imported ({kind_and_reason(fault)}){place_in(plugin, fault)}"
        raise PluginError(f"{plugin}: {plugin.target} {told}. {remedy}") from fault


def plugin_of(kind: Kind, name: str) -> Plugin:
    """The plugin of that name.

    Raises:
        PluginError: no installed package offers one, or two do.
    """
    plugin = find_plugin(kind, name)
    if plugin is None:
        names = ", ".join(offered(kind)) or "none"
        fault = f"{kind.removesuffix('s')} {name}: no installed package offers one of this name"
        raise PluginError(f"{fault}. Install one that does, or use one of these: {names}")
    return plugin


def imported(path: str) -> object:
    """What a user names as `package.module:name`; a module may lie in the current folder, behind what is installed.

    Raises:
        PluginError: it is no such path, or cannot be imported, whatever the module raises.
    """
    from importlib import import_module

    module, colon, name = path.partition(":")
    if not colon or not module or not name:
        raise PluginError(f"{path!r:.80}: expected package.module:name. Name one so")
    if "" not in sys.path:
        sys.path.append("")
    try:
        return getattr(import_module(module), name)
    except (Exception, SystemExit) as fault:  # another's code: anything can come of it
        reason = kind_and_reason(fault)
        raise PluginError(f"{path}: cannot be loaded ({reason}). Check the module and the name") from fault
