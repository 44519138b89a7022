"""Work in processes of this machine: who does what, what is said when it goes wrong, and that nothing is left."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import wait
from functools import partial
from pathlib import Path

import pytest

from clearway.errors import RunError, SceneError
from clearway.spread.processes import GRACE_S
from clearway.spread.workers import Work, workers_for
from helpers import spread_parts as parts
from helpers.spread_parts import died, no_tool, noted, workers_of

needs_proc = pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="looks for processes in /proc")


def test_results_come_in_the_order_of_the_parts_whatever_is_done_first(tmp_path: Path) -> None:
    with workers_for(Work(partial(noted, tmp_path), parts.square_late, died), workers=2) as crew:
        assert list(crew.results(range(5))) == [0, 1, 4, 9, 16]


def test_a_worker_is_set_up_once_for_all_its_parts(tmp_path: Path) -> None:
    work = Work(partial(noted, tmp_path), parts.square, died)
    with workers_for(work, workers=1) as crew:
        assert list(crew.results(range(3))) == [0, 1, 4]
        assert list(crew.results([5])) == [25]
    assert len(list(tmp_path.glob("set-up-*"))) == 1


def test_what_a_worker_makes_was_begun_by_the_command_that_started_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["/bin/clearway", "reproduce", "fig5"])
    with workers_for(Work(no_tool, parts.command_seen, died), workers=1) as crew:
        assert list(crew.results(["part"])) == [["/bin/clearway", "reproduce", "fig5"]]


@needs_proc
def test_workers_start_when_there_is_work() -> None:
    with workers_for(Work(no_tool, parts.square, died), workers=2) as crew:
        assert list(crew.results([])) == []
        assert workers_of(os.getpid()) == []
        assert list(crew.results([3])) == [9]
        assert len(workers_of(os.getpid())) == 1
    assert workers_of(os.getpid()) == []


def test_a_part_whose_worker_is_killed_is_begun_again_and_others_go_on(tmp_path: Path) -> None:
    work = Work(partial(noted, tmp_path), parts.die_once, died, attempts=2)
    with workers_for(work, workers=2) as crew:
        assert list(crew.results([0, 1])) == [0, 1]
    assert len(list(tmp_path.glob("set-up-*"))) == 3  # part 0 was not begun again


def test_a_part_whose_worker_is_killed_every_time_is_given_up(tmp_path: Path) -> None:
    work = Work(partial(noted, tmp_path), parts.die, died, attempts=3)
    with workers_for(work, workers=1) as crew, pytest.raises(RunError) as error:
        list(crew.results(["killed"]))
    assert str(error.value) == "part killed: its worker was killed by SIGKILL, attempt 3"
    assert len(list(tmp_path.glob("died-*"))) == 3


def test_a_worker_that_exits_by_itself_would_again_and_is_told_at_once(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    work = Work(partial(noted, tmp_path), parts.die, died, attempts=3, keeps_messages=True)
    with workers_for(work, workers=1) as crew, pytest.raises(RunError) as error:
        list(crew.results(["exits"]))
    assert str(error.value) == "part exits: its worker ended with exit code 7 (last words), attempt 1"
    assert capfd.readouterr() == ("", "")


def test_a_users_error_is_told_as_here() -> None:
    work = Work(no_tool, parts.fail, died)
    with workers_for(work, workers=1) as crew, pytest.raises(SceneError) as error:
        list(crew.results(["scene"]))
    assert (error.value.source, error.value.remedy) == ("a.h5", "Look for it")


def test_our_own_error_is_told_with_where_it_was_raised() -> None:
    with workers_for(Work(no_tool, parts.fail, died), workers=1) as crew:
        with pytest.raises(ZeroDivisionError, match="nothing to divide by") as error:
            list(crew.results(["ours"]))
        assert "spread_parts.py" in "".join(error.value.__notes__)
        with pytest.raises(RuntimeError, match=r"spread_parts\.py(.|\n)*UnsendableError: this and that"):
            list(crew.results(["unsendable"]))


def test_an_error_is_told_though_an_earlier_part_is_not_done() -> None:
    """The first part would never end."""
    with workers_for(Work(no_tool, parts.fail, died), workers=2) as crew:
        with pytest.raises(SceneError):
            list(crew.results(["waits", "scene"]))


def test_the_environment_is_given_where_nobody_has_set_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CLEARWAY_OURS", "ours")
    monkeypatch.delenv("CLEARWAY_THEIRS", raising=False)
    before = dict(os.environ)
    given = {"CLEARWAY_OURS": "given", "CLEARWAY_THEIRS": "given"}
    with workers_for(Work(no_tool, parts.variables, died, environment=given), workers=1) as crew:
        assert list(crew.results([tuple(given)])) == [["ours", "given"]]
    assert dict(os.environ) == before


@needs_proc
def test_what_is_under_way_when_the_block_ends_is_told_and_may_finish(tmp_path: Path) -> None:
    work = Work(partial(noted, tmp_path), parts.wait_to_be_told, died, attempts=3)
    with pytest.raises(KeyboardInterrupt), workers_for(work, workers=2) as crew:
        tasks = [crew.submit(part) for part in range(3)]
        for part in range(2):
            parts.wait_for(tmp_path / f"under-way-{part}")
        raise KeyboardInterrupt
    assert sorted(path.name for path in tmp_path.glob("saved-*")) == ["saved-0", "saved-1"]
    assert not (tmp_path / "under-way-2").exists()
    assert not wait(tasks, timeout=0).not_done
    assert workers_of(os.getpid()) == []


@needs_proc
def test_who_finishes_its_part_when_it_is_told_to_end_is_not_waited_for(tmp_path: Path) -> None:
    begun = time.monotonic()
    with workers_for(Work(partial(noted, tmp_path), parts.finish_when_told, died), workers=1) as crew:
        task = crew.submit(3)
        parts.wait_for(tmp_path / "under-way-3")
    assert task.result(timeout=0) == 3
    assert workers_of(os.getpid()) == []
    assert time.monotonic() - begun < GRACE_S / 2


SCRIPT = """
import sys
from functools import partial
from pathlib import Path
sys.path.append({tests!r})
from clearway.spread.workers import Work, workers_for
from helpers.spread_parts import died, noted, square, wait_to_be_told

folder = Path({folder!r})
with workers_for(Work(partial(noted, folder), square, died), workers=1) as crew:
    print(list(crew.results([6, 7])), flush=True)
try:
    with workers_for(Work(partial(noted, folder), wait_to_be_told, died), workers=2) as crew:
        list(crew.results([0, 1]))
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


def started_script(folder: Path) -> tuple[subprocess.Popen[str], list[int]]:
    """A script without a guard that has two workers under way, in a process group of its own; and the workers."""
    script = folder / "script.py"
    script.write_text(SCRIPT.format(tests=str(Path(parts.__file__).parents[1]), folder=str(folder)))
    piped = subprocess.PIPE
    process = subprocess.Popen([sys.executable, script], stdout=piped, stderr=piped, text=True, start_new_session=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "[36, 49]\n"
    for part in range(2):
        parts.wait_for(folder / f"under-way-{part}")
    workers = workers_of(process.pid)
    assert len(workers) == 2
    return process, workers


@needs_proc
def test_ctrl_c_is_heard_by_the_parent_alone_and_ends_all(tmp_path: Path) -> None:
    process, workers = started_script(tmp_path)
    os.killpg(process.pid, signal.SIGINT)
    assert process.communicate(timeout=60) == ("interrupted\n", "")
    assert not any(parts.runs(worker, parts.WORKER) for worker in workers)
    assert (tmp_path / "saved-0").exists() and (tmp_path / "saved-1").exists()


@needs_proc
def test_no_worker_outlives_a_killed_parent(tmp_path: Path) -> None:
    process, workers = started_script(tmp_path)
    process.kill()
    process.communicate(timeout=60)  # until nobody has its standard error open any more
    assert not any(parts.runs(worker, parts.WORKER) for worker in workers)
    assert not (tmp_path / "saved-0").exists()  # nobody told them
