"""`clearway train --algorithm`: every algorithm from its name to a table, and what it refuses."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from clearway.learn.algorithms import ALGORITHMS
from clearway.learn.presets import PAPER_A2C
from clearway.learn.run_folder import RunFolder
from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.own_algorithm import offer_algorithm, with_body
from helpers.small_eyes import seen_by_eyes, ship, small_generalist

PICTURES = ("curves", "map-bathroom_02", "episode-bathroom_02")
SETTINGS = ("--frames", 400, "--threads", 1, "--set", "envs=10")


def seen(scene: Path, folder: Path) -> Path:
    """The file of the same scene, seen by small eyes."""
    path = folder / "seen" / scene.name
    write_scene(seen_by_eyes(folder / "eyes", read_scene(scene))[0], path)
    return path


SLOWEST = ("a3c", "adapt")
LOOKING = """
class Looking:
    sees = ("rgb",)

    def __init__(self, record, frames):
        self.record, self.frames = record, frames

    def on_poses(self, world):
        return self

    def reset(self, target, seed):
        return {"target": target["rgb"]}

    def act(self, observation, state):
        action = (observation["rgb"].astype(int) + state["target"]).sum((1, 2, 3)) % 4
        return clearway.Decisions(action, torch.eye(4).numpy()[action]), state
"""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in SLOWEST else name for name in ALGORITHMS]
)
def test_every_algorithm_trains_and_is_evaluated(clearway, trained, tmp_path, name, monkeypatch):
    width = () if name == "q-learning" else ("width=16",)
    scene = trained.scene if name not in ("recurrent", "adapt") else seen(trained.scene, tmp_path)
    if name == "adapt":
        ship(small_generalist(tmp_path / "eyes"), monkeypatch)
        width = (*width, "tour_steps=10", "walk_steps=5")
    run = tmp_path / "run"
    words = ("train", scene, "--out", run, "--algorithm", name, *SETTINGS, "rollout_steps=8", *width)
    answer = clearway(*words)
    assert answer.code == 0, answer
    record = json.loads((run / "run.json").read_text())
    assert (record["learner"]["algorithm"], record["learner"]["envs"]) == (name, 10)
    assert isinstance(RunFolder(run).read_record().learner, ALGORITHMS[name])
    drawn = ("--pictures", tmp_path / "pictures")
    found = clearway("evaluate", run, "--episodes", 1, "--step-limit", 20, "--json", *drawn).json
    assert {"random", "shortest path"} <= {other["agent"] for other in found["others"]}
    assert {path.name for path in drawn[1].iterdir()} == {f"{name}.png" for name in PICTURES}


@pytest.mark.parametrize("command", ["export", "view", "serve"])
def test_what_needs_a_network_says_that_a_table_has_none(clearway, trained, tmp_path, command):
    run = tmp_path / "run"
    assert clearway("train", trained.scene, "--out", run, "--algorithm", "q-learning", *SETTINGS).code == 0
    out = () if command in ("view", "serve") else ("--out", tmp_path / "out.onnx")
    ways = f"Walk with it by clearway evaluate {run} or clearway video {run};"  # both are walked in this file
    assert clearway(command, run, *out).refusal("an agent of q-learning has none", ways)


def test_a_table_s_episode_can_be_filmed(clearway, trained, tmp_path):
    run, film = tmp_path / "run", tmp_path / "out.gif"
    assert clearway("train", trained.scene, "--out", run, "--algorithm", "q-learning", *SETTINGS).code == 0
    answer = clearway("video", run, "--out", film, "--most-steps", 3)
    assert answer.code == 0, answer
    assert film.read_bytes().startswith(b"GIF")


def test_who_sees_pictures_is_filmed_and_drawn_by_the_scenes_of_its_run(clearway, trained, tmp_path, monkeypatch):
    body = with_body("def agent(self, record, tensors, frames): return Looking(record, frames)")
    offer_algorithm(tmp_path, monkeypatch, LOOKING + body)
    run, film, drawn = tmp_path / "run", tmp_path / "out.gif", tmp_path / "pictures"
    assert clearway("train", trained.scene, "--out", run, "--algorithm", "odd", *SETTINGS).code == 0
    for scenes in ((), ("--scenes", trained.scene)):
        answer = clearway("video", run, "--out", film, "--most-steps", 3, *scenes)
        assert answer.code == 0, answer
        assert film.read_bytes().startswith(b"GIF")
        film.unlink()
    answer = clearway("evaluate", run, "--episodes", 1, "--step-limit", 5, "--pictures", drawn)
    assert answer.code == 0, answer
    assert {path.stem for path in drawn.iterdir()} == set(PICTURES)


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("--algorithm", "a3c", "--set", "hindsight=true"), ("hindsight=true", "a3c's settings", "clip_norm")),
        (
            ("--algorithm", "a3c", "--goals", "seen"),
            ("--goals: a3c has no setting goals", "Leave it out"),
        ),
        (
            ("--algorithm", "q-learning", "--feature-basis", 8),
            ("--feature-basis: q-learning has no setting", "Leave it out"),
        ),
        (
            ("--preset", "paper", "--set", "epochs=2"),
            ("epochs=2", "paper's settings", "epochs is a setting of default, ppo, "),
        ),
        (("--algorithm", "bc", "--set", "ratio_clip=0.1"), ("ratio_clip=0.1", "bc's settings")),
    ],
)
def test_a_setting_that_the_algorithm_lacks_is_refused(clearway, trained, tmp_path, words, parts):
    assert clearway("train", trained.scene, "--out", tmp_path / "run", *words).refusal(*parts)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("option", ["--algorithm", "--preset"])
def test_a_preset_is_an_algorithm_with_settings(clearway, trained, tmp_path, option):
    words = (option, "paper", "--frames", 400, "--set", "envs=10", "rollout_steps=8", "width=16")
    assert clearway("train", trained.scene, "--out", tmp_path, *words).code == 0
    expected = replace(PAPER_A2C, frames=400, envs=10, rollout_steps=8, width=16)
    assert RunFolder(tmp_path).read_record().learner == expected


def test_a_preset_s_settings_go_with_another_algorithm(clearway, trained, tmp_path, monkeypatch):
    asked = []

    def asked_for(request, *_, **__):
        asked.append(request.learner)
        raise KeyboardInterrupt

    monkeypatch.setattr("clearway.api.training.train_alone", asked_for)
    words = ("--preset", "paper", "--algorithm", "a3c", "--frames", 200, "--threads", 1, "--set", "envs=7", "width=16")
    assert clearway("train", trained.scene, "--out", tmp_path, *words).code == 130
    (learner,) = asked
    assert (learner.algorithm, learner.clip_norm, learner.envs) == ("a3c", 40.0, 7)
    assert not {"epochs", "hindsight", "optimiser"} & set(vars(learner))


@pytest.mark.slow
def test_from_generalist_is_adapting_it(clearway, trained, tmp_path, monkeypatch):
    scene = seen(trained.scene, tmp_path)
    ship(small_generalist(tmp_path / "eyes"), monkeypatch)
    small = ("--set", "envs=10", "rollout_steps=8", "width=16", "tour_steps=10", "walk_steps=5", "--frames", 100)
    answer = clearway("train", scene, "--out", tmp_path / "run", "--from", "generalist", "--threads", 1, *small)
    assert answer.code == 0, answer
    assert json.loads((tmp_path / "run" / "run.json").read_text())["learner"]["source"] == "generalist"


@pytest.mark.parametrize(
    "words, told",
    [
        (("--from", "runs/a"), "--from runs/a: expected generalist"),
        (("--from", "generalist", "--algorithm", "bc"), "--algorithm bc: cannot be adapted"),
        (("--from", "generalist", "--preset", "paper"), "--preset paper: cannot be adapted"),
        (("--from", "generalist"), "those of another encoder. Encode them"),
    ],
)
def test_what_cannot_be_adapted_is_refused_in_a_line(clearway, trained, tmp_path, words, told):
    assert clearway("train", trained.scene, "--out", tmp_path / "run", *words).refusal(told)
    assert not (tmp_path / "run").exists()
