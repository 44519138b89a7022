"""The named settings."""

from __future__ import annotations

from clearway.choices import PresetName
from clearway.learn.a2c import A2C
from clearway.learn.a3c.config import A3C
from clearway.learn.learner import Learner
from clearway.learn.ppo import PPO

DEFAULT = PPO()
"""PPO with hindsight and look-ahead; why each part is there, with figures: docs/learning.md."""

PAPER_A2C = A2C(
    frames=10_000_000,
    envs=100,
    envs_by="scenes",
    rollout_steps=5,
    step_limit=5000,
    bootstrap_cut=False,
    reward_scale=1.0,
    clip_rewards=True,
    centre_features=False,
    whiten_features=False,
    discount=0.99,
    gae_lambda=1.0,
    hindsight=False,
    lookahead=0.0,
    balance=0.0,
    siamese_lr=1.0,
    value_weight=0.5,
    entropy_start=0.01,
    entropy_end=0.01,
    log_barrier=0.0,
    settle=0.0,
    sum_loss=True,
    optimiser="rmsprop",
    lr_start=7.0e-4,
    lr_end=0.0,
    clip_norm=40.0,
    clip_each_tensor=True,
    matmul_precision="highest",
)
"""The published settings, synchronous: 5-step returns, discount 0.99, entropy 0.01, RMSProp, rewards clipped."""

PAPER_A3C = A3C()
"""The published algorithm: 20 asynchronous workers, a target each; more targets need more workers (`envs`)."""

PRESETS: dict[PresetName, Learner] = {"default": DEFAULT, "paper": PAPER_A2C, "paper-a3c": PAPER_A3C}
