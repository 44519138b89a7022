"""Ray, for tests that start clusters of their own. Where it is not installed, tests that import this are skipped."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

# Ray reads these when it is imported; all processes of a cluster must share the token
os.environ.update(RAY_USAGE_STATS_ENABLED="0", RAY_AUTH_MODE="token", RAY_AUTH_TOKEN="for-this-test-alone-0123456789")
ray = pytest.importorskip("ray")

MARKS = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]  # starting a cluster takes some ten seconds
WITH_HELPERS = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
"""PYTHONPATH of workers that import from the tests' helpers."""


@contextmanager
def cluster_here(cores: int) -> Iterator[None]:
    """A cluster of this machine, whose workers can import from the tests' helpers."""
    told = {"include_dashboard": False, "log_to_driver": False}
    ray.init("local", num_cpus=cores, runtime_env={"env_vars": {"PYTHONPATH": WITH_HELPERS}}, **told)
    try:
        yield
    finally:
        ray.shutdown()
