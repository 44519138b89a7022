"""Lines of progress where standard error is no terminal."""

import pytest

from clearway import progress
from clearway.progress import work_progress


def test_a_line_comes_now_and_then(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    with work_progress("encoding", 2_000, True) as show_done:
        for second in range(0, 75, 5):
            now[0] = 100.0 + second
            show_done(20 * second)
    told = capsys.readouterr()
    lines = [f"encoding: {done} of 2,000 pictures" for done in ("200", "600", "1,400")]
    assert (told.out, told.err.splitlines()) == ("", lines)


def test_nothing_is_told_where_it_is_not_wanted(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    monkeypatch.setattr(progress, "FIRST_LINE_S", 0.0)
    with work_progress("encoding", 2, False) as show_done:
        show_done(1)
    assert capsys.readouterr() == ("", "")
