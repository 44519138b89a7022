"""What made the runs of a report: the commands that started them, the versions and the machines, as the runs say."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from clearway.experiments.job import run_folder
from clearway.experiments.plan import Job
from clearway.learn.provenance import facts_text, hardware, package_versions


def made_by(out: Path, jobs: Sequence[Job]) -> dict[str, str]:
    """Lines for a report: each different answer with the number of runs that give it; this machine's without runs.

    Raises:
        RunError: a run's record is damaged.
    """
    folders = [folder for job in jobs if (folder := run_folder(out, job.run)).exists]
    records = [folder.read_record() for folder in folders]
    if not records:
        return {"versions": facts_text(package_versions()), "hardware": facts_text(hardware())}
    return {
        "runs begun by": _counted([_told(record.command) for record in records]),
        **_times([record.begun for record in records]),
        "versions": _counted([facts_text(dict(record.versions)) for record in records]),
        "hardware": _counted([facts_text(dict(record.hardware)) for record in records]),
    }


def _told(command: Sequence[str]) -> str:
    """A command as it is typed; "python -c" where no file was named."""
    path = Path(command[0] if command else "")
    called = path.parent.name if path.name == "__main__.py" else path.name.removesuffix(".exe")
    return shlex.join([*(("python", "-c") if called in ("", "-c") else (called,)), *command[1:]])


def _times(begun: Sequence[str | None]) -> dict[str, str]:
    """When the first and the last run began, of those that say so."""
    told = [time for time in begun if time]
    fewer = f" (of the {len(told)} of {len(begun)} runs that say so)" if len(told) < len(begun) else ""
    return {"first and last run begun": f"{min(told)}, {max(told)}{fewer}"} if told else {}


def _counted(answers: Sequence[str]) -> str:
    return "; ".join(f"{answer} ({count} run{'s' * (count > 1)})" for answer, count in Counter(answers).items())
