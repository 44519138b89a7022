"""`clearway reproduce`: plan the experiments, do what is missing, and gather what came of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from clearway.experiments.board import board
from clearway.experiments.budget import BUDGETS, BudgetName
from clearway.experiments.catalogue import EXPERIMENTS, ExperimentName
from clearway.experiments.job import is_done
from clearway.experiments.local import affordable_workers, run_jobs
from clearway.experiments.plan import Job, merged
from clearway.experiments.section import Section
from clearway.experiments.setting import PUBLISHED, RECIPE, Setting, prepare


@dataclass(frozen=True)
class ReproduceRequest:
    """What to reproduce.

    Attributes:
        names: of the experiments.
        out: folder of everything; what is complete there is kept.
        budget: name of the budget.
        dumps: scene files; none: the default rooms.
        encoder: for the default rooms.
        seeds: how many; None: as the budget says.
        learners: names among `setting.LEARNERS`.
        workers: jobs side by side; None: as many as cores and memory allow.
        threads: of each job.
    """

    names: Sequence[ExperimentName]
    out: Path
    budget: BudgetName
    dumps: Sequence[Path] = ()
    encoder: str = "auto"
    seeds: int | None = None
    learners: Sequence[str] = (PUBLISHED, RECIPE)
    workers: int | None = None
    threads: int = 1


@dataclass(frozen=True)
class Reproduction:
    """What came of it: the setting, and a section for each experiment."""

    setting: Setting
    sections: list[Section]


def reproduce(request: ReproduceRequest, show_progress: bool = False) -> Reproduction:
    """Do what is missing of the experiments and gather their sections.

    Raises:
        ClearwayError: a scene cannot be had, or a run failed; what is complete stays.
        KeyboardInterrupt: the user interrupted; the same command goes on.
    """
    setting = prepare(
        request.out,
        BUDGETS[request.budget],
        dumps=request.dumps,
        encoder=request.encoder,
        seeds=request.seeds,
        learners=request.learners,
        show_progress=show_progress,
    )
    jobs = planned(setting, request.names)
    left = [job for job in jobs if not is_done(request.out, job)]
    workers = affordable_workers(request.workers, request.threads)
    with board(request.out, jobs, show_progress) as show:
        run_jobs(request.out, left, workers=workers, threads=request.threads, show=show)
    return Reproduction(setting, [EXPERIMENTS[name].section(setting) for name in request.names])


def planned(setting: Setting, names: Sequence[ExperimentName]) -> list[Job]:
    """All jobs of some experiments, each run once with all that it is to be tried on."""
    return merged(job for name in names for job in EXPERIMENTS[name].jobs(setting))
