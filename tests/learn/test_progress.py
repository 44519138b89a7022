"""Progress where standard error is no terminal."""

import re

import pytest

from clearway.learn import progress
from clearway.learn.progress import progress_view


def lines_of(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], seconds: range) -> list[str]:
    """What is printed of a training of 1,000 frames a second, shown every second."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    with progress_view(4_000_000, visible=True) as view:
        for second in seconds:
            now[0] = float(second)
            view.show(1000 * second, 2, 5)
    out, err = capsys.readouterr()
    assert out == ""
    return err.splitlines()


def test_a_line_now_and_then(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    lines = lines_of(monkeypatch, capsys, range(1, 2001))
    assert lines[0] == (
        "training: 11,000 of 4,000,000 frames, 1,000 frames/s, solved 2 of 5, 1:06:29 left"  # since the first second
    )
    seconds = [int(re.match(r"training: ([\d,]+),000 of ", line)[1].replace(",", "")) for line in lines]
    assert seconds == [11, 31, 71, 151, 311, 611, 911, 1211, 1511, 1811]


def test_short_trainings_are_silent(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert lines_of(monkeypatch, capsys, range(1, 10)) == []


def test_nothing_is_printed_where_nothing_is_wanted(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_view(10, visible=False) as view:
        view.show(5, 1, 2)
    assert capsys.readouterr() == ("", "")
