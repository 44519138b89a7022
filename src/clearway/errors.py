"""Errors that a user can cause and mend; the command line prints them as one line and exits with 2."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path


def printable(text: str) -> str:
    """A text with what is no printable character shown by its code; else a file's names could speak to the terminal."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def reason_of(fault: BaseException) -> str:
    """What was wrong, in one line, for an error of ours that names the file itself."""
    told = getattr(fault, "strerror", None) or fault
    return " ".join(str(told).split())[:200] or type(fault).__name__


def kind_and_reason(fault: BaseException) -> str:
    """What code of another has raised, in one line, such as "ValueError: no camera"."""
    return f"{type(fault).__name__}: {' '.join(str(fault).split())[:200]}"


def install_hint(extra: str) -> str:
    """How to install one of our extras into the Python that runs: from the clone that this is, else from one."""
    clone = Path(__file__).parents[2]
    source = clone if (clone / "pyproject.toml").exists() else "."
    where = "" if source == clone else ", in a clone of clearway"
    return f"Install it: {pip_install(f'{source}[{extra}]')}{where}"


def pip_install(requirement: str) -> str:
    """The command that installs into the Python that runs, fit for a shell."""
    return f"{shlex.quote(sys.executable)} -m pip install '{requirement}'"


def is_out_of_memory(fault: BaseException) -> bool:
    """Whether an allocation failed: PyTorch, and what is written in C++, say so by their words alone."""
    told = str(fault).lower()
    return isinstance(fault, MemoryError) or any(words in told for words in ("allocate memory", "out of memory"))


class ClearwayError(Exception):
    """Bad input or a missing requirement. The message says what, where and the remedy, in one line.

    Names out of a file may stand in it, which are made printable.
    """

    def __init__(self, message: str) -> None:
        super().__init__(printable(message))


class ArgumentError(ClearwayError, TypeError, ValueError):
    """An argument of a function of `clearway` that is of the wrong kind, or out of range."""


class SceneError(ClearwayError):
    """A scene that cannot be used.

    Args:
        source: the file (or the name, for a scene made in memory) that holds the fault.
        problem: what was expected and what was found.
        remedy: what the user can do about it.
        dataset: the array or HDF5 dataset at fault; empty where the whole file is.
    """

    def __init__(self, source: str | Path, problem: str, remedy: str, dataset: str = "") -> None:
        where = f"{source}, dataset '{dataset}'" if dataset else f"{source}"
        super().__init__(f"{where}: {problem}. {remedy}")
        self.source, self.dataset, self.problem, self.remedy = str(source), dataset, problem, remedy

    def __reduce__(self) -> tuple:
        """Pickle by the constructor's arguments, so that the error crosses process borders whole."""
        return type(self), (self.source, self.problem, self.remedy, self.dataset)


class EncoderError(ClearwayError):
    """A picture encoder that cannot be loaded or does not fit the scene."""


class RenderError(ClearwayError):
    """Rendering is not possible on this machine."""


class EnvError(ClearwayError, ValueError):
    """An environment that cannot be made as asked, or an action or a reset option that it does not know."""


class RunError(ClearwayError):
    """A run folder, checkpoint or training configuration that cannot be used."""


class DeployError(ClearwayError, ValueError):
    """An exported agent that cannot be used, or a picture that an agent cannot take."""


class PluginError(ClearwayError):
    """Something that another package offers and that cannot be used."""


class AgentError(ClearwayError):
    """An agent that cannot walk here, or does what no agent may."""
