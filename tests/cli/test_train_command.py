"""`clearway train`: its folder, its last line, its end."""

import shlex

import pytest

from clearway.cli.run_names import free_run_folder, longer
from clearway.learn.run_folder import RunFolder


@pytest.mark.slow
def test_a_training_without_a_folder_gets_a_new_one(clearway, trained, small, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ("train", trained.scene, "--reward", "bump", "--alpha", "-0.02", "--seed", 3, *small)
    for name in ("bathroom_02-bump-alpha-0.02-ppo-s3", "bathroom_02-bump-alpha-0.02-ppo-s3-2"):
        answer = clearway(*words)
        assert answer.code == 0
        assert answer.err.splitlines()[0] == f"runs/{name}: the run's folder. Choose another with --out"
        assert RunFolder(tmp_path / "runs" / name).read_record().seed == 3
    assert len(list((tmp_path / "runs").iterdir())) == 2


@pytest.mark.parametrize("cost", ["alpha", "beta", "gamma"])
@pytest.mark.parametrize(("value", "told"), [("0.01", 1), ("-0.01", 0), ("0", 0)])
def test_a_cost_that_steps_earn_is_warned_of(clearway, trained, cost: str, value: str, told: int) -> None:
    answer = clearway("train", trained.scene, f"--{cost}", value, "--set", "nosuch=1")
    assert answer.code and answer.err.count("steps earn it") == told
    assert answer.err.count(f"--{cost} 0.01: steps earn it. A cost is negative") == told


def test_what_cannot_be_trained_is_one_line_and_leaves_no_folder(clearway, trained, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert clearway("train", trained.scene, "--targets", "76").refusal("out of range")
    assert clearway("train", trained.scene, "--resume").refusal("--resume", "--out")
    assert not list(tmp_path.iterdir())


def test_names_of_folders(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    files = [tmp_path / f"{name}.h5" for name in ("a", "b", "c")]
    assert str(free_run_folder(files, "shortest", "paper", 0)) == "runs/a-and-2-more-shortest-paper-s0"
    assert str(free_run_folder(files[:1], "../my:reward", "ppo", 1)) == "runs/a-my-reward-ppo-s1"


@pytest.mark.slow
def test_unsolved_targets_and_the_command_to_go_on(clearway, trained, small, tmp_path):
    run = tmp_path / "a run"
    answer = clearway("train", trained.scene, "--out", run, "--targets", 26, 37, *small)
    before, last = answer.err.splitlines()[-2:]
    short = "in its last episodes, of at most 40 steps each"
    assert before == f"{run}: trained, 0 of 2 targets solved {short}. Next: clearway evaluate {run} --targets"
    told, _, command = last.partition(". To go on: ")
    assert told == "not solved: bathroom_02=26,37"
    program, *words = shlex.split(command)
    assert program == "clearway"
    answer = clearway(*words)
    assert answer.code == 0
    assert "was finished after 640 frames, and goes on to 1,280" in answer.err
    assert RunFolder(run).metrics()[-1]["frames"] == 1280
    assert "--frames 2560" in answer.err.splitlines()[-1]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("train x.h5", "train x.h5 --out r --frames 9 --resume"),
        ("train --frames 5 --out r x.h5", "train --frames 9 --out r x.h5 --resume"),
        ("train --targets 1 2 --frames=5 x.h5 --resume", "train --targets 1 2 --frames=9 x.h5 --resume --out r"),
        ("train x.h5 --no-resume --until solved", "train x.h5 --until solved --out r --frames 9 --resume"),
    ],
)
def test_the_command_that_makes_a_run_longer(tmp_path, words, expected):
    from pathlib import Path

    assert longer(words.split(), Path("r"), 9) == f"clearway {expected}"


def test_who_interrupts_a_training_is_told_how_to_go_on(clearway, trained, small, tmp_path, monkeypatch):
    def interrupted(*given, on_begin, **how):
        RunFolder(how["out"]).write_record(RunFolder(trained.run).read_record())
        raise KeyboardInterrupt

    monkeypatch.setattr("clearway.api.training.train", interrupted)
    answer = clearway("train", trained.scene, "--out", tmp_path / "run", *small)
    assert answer.code == 130
    run = tmp_path / "run"
    told, _, command = answer.err.splitlines()[0].partition(". To go on: ")
    assert told == f"{run}: interrupted"
    assert shlex.split(command) == [
        "clearway",
        "train",
        str(trained.scene),
        "--out",
        str(run),
        *map(str, small),
        "--resume",
    ]


def test_a_training_may_end_once_all_is_solved(clearway, trained, tmp_path):
    run, words = tmp_path / "run", ("--set", "envs=100", "width=128")
    answer = clearway(
        "train", trained.scene, "--out", run, "--targets", 26, "--frames", "2e6", "--until", "solved", *words
    )
    assert answer.err.splitlines()[-1] == f"{run}: trained, 1 of 1 targets solved. Next: clearway evaluate {run}"
    assert RunFolder(run).metrics()[-1]["frames"] < 200_000


@pytest.mark.slow
def test_frames_that_were_used_beyond_those_asked_for_are_said(clearway, trained, small, tmp_path):
    words = ("train", trained.scene, "--targets", 26, *small)
    answer = clearway(*words, "--frames", 650, "--out", tmp_path / "more")
    assert "trained on 660 frames (10 more than asked for: the last step or update is whole), 0 of 1" in answer.err
    answer = clearway(*words, "--frames", 660, "--out", tmp_path / "exact")
    assert "trained, 0 of 1 targets solved" in answer.err
    assert RunFolder(tmp_path / "exact").metrics()[-1]["frames"] == 660
