"""Every hostile file is refused in one good line, or read without harm: `hostile` is the corpus and what reads it."""

import sys
import time

import pytest

from hostile import child, settings_files
from hostile.summary import results, table

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="a process's peak of memory is told by /proc")


def summed_up(flips: int) -> str:
    """The summary, once it is seen that nothing went wrong."""
    found = results(flips)
    summary = table(found)
    print(f"\n{summary}")  # pytest -s shows it
    assert not [result for result in found if result.outcome == "wrong"], summary
    flipped = [result.outcome for result in found if result.group == "our scene files: flipped bits"]
    assert len(flipped) == flips
    assert flipped.count("refused") > flips / 2
    assert flipped.count("read") > 0  # what no reader looks at: unused space
    assert {result.outcome for result in found if result.group.startswith("hostile")} == {"refused"}
    return summary


def test_settings_that_are_hostile() -> None:
    """They gave tracebacks, or took minutes."""
    before = child.memory("VmRSS")
    for case in settings_files.cases():
        if case.group == "hostile settings":
            begun = time.process_time()
            assert child.tried(case, before)[:2] == ("refused", ""), case.name
            assert time.process_time() - begun < 3, case.name


@pytest.mark.slow
def test_a_hundred_flipped_bits_and_all_else_that_is_hostile() -> None:
    assert "faulty dumps" in summed_up(100)


@pytest.mark.slow
def test_ten_thousand_flipped_bits() -> None:
    assert "run folders" in summed_up(10_000)
