"""`clearway reproduce`: plan the experiments, do what is missing, and gather what came of it."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from clearway.errors import ClearwayError, PluginError, RunError
from clearway.experiments.board import board
from clearway.experiments.budget import BUDGETS
from clearway.experiments.catalogue import EXPERIMENTS, experiment
from clearway.experiments.correction import corrected, not_judged
from clearway.experiments.expected_time import told_time
from clearway.experiments.job import is_done, unfinished
from clearway.experiments.jobs import affordable_workers, run_jobs
from clearway.experiments.plan import Job, merged
from clearway.experiments.request import ReproduceRequest
from clearway.experiments.request_file import REQUEST_FILE, keep_request, read_request, with_earlier
from clearway.experiments.rewards import NAME as REWARDS_EXPERIMENT
from clearway.experiments.section import Section
from clearway.experiments.setting import Setting, named_rewards, prepare
from clearway.plugins import find_plugin
from clearway.torch_threads import torch_threads


@dataclass(frozen=True)
class Reproduction:
    """What came of it.

    Attributes:
        commands: that asked for the experiments.
        changes: of settings of every learner.
        setting: that they share.
        jobs: all that they need.
        sections: one for each.
    """

    commands: tuple[str, ...]
    changes: tuple[str, ...]
    setting: Setting
    jobs: list[Job]
    sections: list[Section]


LEARNS_NOTHING = "a smoke run's trainings end before anything is learnt"
SMOKE_RUN = "Not judged: a smoke run."


def reproduce(
    request: ReproduceRequest, show_progress: bool = False, tell: Callable[[str], None] | None = None
) -> Reproduction:
    """Do what is missing of the experiments and gather their sections.

    Experiments that earlier commands asked for with all else alike keep their place in the report.

    Args:
        request: see there.
        show_progress: draw progress bars.
        tell: told in a line, before the first run, how long all will take on this machine, and where the user
            interrupts it, how to go on; None: nobody asks.

    Raises:
        ClearwayError: a scene cannot be had, a learner cannot be paid by a reward, no process could import a reward's
            terms, or a run failed; what is complete stays.
        KeyboardInterrupt: the user interrupted; the same command goes on.

    Warns:
        UserWarning: the folder holds another reproduction, whose report this one's replaces.
    """
    request = replace(request, packages=_packages(request.names))  # who mistypes one need not wait for the scenes
    setting = _setting(request, show_progress=show_progress)
    jobs = planned(setting, request.names)  # before it is kept: what cannot be asked of these scenes is refused
    left = [job for job in jobs if not is_done(request.out, job)]
    for job in jobs:
        _ = job.run.paid
    for job in left:
        job.run.reward.check_sent()
    keep_request(request)
    try:
        _run_left(request, jobs, left, show_progress, tell)
        return _gathered(with_earlier(request), setting)  # others may have been asked for meanwhile
    except KeyboardInterrupt:
        if tell is not None:
            done = sum(is_done(request.out, job) for job in jobs)
            tell(f"{request.out}: interrupted; {done} of {len(jobs)} runs are complete. The same command goes on")
        raise


def _run_left(
    request: ReproduceRequest,
    jobs: Sequence[Job],
    left: Sequence[Job],
    show_progress: bool,
    tell: Callable[[str], None] | None,
) -> None:
    """Do what is left of the jobs; other arguments as of `reproduce`."""
    workers = request.workers if request.ray else affordable_workers(request.workers, request.threads)
    if tell is not None:
        tell(told_time(request.out, jobs, left, workers, request.threads))
    with board(request.out, jobs, show_progress) as show:
        run_jobs(request.out, left, workers=workers, threads=request.threads, show=show, ray=request.ray)


def gather(out: Path | str) -> Reproduction:
    """The sections of a reproduction from what is complete by now; trains nothing.

    Raises:
        ClearwayError: the folder holds no reproduction, or its scenes cannot be read.
    """
    request = read_request(Path(out))
    return _gathered(request, _setting(replace(request, rewards=None), build=False))


def _packages(names: Sequence[str]) -> dict[str, str]:
    """The package and its version, by name, of experiments that a package offers.

    Raises:
        ClearwayError: nobody offers one, or it cannot be used.
    """
    found = {}
    for name in names:
        experiment(name)
        if name not in EXPERIMENTS and (plugin := find_plugin("experiments", name)):
            found[name] = f"{plugin.package} {plugin.version}"
    return found


def _gathered(request: ReproduceRequest, setting: Setting) -> Reproduction:
    jobs, sections = list[Job](), list[Section]()
    known = _known(request)
    try:
        if REWARDS_EXPERIMENT in known:
            setting = replace(setting, rewards=named_rewards(request.compared))
    except ClearwayError as fault:
        told = f"{request.out / REQUEST_FILE}: {fault}"
        if isinstance(fault.__cause__, PluginError):  # its module is not found
            told += ". Run the command in the folder where a module of your own lies"
        if known == [REWARDS_EXPERIMENT]:
            raise RunError(told) from fault
        warnings.warn(f"{told}. The report leaves the experiment {REWARDS_EXPERIMENT} out", stacklevel=3)
        known.remove(REWARDS_EXPERIMENT)
    with torch_threads(1):  # the work is too small for more, and stands still for them while trainings have the cores
        for found in map(experiment, known):
            own = found.jobs(setting)
            missing = unfinished(setting.out, own)  # before it is read: a run that ends meanwhile may be left out of it
            section = found.section(setting)
            section = not_judged(section, LEARNS_NOTHING, SMOKE_RUN) if setting.budget.mark else corrected(section)
            sections.append(replace(section, missing=tuple(dict.fromkeys((*missing, *section.missing)))))
            jobs += own
    _check_files(sections)
    return Reproduction(tuple(request.commands), tuple(request.changes), setting, merged(jobs), sections)


def _check_files(sections: Sequence[Section]) -> None:
    """Raise RunError where two tables, or two figures, of the report would be one file."""
    for called in ("tables", "pictures"):
        owners: dict[str, str] = {}
        for section in sections:
            for part in getattr(section, called):
                if part.name in owners:
                    both = f"experiments {owners[part.name]} and {section.name}"
                    raise RunError(f"{both}: both call one of their {called} {part.name!r:.60}. Rename one")
                owners[part.name] = section.name


def _known(request: ReproduceRequest) -> list[str]:
    """The request's experiments without those that nobody offers here any more, of which a warning tells.

    Raises:
        ClearwayError: none is left.
    """
    known, faults = list[str](), list[str]()
    for name in request.names:
        try:
            experiment(name)
            known.append(name)
        except PluginError as fault:
            faults.append(str(fault))
        except RunError:
            faults.append(_told_gone(name, request.packages.get(name)))
    path = request.out / REQUEST_FILE
    if not known:
        raise RunError(f"{path}: asks for {faults[0]}")
    for told in faults:
        warnings.warn(f"{path}: the report leaves out {told}", stacklevel=4)
    return known


def _told_gone(name: str, package: str | None) -> str:
    """What is said of an experiment that nothing here offers, with the remedy."""
    if package:
        return f"experiment {name!r:.40} of the package {package:.80}, which is not installed here. Install it"
    remedy = "Install the package that does, or run the program that made this folder"
    return f"experiment {name!r:.40}, which nothing that is installed here offers. {remedy}"


def _setting(request: ReproduceRequest, *, build: bool = True, show_progress: bool = False) -> Setting:
    return prepare(
        request.out,
        BUDGETS[request.budget].changed(request.rooms, request.frames),
        dumps=request.dumps,
        encoder=request.encoder,
        seeds=request.seeds,
        first_seed=request.first_seed,
        learners=request.learners,
        rewards=request.compared,
        changes=request.changes,
        build=build,
        show_progress=show_progress,
    )


def planned(setting: Setting, names: Sequence[str]) -> list[Job]:
    """All jobs of some experiments, each run once with all that it is to be tried on."""
    return merged(job for name in names for job in experiment(name).jobs(setting))
