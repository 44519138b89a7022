"""What shapes results beside settings and seed: the code, versions of packages, and the machine."""

from __future__ import annotations

import os
import platform
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from clearway.plugins import Plugin, find_plugin, plugins
from clearway.reward import Reward
from clearway.spread.workers import core_count
from clearway.version import __version__

PACKAGES = ("torch", "numpy", "scipy", "gymnasium", "mujoco", "transformers")
CPU_INFO = Path("/proc/cpuinfo")
GIT_LIMIT_S = 10.0


def package_versions() -> dict[str, str]:
    """Versions of Python, clearway and the packages that shape results; of a checkout its `commit`, too."""
    found = {"python": platform.python_version(), "clearway": __version__}
    sources = Path(__file__).parents[2]
    if sources.name == "src" and (commit := _commit(sources.parent)) is not None:
        found["commit"] = commit
    return found | {name: _installed_version(name) for name in PACKAGES}


def plugin_versions(algorithm: str, reward: Reward) -> dict[str, str]:
    """Package and version of an algorithm, and of a reward with terms of its own, where packages offer them."""
    found = {"algorithm": find_plugin("algorithms", algorithm), "reward": _reward_plugin(reward)}
    return {kind: f"{plugin.package} {plugin.version}" for kind, plugin in found.items() if plugin is not None}


def _reward_plugin(reward: Reward) -> Plugin | None:
    """What offers a reward, by where the code of its terms stands; one of our terms alone is all in the record."""
    packages = {_top(type(term).__module__) for term in reward.terms} - {"clearway"}
    return (
        next((plugin for plugin in plugins("rewards") if _top(plugin.target) in packages), None) if packages else None
    )


def _top(module: str) -> str:
    """The outermost package of a module."""
    return module.partition(":")[0].partition(".")[0]


@cache
def _commit(checkout: Path) -> str | None:
    """Of a checkout, "-dirty" behind it where files that it tracks differ; None: it is none, or git tells nothing."""
    if not (checkout / ".git").exists():
        return None
    words = ["git", "-C", str(checkout), "describe", "--always", "--dirty", "--exclude=*", "--abbrev=10"]
    try:
        told = subprocess.run(words, capture_output=True, text=True, timeout=GIT_LIMIT_S, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return told.stdout.strip()


@cache
def _installed_version(package: str) -> str:
    """As its metadata says, which takes milliseconds to read."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def hardware(device: str | None = None) -> dict[str, Any]:
    """Processor, memory, usable cores and threads of this machine; whether it multiplies bfloat16.

    device: of torch, told of too where one is given; bfloat16 is then the device's, else the processor's.
    """
    import torch

    from clearway.model.precision import multiplies_bfloat16

    where = torch.device(device or "cpu")
    return {
        "machine": platform.machine(),
        "system": platform.system(),
        "processor": _processor(),
        "memory_gib": _memory_gib(),
        "cores": core_count(),
        "threads": torch.get_num_threads(),
        "bfloat16": multiplies_bfloat16(where),
        **({} if device is None else {"device": device}),
        **({"gpu": torch.cuda.get_device_name(where)} if where.type == "cuda" else {}),
    }


def facts_text(facts: dict[str, Any]) -> str:
    """Facts in a line, for people."""
    return ", ".join(f"{name} {value}" for name, value in facts.items())


def _processor() -> str:
    """The processor's model as the system names it."""
    if CPU_INFO.exists():
        for line in CPU_INFO.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or "unknown"


def _memory_gib() -> float | None:
    """Physical memory; None where the system does not say."""
    names = ("SC_PHYS_PAGES", "SC_PAGE_SIZE")
    if not all(name in getattr(os, "sysconf_names", {}) for name in names):
        return None
    pages, size = (os.sysconf(name) for name in names)
    return round(pages * size / 2**30, 1)
