"""Train Stable-Baselines3's PPO on a scene.

pip install 'clearway[sb3]'
python examples/train_sb3_ppo.py scenes/bathroom.h5 --steps 200000
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecMonitor

from clearway.envs.sb3 import SB3VecEnv


def main(arguments: Sequence[str] | None = None) -> float:
    """Train, evaluate; gives back the mean reward of an episode."""
    parser = argparse.ArgumentParser(description="Train Stable-Baselines3's PPO on a scene.")
    parser.add_argument("scenes", nargs="+", help="scene files with features")
    parser.add_argument("--steps", type=int, default=200_000)
    parser.add_argument("--envs", type=int, default=32)
    parser.add_argument("--out", type=Path, help="save the model here")
    options = parser.parse_args(arguments)

    settings = {"num_envs": options.envs, "max_episode_steps": 200}
    model = PPO(
        "MultiInputPolicy",
        VecMonitor(SB3VecEnv(options.scenes, **settings)),
        n_steps=64,
        batch_size=512,
        gamma=0.97,
        ent_coef=0.01,
        seed=0,
    )
    model.learn(options.steps)
    if options.out:
        model.save(options.out)
    reward, spread = evaluate_policy(
        model, VecMonitor(SB3VecEnv(options.scenes, **settings)), n_eval_episodes=50, deterministic=False
    )
    print(f"mean reward of an episode: {reward:.2f} (standard deviation {spread:.2f})")
    return float(reward)


if __name__ == "__main__":
    main()
