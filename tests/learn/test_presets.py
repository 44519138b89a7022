from dataclasses import asdict
from typing import Any

import pytest

from clearway.errors import RunError
from clearway.learn.ppo import PPO
from clearway.learn.presets import DEFAULT, PAPER_A2C, PRESETS


def test_the_paper_s_settings() -> None:
    """Typed in from the published set-up (Zhu et al.'s released code, which the paper follows)."""
    published = {
        "rollout_steps": 5,
        "step_limit": 5000,
        "bootstrap_cut": False,
        "episode_targets": "drawn",
        "reward_scale": 1.0,
        "clip_rewards": True,
        "centre_features": False,
        "whiten_features": False,
        "feature_basis": 0,
        "goals": "given",
        "discount": 0.99,
        "gae_lambda": 1.0,
        "hindsight": False,
        "balance": 0.0,
        "siamese_lr": 1.0,
        "value_weight": 0.5,
        "entropy_start": 0.01,
        "entropy_end": 0.01,
        "log_barrier": 0.0,
        "settle": 0.0,
        "lookahead": 0.0,
        "sum_loss": True,
        "optimiser": "rmsprop",
        "matmul_precision": "highest",
        "lr_start": 7.0e-4,
        "lr_end": 0.0,
        "lr_warm_up": 0,
        "clip_norm": 40.0,
        "clip_each_tensor": True,
        "sent_gradients": "float32",
        "width": 512,
        "history_length": 4,
        "heads": "scene",
        "scenes_at_once": 0,
        "frames": 10_000_000,
        "envs": 100,
        "envs_by": "scenes",
    }
    without_meaning = {"lookahead_temperature", "scene_updates"}  # there is no look-ahead, and no turn
    assert {name: value for name, value in asdict(PAPER_A2C).items() if name not in without_meaning} == published
    assert (PAPER_A2C.algorithm, PAPER_A2C.epochs, PAPER_A2C.minibatches) == ("a2c", 1, 1)


def test_the_default_is_the_recipe() -> None:
    recipe = {
        "envs": 400,
        "rollout_steps": 20,
        "step_limit": 40,
        "bootstrap_cut": True,
        "epochs": 2,
        "minibatches": 4,
        "ratio_clip": 0.2,
        "gae_lambda": 0.95,
        "discount": 0.97,
        "value_weight": 0.5,
        "reward_scale": 0.1,
        "clip_rewards": False,
        "entropy_start": 0.02,
        "entropy_end": 0.002,
        "log_barrier": 1e-3,
        "settle": 0.15,
        "lookahead": 0.04,
        "lookahead_temperature": 0.005,
        "optimiser": "adam",
        "clip_norm": 0.5,
        "clip_each_tensor": False,
        "lr_start": 5e-4,
        "lr_end": 5e-5,
        "siamese_step": "pass",
        "siamese_lr": 2.0,
        "envs_by": "states",
        "whiten_features": True,
        "hindsight": True,
        "balance": 0.0,
        "centre_features": True,
        "feature_basis": 0,
        "goals": "given",
        "width": 512,
    }
    assert {name: asdict(DEFAULT)[name] for name in recipe} == recipe
    assert PRESETS["default"] == DEFAULT
    assert PRESETS["paper"] == PAPER_A2C


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("frames", 0),
        ("clip_norm", float("inf")),
        ("balance", float("inf")),
        ("envs", 0),
        ("rollout_steps", -1),
        ("step_limit", 0),
        ("epochs", 0),
        ("minibatches", 0),
        ("width", 0),
        ("history_length", 0),
        ("discount", 1.01),
        ("discount", float("nan")),
        ("gae_lambda", -0.1),
        ("entropy_start", 0.0),
        ("entropy_end", -0.001),
        ("lr_start", 0.0),
        ("lr_start", float("nan")),
        ("lr_end", -1e-5),
        ("clip_norm", 0.0),
        ("reward_scale", 0.0),
        ("balance", -1.0),
        ("ratio_clip", -0.2),
        ("value_weight", -0.5),
        ("settle", -0.1),
        ("settle", 1.0),
        ("settle", float("nan")),
        ("scenes_at_once", -1),
        ("scene_updates", 0),
    ],
)
def test_settings_out_of_range_are_refused_by_name(name: str, value: float) -> None:
    settings: dict[str, Any] = {name: value}
    with pytest.raises(RunError, match=rf"{name} is {value}, expected"):
        PPO(**settings)
