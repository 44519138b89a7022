"""A node of a Ray cluster that is killed: its parts go on elsewhere, or one line ends them. Slow: clusters start."""

import threading
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from clearway.errors import RunError
from clearway.spread import on_ray
from clearway.spread.workers import Work, workers_for
from helpers import spread_parts as parts
from helpers.on_ray import MARKS, WITH_HELPERS, ray
from helpers.spread_parts import died, noted, wait_for

pytestmark = MARKS
ENDS_WITHIN_S = 300.0  # with `LOST_S` of 4 s


@pytest.fixture
def cluster(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A head on which nothing is done, to which nodes are added."""
    from ray.cluster_utils import Cluster

    monkeypatch.setenv("PYTHONPATH", WITH_HELPERS)
    made = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "include_dashboard": False})
    yield made
    ray.shutdown()
    made.shutdown()


def lost_once_begun(cluster: Any, node: Any, sign: Path) -> threading.Thread:
    """Kill a node with all of its processes once a part is under way."""

    def kill() -> None:
        wait_for(sign)
        cluster.remove_node(node, allow_graceful=False)

    thread = threading.Thread(target=kill)
    thread.start()
    return thread


def test_parts_of_a_lost_node_are_done_by_another(cluster: Any, tmp_path: Path) -> None:
    first, _ = cluster.add_node(num_cpus=1), cluster.add_node(num_cpus=1)
    killer = lost_once_begun(cluster, first, tmp_path / "begun")
    with workers_for(Work(partial(noted, tmp_path), parts.square_slowly, died), ray=cluster.address) as crew:
        assert list(crew.results(range(6))) == [0, 1, 4, 9, 16, 25]
    killer.join()


def test_the_last_node_lost_is_one_line_after_a_while(
    cluster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(on_ray, "LOST_S", 4.0)
    killer = lost_once_begun(cluster, cluster.add_node(num_cpus=1), tmp_path / "begun")
    begun = time.monotonic()
    with pytest.raises(RunError, match=r"^after 4 s: no node of the Ray cluster has the 1 processors") as error:
        with workers_for(Work(partial(noted, tmp_path), parts.square_slowly, died), ray=cluster.address) as crew:
            list(crew.results(range(6)))
    assert "\n" not in str(error.value)
    assert time.monotonic() - begun < ENDS_WITHIN_S
    killer.join()
