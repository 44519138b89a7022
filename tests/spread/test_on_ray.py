"""Work on Ray. Slow: starting a cluster takes some ten seconds."""

from collections.abc import Iterator
from concurrent.futures import CancelledError
from functools import partial
from pathlib import Path

import pytest

from clearway.errors import RunError, SceneError
from clearway.spread.workers import Work, workers_for
from helpers import spread_parts as parts
from helpers.on_ray import MARKS, cluster_here
from helpers.spread_parts import died, no_tool, noted

pytestmark = MARKS


@pytest.fixture(scope="module", autouse=True)
def _one_cluster() -> Iterator[None]:
    with cluster_here(1):
        yield


def test_results_come_in_order_from_workers_set_up_once(tmp_path: Path) -> None:
    with workers_for(Work(partial(noted, tmp_path), parts.square, died), ray="local") as crew:
        assert list(crew.results(range(5))) == [0, 1, 4, 9, 16]
    assert len({path.name.split("-")[2] for path in tmp_path.glob("set-up-*")}) == len(list(tmp_path.glob("set-up-*")))


def test_errors_are_told_as_here() -> None:
    with workers_for(Work(no_tool, parts.fail, died), ray="local") as crew:
        with pytest.raises(SceneError) as error:
            list(crew.results(["scene"]))
        assert (error.value.source, error.value.remedy) == ("a.h5", "Look for it")
        with pytest.raises(ZeroDivisionError, match=r"spread_parts\.py"):
            list(crew.results(["ours"]))


def test_a_part_whose_worker_dies_every_time_is_given_up_in_one_line(tmp_path: Path) -> None:
    with workers_for(Work(partial(noted, tmp_path), parts.die, died, attempts=2), ray="local") as crew:
        with pytest.raises(RunError, match=r"^part killed: its worker died ") as error:
            list(crew.results(["killed"]))
    assert "\n" not in str(error.value)
    assert len(list(tmp_path.glob("died-*"))) == 2


def test_the_environment_is_given_where_nobody_has_set_it(monkeypatch: pytest.MonkeyPatch) -> None:
    with workers_for(Work(no_tool, parts.variables, died, environment={"CLEARWAY_GIVEN": "1"}), ray="local") as crew:
        assert list(crew.results([("CLEARWAY_GIVEN", "CLEARWAY_NOT_GIVEN")])) == [["1", None]]


def test_what_is_under_way_when_the_block_ends_is_interrupted(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with pytest.raises(KeyboardInterrupt):
        with workers_for(Work(partial(noted, tmp_path), parts.wait_to_be_interrupted, died), ray="local") as crew:
            tasks = [crew.submit(part) for part in range(3)]
            parts.wait_for(tmp_path / "under-way")
            raise KeyboardInterrupt
    parts.wait_for(tmp_path / "saved")
    assert len(list(tmp_path.glob("set-up-*"))) == 1  # the other parts were never begun
    assert all(isinstance(task.exception(timeout=60), CancelledError) for task in tasks)
    assert not caplog.records


def test_a_part_that_no_node_has_room_for_is_refused() -> None:
    with pytest.raises(RunError, match=r"no node .* the 3 processors .*there are 1 and .*--threads"):
        with workers_for(Work(no_tool, parts.square, died, cores=3), ray="local"):
            pass
