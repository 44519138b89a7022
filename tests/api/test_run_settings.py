"""A run's settings as a file, from Python."""

import numpy as np
import pytest

from clearway.api import training
from clearway.api.perturbations import perturbations_asked
from clearway.api.run_settings import reward_options
from clearway.api.training import train
from clearway.evaluation.takes import Takes
from clearway.learn.run_folder import RunFolder
from clearway.live.conditions import Perturbations
from clearway.reward import BUMP, REWARDS, Arrival, Reward, Term, Time
from clearway.scenes.thor_v1 import write_scene
from clearway.settings_file import read_settings
from helpers.own_algorithm import SMALL as SMALL_TABLE
from helpers.own_algorithm import offer_algorithm, with_body
from helpers.small_runs import small_scenes

SMALL = {"envs": 20, "rollout_steps": 8, "width": 16, "frames": 320}


class Own(Term):
    pass


def test_a_reward_as_options():
    assert reward_options("bump") == {"reward": "bump"}
    assert reward_options(BUMP.with_changes(alpha=-0.5)) == {"reward": "bump", "alpha": -0.5}
    for name, reward in REWARDS.items():
        assert reward_options(reward) == {"reward": name}
    assert reward_options(Reward("mine", (Time(), Arrival()))) is None
    assert reward_options(Reward("bump", (Time(), Arrival()))) is None


def test_a_training_from_files_leaves_its_settings_and_one_from_memory_none(tmp_path):
    scene = small_scenes()[0]
    write_scene(scene, tmp_path / "a.h5")
    train(tmp_path / "a.h5", out=tmp_path / "run", until_solved=True, perturb=(), seed=2, **SMALL)
    settings = read_settings(tmp_path / "run" / "run.yaml")
    assert settings["files"] == [str((tmp_path / "a.h5").resolve())]
    assert (settings["until"], settings["seed"], settings["frames"]) == ("solved", 2, 320)
    targets = RunFolder(tmp_path / "run").read_record().targets
    assert settings["targets"] == {name: list(states) for name, states in targets.items()}
    train(scene, out=tmp_path / "other", **SMALL)
    assert not (tmp_path / "other" / "run.yaml").exists()


def test_perturbations_are_left_to_the_last_digit_and_takes_with_them(tmp_path, monkeypatch):
    scene = small_scenes()[0]
    write_scene(scene, tmp_path / "a.h5")
    asked = Perturbations(light=1 / 3, distance_noise=0.01234567)

    def takes_seen(scenes, perturbations, *_, takes, **__):
        of_scene = np.repeat(np.asarray(scenes[0].features)[:, None], takes, axis=1)
        return Takes(takes, {"features": [of_scene]}, {"label": "some"})

    monkeypatch.setattr(training, "takes_seen", takes_seen)
    train(tmp_path / "a.h5", out=tmp_path / "run", perturb=asked, **SMALL)
    settings = read_settings(tmp_path / "run" / "run.yaml")
    assert perturbations_asked(settings["perturb"]) == asked
    assert settings["takes"] == 4


def test_a_lengthened_run_s_settings_say_so(tmp_path):
    write_scene(small_scenes()[0], tmp_path / "a.h5")
    out = tmp_path / "run"
    train(tmp_path / "a.h5", out=out, **SMALL)
    assert "it was lengthened" not in (out / "run.yaml").read_text()
    with pytest.warns(UserWarning, match="goes on to 640"):
        train(tmp_path / "a.h5", out=out, resume=True, **{**SMALL, "frames": 640})
    train(tmp_path / "a.h5", out=out, resume=True, **{**SMALL, "frames": 640})
    told = [line for line in (out / "run.yaml").read_text().splitlines() if "it was lengthened" in line]
    assert told == ["# But it was lengthened from 320 frames: a run of 640 frames at once differs"]
    assert read_settings(out / "run.yaml")["frames"] == 640


def test_another_package_s_setting_that_is_called_as_an_option_of_ours_stands_among_its_settings(tmp_path, monkeypatch):
    offer_algorithm(tmp_path, monkeypatch, with_body("goals: int = 3\nnote: str | None = None"))
    write_scene(small_scenes()[0], tmp_path / "a.h5")
    train(tmp_path / "a.h5", algorithm="odd", out=tmp_path / "run", **SMALL_TABLE)
    settings = read_settings(tmp_path / "run" / "run.yaml")
    assert "goals" not in settings and settings["frames"] == 400
    assert (settings["set"]["goals"], settings["set"]["note"]) == (3, None)
