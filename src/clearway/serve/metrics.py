"""Figures for Prometheus."""

from __future__ import annotations

from collections.abc import Callable

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest

SECONDS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10)
PICTURES = (1, 2, 4, 8, 16, 32)


class Metrics:
    """What a service counts; each has a registry of its own.

    Args:
        sessions: gives the number of open sessions.
        waiting: gives the number of pictures that wait.
        replaced: gives the number of decoders that had to be replaced.
    """

    def __init__(self, sessions: Callable[[], int], waiting: Callable[[], int], replaced: Callable[[], int]) -> None:
        self.registry = r = CollectorRegistry()
        self.requests = Counter("clearway_requests", "Answers by route and status", ("route", "status"), registry=r)
        self.seconds = Histogram(
            "clearway_request_seconds", "From headers to answer", ("route",), buckets=SECONDS, registry=r
        )
        self.batch = Histogram("clearway_batch_pictures", "Pictures in a batch", buckets=PICTURES, registry=r)
        self.model = Histogram("clearway_model_seconds", "Encoder and policy, a batch", buckets=SECONDS, registry=r)
        self.faults = Counter("clearway_faults", "Refusals by code", ("code",), registry=r)
        Gauge("clearway_sessions", "Open sessions", registry=r).set_function(sessions)
        Gauge("clearway_waiting_pictures", "That wait", registry=r).set_function(waiting)
        Gauge("clearway_replaced_decoders", "Ended for their pictures", registry=r).set_function(replaced)

    def computed(self, pictures: int, seconds: float) -> None:
        """Count a batch."""
        self.batch.observe(pictures)
        self.model.observe(seconds)

    def answered(self, route: str, status: int, seconds: float) -> None:
        """Count an answer."""
        self.requests.labels(route, str(status)).inc()
        self.seconds.labels(route).observe(seconds)

    def text(self) -> bytes:
        """In Prometheus' text format."""
        return generate_latest(self.registry)
