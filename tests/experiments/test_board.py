import json
import shutil
from dataclasses import replace
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from clearway.experiments import board as module
from clearway.experiments.board import Looks, RunState, board, clock, pace, state_of, state_table
from clearway.experiments.job import do, run_folder
from clearway.experiments.plan import Job
from clearway.learn.run_folder import METRICS_FILE
from clearway.reward import COLLISION_AWARE
from helpers.small_setting import FRAMES, small_setting


def test_a_run_s_state_is_read_from_its_files(tmp_path: Path) -> None:
    setting = small_setting(tmp_path, seeds=1)
    (run,) = setting.runs(setting.learners["default"], COLLISION_AWARE)
    job = Job(run, (setting.trial(),))
    assert state_of(tmp_path, job, under_way=False) == RunState(
        run.name, run.kind, "waiting", 0, FRAMES, None, 0, 5, None
    )
    assert state_of(tmp_path, job, under_way=True).state == "training"
    do(tmp_path, job, threads=1)
    done = state_of(tmp_path, job, under_way=False)
    assert (done.state, done.frames, done.seconds_left) == ("done", FRAMES, 0)
    assert done.frames_per_s > 0
    (trial,) = (tmp_path / "runs" / run.name / "trials").iterdir()
    trial.unlink()
    assert state_of(tmp_path, job, under_way=True).state == "evaluating"
    assert state_of(tmp_path, job, under_way=False).state == "waiting"


def test_an_update_that_goes_beyond_the_frames_asked_for_counts_them_alone(tmp_path: Path) -> None:
    setting = small_setting(tmp_path, seeds=1)
    (run,) = setting.runs(setting.learners["default"], COLLISION_AWARE)
    folder = run_folder(tmp_path, run)
    folder.path.mkdir(parents=True)
    row = {"frames": FRAMES + 40, "seconds": 2.0, "solved_targets": 0}
    (folder.path / METRICS_FILE).write_text(json.dumps(row) + "\n")
    found = state_of(tmp_path, Job(run, (setting.trial(),)), under_way=True)
    assert (found.state, found.frames, found.seconds_left) == ("evaluating", FRAMES, 0)
    assert found.frames_per_s == (FRAMES + 40) / 2


def test_a_run_that_waits_has_come_as_far_as_its_newest_checkpoint(tmp_path: Path) -> None:
    """Whatever its metrics say: what was trained after it is lost. One whose trials are there is done without any."""
    setting = small_setting(tmp_path, seeds=1)
    (run,) = setting.runs(setting.learners["default"], COLLISION_AWARE)
    job = Job(run, (setting.trial(),))
    do(tmp_path, job, threads=1)
    (trial,) = (tmp_path / "runs" / run.name / "trials").iterdir()
    kept = trial.read_bytes()
    trial.unlink()
    assert state_of(tmp_path, job, under_way=False).frames == FRAMES
    shutil.rmtree(run_folder(tmp_path, run).checkpoints)
    assert state_of(tmp_path, job, under_way=False).frames == 0
    trial.write_bytes(kept)
    run_folder(tmp_path, run).metrics_path.unlink()
    assert state_of(tmp_path, job, under_way=False).frames == FRAMES


def test_the_table_shows_what_is_under_way_first() -> None:
    states = [
        RunState("finished", "ppo", "done", 800, 800, 10.0, 5, 5, 0.0),
        RunState("idle", "ppo", "waiting", 0, 800, None, 0, 5, None),
        RunState("busy", "ppo", "training", 400, 800, 100.0, 2, 5, 4.0),
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


def test_the_files_of_a_run_that_is_done_are_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    setting = small_setting(tmp_path, seeds=2)
    jobs = [Job(run, (setting.trial(),)) for run in setting.runs(setting.learners["default"], COLLISION_AWARE)]
    looks = Looks(tmp_path, jobs)
    do(tmp_path, jobs[0], threads=1)
    asked = []
    monkeypatch.setattr(module, "state_of", lambda out, job, busy: asked.append(job) or state_of(out, job, busy))
    assert [state.state for state in looks.states(jobs[1:])] == ["done", "training"]
    assert [state.state for state in looks.states(jobs[1:])] == ["done", "training"]
    assert asked == [*jobs, jobs[1]]


STATES = [
    RunState("a", "ppo", "done", 800, 800, 10.0, 5, 5, 0.0),
    RunState("b", "ppo", "training", 400, 800, 100.0, 2, 5, 4.0),
    RunState("c", "ppo", "evaluating", 800, 800, 100.0, 2, 5, 0.0),
    RunState("d", "ppo", "waiting", 0, 800, None, 0, 5, None),
]


def test_a_line_says_how_many_runs_are_done_and_when_all_will_be() -> None:
    # so far 2,000 frames in 80 + 4 + 8 s; the longest run has 800 to go
    assert pace(STATES) == "runs: 1 of 4 done, 2 under way, 0:00:37 of training left at this pace"
    more = [*STATES, *[replace(STATES[3], name=name) for name in "ef"]]  # 2,800 frames, two runs at a time
    assert pace(more) == "runs: 1 of 6 done, 2 under way, 0:01:04 of training left at this pace"
    assert pace([STATES[0], STATES[2]]) == "runs: 1 of 2 done, 1 under way"  # evaluation is not told of
    assert pace([STATES[0], STATES[3]]) == "runs: 1 of 2 done, 0 under way"
    assert pace(STATES[3:]) == "runs: 0 of 1 done, 0 under way"
    killed = RunState("e", "ppo", "waiting", 0, 800, 100.0, 2, 5, 8.0)  # it has figures, but no checkpoint
    begun = RunState("f", "ppo", "training", 0, 800, None, 0, 5, None)
    assert pace([killed, begun]) == "runs: 0 of 2 done, 1 under way"


def test_each_kind_of_run_goes_on_at_its_own_pace() -> None:
    """1,000 slow frames at 10 a second, and 10,000 quick ones at 1,000 a second; the longest run takes all the time."""
    slow = [
        RunState("a", "bc", "done", 800, 800, 10.0, 5, 5, 0.0),
        RunState("b", "bc", "waiting", 0, 1_000, None, 0, 5, None),
    ]
    quick = [RunState(name, "ppo", "training", 5_000, 10_000, 1_000.0, 5, 5, 5.0) for name in "cd"]
    assert pace([*slow, *quick]) == "runs: 1 of 4 done, 2 under way, 0:01:40 of training left at this pace"
    assert pace(quick) == "runs: 0 of 2 done, 2 under way, 0:00:05 of training left at this pace"
    assert pace([*slow[1:], *quick]).endswith(", 2 under way, at least 0:00:05 of training left at this pace")


def test_where_nobody_watches_lines_stand_instead_of_a_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    setting = small_setting(tmp_path, seeds=1)
    (run,) = setting.runs(setting.learners["default"], COLLISION_AWARE)
    now = [100.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    with board(tmp_path, [Job(run, (setting.trial(),))], visible=True) as show:
        show([])
        assert capsys.readouterr().err == ""
        now[0] += 11
        show([Job(run, (setting.trial(),))])
    assert capsys.readouterr().err == "runs: 0 of 1 done, 1 under way\n"
