"""Perturbed pictures in the training of the recurrent agent, from rooms to what is shown."""

from __future__ import annotations

import numpy as np

import clearway
from clearway.agents.agent import FEATURES
from clearway.api import training
from clearway.api.perturbations import perturbations_asked
from clearway.evaluation.takes import Takes
from clearway.learn.seeds import SEED_LIMIT
from helpers.made import corridor_scene
from helpers.small_eyes import seen_by_eyes

SMALL = {"frames": 160, "envs": 10, "rollout_steps": 8, "step_limit": 30, "width": 16}


def test_a_training_sees_so_many_takes_of_every_pose_under_all_perturbations(tmp_path, monkeypatch):
    scene = seen_by_eyes(tmp_path / "eyes", corridor_scene(5))[0]
    asked = []

    def taken(scenes, perturbations, sees, encoder, *, takes, seed, show_progress):
        asked.append((len(scenes), perturbations.to_json(), sees, encoder, takes, seed))
        return Takes(takes, {FEATURES: [np.repeat(one.features[:, None] * 0.5, takes, 1) for one in scenes]})

    monkeypatch.setattr(training, "takes_seen", taken)
    plain = clearway.train(scene, [8, 16], algorithm=clearway.Recurrent(**SMALL), seed=3)
    assert not asked
    other = clearway.train(scene, [8, 16], algorithm=clearway.Recurrent(**SMALL), perturb="all", takes=2, seed=3)
    everything = perturbations_asked("all").to_json()
    assert asked == [
        (1, everything, (FEATURES,), None, 2, SEED_LIMIT - 4)
    ]  # others than an evaluation with seed 3 sees
    assert plain.figures["loss"] != other.figures["loss"]
