"""What `clearway reproduce` is asked for, checked once for the command line, Python, and what a folder's file says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import get_args

from clearway.choices import BudgetName, LearnerName, RoomName
from clearway.errors import ArgumentError
from clearway.experiments.rewards import NAME as REWARDS_EXPERIMENT
from clearway.experiments.setting import DEFAULT_REWARDS
from clearway.spelling import did_you_mean


@dataclass(frozen=True)
class ReproduceRequest:
    """What to reproduce.

    Attributes:
        names: of the experiments.
        out: folder of everything, a path or a text; what is complete there is kept.
        budget: name of the budget.
        dumps: scene files, paths or texts; none: the default rooms.
        rooms: which of the default rooms; None: as the budget says.
        frames: of every learner; None: as the budget says.
        encoder: for the default rooms.
        seeds: how many; None: as the budget says.
        first_seed: of them; the others follow it.
        learners: names among `setting.LEARNERS`.
        rewards: names of those that the experiment `rewards` compares, see `reward.reward_named`; None: shipped ones,
            where that experiment is asked for.
        changes: of settings of every learner, such as "lr_start=0.002".
        workers: jobs side by side; None: as many as cores and memory allow.
        threads: of each job.
        ray: do the jobs on a Ray cluster: "local", "auto" or an address; None: in processes of this machine.
        commands: that asked for it, for the report.
        packages: that offer experiments among the names, "NAME VERSION" by the experiment's name; `reproduce` fills it
            in. A program's own experiments, and ours, are of none.

    Raises:
        ArgumentError: something of it is of the wrong kind, out of range, or unknown; but names of experiments may be
            unknown here: packages come and go.
    """

    names: Sequence[str]
    out: Path
    budget: BudgetName
    dumps: Sequence[Path] = ()
    rooms: Sequence[RoomName] | None = None
    frames: int | None = None
    encoder: str = "auto"
    seeds: int | None = None
    first_seed: int = 0
    learners: Sequence[LearnerName] = ("paper", "default")
    rewards: Sequence[str] | None = None
    changes: Sequence[str] = ()
    workers: int | None = None
    threads: int = 1
    ray: str | None = None
    commands: Sequence[str] = ()
    packages: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Texts that name folders and files become paths; all else is checked."""
        object.__setattr__(self, "out", _path("out", self.out))
        object.__setattr__(self, "dumps", tuple(_path("dumps", path) for path in _listed("dumps", self.dumps)))
        _check_words("budget", [self.budget], get_args(BudgetName))
        _check_words("learners", self.learners, get_args(LearnerName))
        if self.rooms is not None:
            _check_words("rooms", self.rooms, get_args(RoomName))
        texts = {name: getattr(self, name) for name in ("names", "changes", "commands")} | {"rewards": self.compared}
        for name, given in texts.items():
            if others := [text for text in _listed(name, given) if not isinstance(text, str)]:
                raise ArgumentError(f"{name}: holds {others[0]!r:.40}, expected texts. Correct it")
        if not self.names:
            raise ArgumentError("names: no experiment is named. Name some")
        if len({*self.names}) < len(self.names):
            raise ArgumentError(f"names={list(self.names)!r:.80}: expected each once. Correct it")
        if self.rewards is not None and REWARDS_EXPERIMENT not in self.names:
            raise ArgumentError("rewards are those of the experiment rewards. Name it, too, or leave them out")
        if len({*self.compared}) < max(2, len(self.compared)):
            raise ArgumentError(f"rewards={list(self.compared)!r:.80}: expected two or more, each once. Correct it")
        for name, least in (("frames", 1), ("seeds", 1), ("first_seed", 0), ("workers", 1), ("threads", 1)):
            _check_number(name, getattr(self, name), least, optional=name not in ("first_seed", "threads"))
        for name, text in (("encoder", self.encoder), ("ray", self.ray or "")):
            if not isinstance(text, str):
                raise ArgumentError(f"{name}={text!r:.40}: expected a text. Correct it")
        given = "and scene files (--scenes; dumps in Python)"
        if self.dumps and self.rooms:
            told = f"rooms={self.rooms[0]}: default rooms, {given} stand in their place"
            raise ArgumentError(f"{told}. Give one of the two")
        if self.dumps and self.encoder != "auto":
            raise ArgumentError(f"encoder={self.encoder}: for default rooms, {given} have theirs. Give one of the two")
        if self.workers is not None and self.ray not in (None, "local"):
            told = f"ray={self.ray}: says how many fit, and --workers (workers in Python) are this machine's"
            raise ArgumentError(f"{told}. Leave one out")
        if not isinstance(self.packages, Mapping) or not all(isinstance(t, str) for t in self.packages.values()):
            raise ArgumentError(f"packages={self.packages!r:.40}: expected texts by name. Correct it")

    @property
    def compared(self) -> Sequence[str]:
        """Names of the rewards that the experiment `rewards` compares, where it is asked for."""
        return DEFAULT_REWARDS if self.rewards is None else self.rewards


def _path(name: str, given: object) -> Path:
    if not isinstance(given, str | Path):
        raise ArgumentError(f"{name}: holds {given!r:.40}, expected a path. Correct it")
    return Path(given)


def _listed(name: str, given: object) -> Sequence[object]:
    """What is given, a list; a text alone would be taken letter by letter."""
    if not isinstance(given, list | tuple):
        raise ArgumentError(f"{name}={given!r:.40}: expected a list. Correct it")
    return given


def _check_words(name: str, given: object, known: Sequence[str]) -> None:
    """Raise ArgumentError where it is no list of known words, or an empty one."""
    words = _listed(name, given)
    unknown = [word for word in words if word not in known]
    if unknown or not words:
        one = f"{name}={unknown[0] if unknown else words!r:.40}"
        told = did_you_mean(unknown[0], known) if unknown else ""
        raise ArgumentError(f"{one}: expected {'one' if unknown else 'some'} of {', '.join(known)}.{told} Correct it")


def _check_number(name: str, given: object, least: int, *, optional: bool) -> None:
    """Raise ArgumentError where it is no whole number of at least that; None is one where it is optional."""
    if given is None and optional:
        return
    if type(given) is not int or given < least:
        raise ArgumentError(f"{name}={given!r:.40}: expected a whole number of at least {least}. Correct it")
