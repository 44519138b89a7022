"""Our environments under their names in Ray's registry: `register_rllib`. Needs RLlib, `pip install 'ray[rllib]'`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
from gymnasium.wrappers import FlattenObservation

from clearway.envs.registration import ENV_ID, register_environments
from clearway.errors import EnvError, pip_install


def register_rllib() -> str:
    """Register the environment with Ray and give back its name.

    Use it as `AlgorithmConfig.environment(name, env_config={...})`; what stands in `env_config` goes to
    `gymnasium.make`: scenes, targets, reward, observations, ... Features come as one vector, since RLlib's own models
    read no others: the history's, (K * F,), then the target's, (F,). Pictures come as they are.

    Raises:
        EnvError: RLlib is not installed.
    """
    try:
        from ray.tune.registry import register_env
    except ImportError as error:
        raise EnvError(f"register_rllib needs RLlib. Install it: {pip_install('ray[rllib]')}") from error

    register_env(ENV_ID, made)
    return ENV_ID


def made(config: Mapping[str, Any]) -> gymnasium.Env:
    """One environment; RLlib makes it in each of its workers."""
    register_environments()
    env = gymnasium.make(ENV_ID, **config)
    return env if config.get("observations") == "pictures" else FlattenObservation(env)
