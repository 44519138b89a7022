"""Ctrl+C and SIGTERM while something is trained."""

import signal
import threading
from pathlib import Path

import pytest

from clearway.errors import RunError
from clearway.learn.interruption import interruption
from clearway.learn.workers import train_by_workers
from helpers.small_runs import small_request


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_second_signal_stops_a_training_at_once(number: signal.Signals) -> None:
    with interruption() as interrupted:
        signal.raise_signal(number)
        assert interrupted.is_set()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(number)


def test_a_worker_may_be_told_twice() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with interruption(of_several=True) as interrupted:
        assert not interrupted.is_set()
        signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGTERM)
        assert interrupted.is_set()
    assert signal.getsignal(signal.SIGTERM) is before


def test_workers_are_not_started_by_another_thread(tmp_path: Path) -> None:
    told: list[str] = []

    def start() -> None:
        with pytest.raises(RunError) as refused:
            train_by_workers(small_request(), tmp_path / "run", 2)
        told.append(str(refused.value))

    thread = threading.Thread(target=start)
    thread.start()
    thread.join()
    assert told and "by the main thread alone. Start them there, or one" in told[0]
    assert not (tmp_path / "run").exists()
