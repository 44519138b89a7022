"""`clearway reproduce`: plan the experiments, do what is missing, and gather what came of it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from clearway.choices import BudgetName, ExperimentName, LearnerName, RoomName
from clearway.errors import RunError
from clearway.experiments.board import board
from clearway.experiments.budget import BUDGETS
from clearway.experiments.catalogue import EXPERIMENTS
from clearway.experiments.cluster import run_jobs_on_ray
from clearway.experiments.job import is_done
from clearway.experiments.local import affordable_workers, run_jobs
from clearway.experiments.plan import Job, merged
from clearway.experiments.section import Section
from clearway.experiments.setting import Setting, prepare
from clearway.files import written_whole


@dataclass(frozen=True)
class ReproduceRequest:
    """What to reproduce.

    Attributes:
        names: of the experiments.
        out: folder of everything; what is complete there is kept.
        budget: name of the budget.
        dumps: scene files; none: the default rooms.
        rooms: which of the default rooms; None: as the budget says.
        frames: of every learner; None: as the budget says.
        encoder: for the default rooms.
        seeds: how many; None: as the budget says.
        learners: names among `setting.LEARNERS`.
        workers: jobs side by side; None: as many as cores and memory allow.
        threads: of each job.
        command: that asked for it, for the report.
        ray: do the jobs on a Ray cluster: "local", "auto" or an address; None: in processes of this machine.
    """

    names: Sequence[ExperimentName]
    out: Path
    budget: BudgetName
    dumps: Sequence[Path] = ()
    rooms: Sequence[RoomName] | None = None
    frames: int | None = None
    encoder: str = "auto"
    seeds: int | None = None
    learners: Sequence[LearnerName] = ("published", "default")
    workers: int | None = None
    threads: int = 1
    ray: str | None = None
    command: str = ""


@dataclass(frozen=True)
class Reproduction:
    """What came of it: the setting, and a section for each experiment."""

    command: str
    setting: Setting
    sections: list[Section]


REQUEST_FILE = "reproduction.json"
HOW_NOT_WHAT = ("out", "workers", "threads", "ray")  # parts of a request that a report does not depend on


def reproduce(request: ReproduceRequest, show_progress: bool = False) -> Reproduction:
    """Do what is missing of the experiments and gather their sections.

    Raises:
        ClearwayError: a scene cannot be had, or a run failed; what is complete stays.
        KeyboardInterrupt: the user interrupted; the same command goes on.
    """
    setting = _setting(request, show_progress)
    with written_whole(request.out / REQUEST_FILE) as part:
        part.write_text(json.dumps(_request_json(request), indent=2) + "\n", encoding="utf-8")
    jobs = planned(setting, request.names)
    left = [job for job in jobs if not is_done(request.out, job)]
    with board(request.out, jobs, show_progress) as show:
        if request.ray is None:
            workers = affordable_workers(request.workers, request.threads)
            run_jobs(request.out, left, workers=workers, threads=request.threads, show=show)
        else:
            run_jobs_on_ray(
                request.out,
                left,
                address=request.ray,
                workers=request.workers,
                threads=request.threads,
                show=show,
            )
    return _gathered(request, setting)


def gather(out: Path) -> Reproduction:
    """The sections of a reproduction from what is complete by now; trains nothing.

    Raises:
        ClearwayError: the folder holds no reproduction, or its scenes cannot be read.
    """
    path = out / REQUEST_FILE
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        dumps = [Path(dump) for dump in content.pop("dumps")]
        request = ReproduceRequest(out=out, dumps=dumps, **content)
    except FileNotFoundError as error:
        raise RunError(f"{out}: no reproduction here. Name a folder that clearway reproduce made") from error
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise RunError(f"{path}: not readable ({error}). Run clearway reproduce on the folder again") from error
    return _gathered(request, _setting(request, show_progress=False))


def _gathered(request: ReproduceRequest, setting: Setting) -> Reproduction:
    return Reproduction(request.command, setting, [EXPERIMENTS[name].section(setting) for name in request.names])


def _setting(request: ReproduceRequest, show_progress: bool) -> Setting:
    return prepare(
        request.out,
        BUDGETS[request.budget].changed(request.rooms, request.frames),
        dumps=request.dumps,
        encoder=request.encoder,
        seeds=request.seeds,
        learners=request.learners,
        show_progress=show_progress,
    )


def _request_json(request: ReproduceRequest) -> dict[str, object]:
    content = {name: value for name, value in asdict(request).items() if name not in HOW_NOT_WHAT}
    return {**content, "dumps": [str(dump.resolve()) for dump in request.dumps]}


def planned(setting: Setting, names: Sequence[ExperimentName]) -> list[Job]:
    """All jobs of some experiments, each run once with all that it is to be tried on."""
    return merged(job for name in names for job in EXPERIMENTS[name].jobs(setting))
