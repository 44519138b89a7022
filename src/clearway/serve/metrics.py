"""Figures for Prometheus."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from clearway.errors import ClearwayError, install_hint

try:
    from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest, multiprocess, values
except ImportError as error:
    raise ClearwayError(f"clearway serve needs prometheus-client. {install_hint('serve')}") from error

FOLDER_VARIABLE = "PROMETHEUS_MULTIPROC_DIR"  # where prometheus_client looks for it

DECODERS = "Ended for their pictures"
SECONDS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10)
PICTURES = (1, 2, 4, 8, 16, 32)


class Metrics:
    """What a service counts; each has a registry of its own.

    Args:
        sessions: gives the number of open sessions.
        waiting: gives the number of pictures that wait.
        replaced: gives the number of decoders that had to be replaced.
        folder: in which replicas count together, see `count_together`; None: this process is alone.
    """

    def __init__(
        self,
        sessions: Callable[[], int],
        waiting: Callable[[], int],
        replaced: Callable[[], int],
        folder: Path | None = None,
    ) -> None:
        self._folder = folder
        self.registry = r = CollectorRegistry()
        self.requests = Counter("clearway_requests", "Answers by route and status", ("route", "status"), registry=r)
        self.seconds = Histogram(
            "clearway_request_seconds", "From headers to answer", ("route",), buckets=SECONDS, registry=r
        )
        self.batch = Histogram("clearway_batch_pictures", "Pictures in a batch", buckets=PICTURES, registry=r)
        self.model = Histogram("clearway_model_seconds", "Encoder and policy, a batch", buckets=SECONDS, registry=r)
        self.faults = Counter("clearway_faults", "Refusals by code", ("code",), registry=r)
        self._gauges = (
            (Gauge("clearway_sessions", "Open sessions", multiprocess_mode="livemostrecent", registry=r), sessions),
            (Gauge("clearway_waiting_pictures", "That wait", multiprocess_mode="livesum", registry=r), waiting),
            (Gauge("clearway_replaced_decoders", DECODERS, multiprocess_mode="livesum", registry=r), replaced),
        )
        for gauge, function in self._gauges if folder is None else ():
            gauge.set_function(function)

    def computed(self, pictures: int, seconds: float) -> None:
        """Count a batch."""
        self.batch.observe(pictures)
        self.model.observe(seconds)

    def answered(self, route: str, status: int, seconds: float) -> None:
        """Count an answer."""
        self.requests.labels(route, str(status)).inc()
        self.seconds.labels(route).observe(seconds)

    def text(self) -> bytes:
        """In Prometheus' text format, of all replicas."""
        if self._folder is None:
            return generate_latest(self.registry)
        together = CollectorRegistry()
        multiprocess.MultiProcessCollector(together, str(self._folder))
        return generate_latest(together)

    def refresh(self) -> None:
        """Let other replicas know what cannot be counted by adding up."""
        for gauge, function in self._gauges:
            gauge.set(function())


def count_together(folder: Path, number: int) -> None:
    """Let the figures of this process, which are made later, be those of replica `number`, and outlive it."""
    os.environ[FOLDER_VARIABLE] = str(folder)
    values.ValueClass = values.MultiProcessValue(lambda: number)


def count_no_more(folder: Path, number: int) -> None:
    """What replica `number` said of the present is forgotten: it has ended."""
    multiprocess.mark_process_dead(number, str(folder))
