from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from clearway.experiments.board import RunState, clock, state_of, state_table
from clearway.experiments.job import do
from clearway.experiments.plan import Job
from clearway.reward import COLLISION_AWARE
from helpers.small_setting import FRAMES, small_setting


def test_a_run_s_state_is_read_from_its_files(tmp_path: Path) -> None:
    setting = small_setting(tmp_path, seeds=1)
    (run,) = setting.runs(setting.learners["default"], COLLISION_AWARE)
    job = Job(run, (setting.trial(),))
    assert state_of(tmp_path, job, under_way=False) == RunState(run.name, "waiting", 0, FRAMES, None, 0, 5, None)
    assert state_of(tmp_path, job, under_way=True).state == "training"
    do(tmp_path, job, threads=1)
    done = state_of(tmp_path, job, under_way=False)
    assert (done.state, done.frames, done.seconds_left) == ("done", FRAMES, 0)
    assert done.frames_per_s > 0
    (trial,) = (tmp_path / "runs" / run.name / "trials").iterdir()
    trial.unlink()
    assert state_of(tmp_path, job, under_way=True).state == "trying"
    assert state_of(tmp_path, job, under_way=False).state == "waiting"


def test_the_table_shows_what_is_under_way_first() -> None:
    states = [
        RunState("finished", "done", 800, 800, 10.0, 5, 5, 0.0),
        RunState("idle", "waiting", 0, 800, None, 0, 5, None),
        RunState("busy", "training", 400, 800, 100.0, 2, 5, 4.0),
    ]
    text = StringIO()
    Console(file=text, width=120).print(state_table(states))
    lines = text.getvalue()
    assert lines.index("busy") < lines.index("idle") < lines.index("finished")
    assert "3 runs: 1 done, 1 waiting" in lines
    assert "50 % of 800" in lines and "2/5" in lines
    assert "0:00:04" in lines


@pytest.mark.parametrize(("seconds", "text"), [(0, "0:00:00"), (3661.4, "1:01:01"), (59.6, "0:01:00")])
def test_clock(seconds: float, text: str) -> None:
    assert clock(seconds) == text
