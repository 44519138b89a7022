"""What an experiment is: what it needs, and what comes of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from clearway.experiments.plan import Job
from clearway.experiments.section import Section
from clearway.experiments.setting import Setting


@dataclass(frozen=True)
class Experiment:
    """One table or figure of the paper, or an experiment of one's own.

    Attributes:
        jobs: what must be trained and tried.
        section: its part of the report, from what is complete.
    """

    jobs: Callable[[Setting], list[Job]]
    section: Callable[[Setting], Section]
