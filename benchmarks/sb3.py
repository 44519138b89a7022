"""Stable-Baselines3 on our environment with our network: what peers.py compares with.

Nothing here makes it slower than it has to be: environments are made without Gymnasium's checker, the features come
prepared, the network's layers are `nn.Linear`, its Adam is PyTorch's fused one, and beside SB3's own ways to run many
environments there is our own `SB3VecEnv`, which gives it the batched one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.distributions import Distribution
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.type_aliases import PyTorchObs
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecEnv
from throughput import PlainNetwork
from torch import Tensor

import clearway.envs
from clearway.envs.registration import DEFAULT_STEP_LIMIT, ENV_ID
from clearway.envs.sb3 import SB3VecEnv, scene_space
from clearway.model.network import NetworkShape, SiameseActorCritic
from clearway.reward import COLLISION_AWARE, Reward
from clearway.scenes.actions import ACTION_COUNT
from clearway.scenes.scene import Scene
from clearway.world.world import World

Observation = dict[str, np.ndarray]
VEC_ENVS = ("dummy", "subproc", "batched")


# ----------------------------------------------------------------------------------------------------- environments


class SceneInObservation(gymnasium.Wrapper):
    """Puts the index of the scene into the observation, so that the policy knows whose head to use."""

    def __init__(self, env: gymnasium.Env) -> None:
        super().__init__(env)
        seen = env.observation_space
        assert isinstance(seen, spaces.Dict)
        scene = scene_space(len(env.get_wrapper_attr("scene_names")))
        self.observation_space = spaces.Dict({**seen.spaces, "scene": scene})

    def reset(self, **settings: Any) -> tuple[Observation, dict[str, Any]]:
        """As the environment's."""
        seen, info = self.env.reset(**settings)
        return self._with_scene(seen, info), info

    def step(self, action: int) -> tuple[Observation, Any, bool, bool, dict[str, Any]]:
        """As the environment's."""
        seen, reward, terminated, truncated, info = self.env.step(action)
        return self._with_scene(seen, info), reward, terminated, truncated, info

    def _with_scene(self, seen: Observation, info: dict[str, Any]) -> Observation:
        return seen | {"scene": np.array([info["scene"]], np.float32)}


def single_env(scenes: Sequence[Scene], reward: Reward, step_limit: int, threads: int | None) -> gymnasium.Env:
    """One environment; threads: of torch in a process of its own, None leaves this process's."""
    if threads is not None:
        torch.set_num_threads(threads)
    clearway.envs.register_environments()
    made = gymnasium.make(
        ENV_ID, scenes=list(scenes), reward=reward, max_episode_steps=step_limit, disable_env_checker=True
    )
    return SceneInObservation(made)


def vec_env(
    kind: str,
    scenes: Sequence[Scene],
    count: int,
    reward: Reward = COLLISION_AWARE,
    step_limit: int = DEFAULT_STEP_LIMIT,
) -> VecEnv:
    """`count` environments of a kind of `VEC_ENVS`; the scenes' features are given out as they are."""
    if kind == "batched":
        return SB3VecEnv(
            list(scenes), num_envs=count, scene_in_observation=True, reward=reward, max_episode_steps=step_limit
        )
    threads = 1 if kind == "subproc" else None
    make: list[Callable[[], gymnasium.Env]] = [partial(single_env, scenes, reward, step_limit, threads)] * count
    return SubprocVecEnv(make, start_method="spawn") if kind == "subproc" else DummyVecEnv(make)


# ---------------------------------------------------------------------------------------------------------- network


class SiamesePolicy(ActorCriticPolicy):
    """The paper's siamese actor-critic, one head a scene, as SB3 wants a policy.

    Args:
        shape: sizes of the network.
    """

    def __init__(self, *args: Any, shape: NetworkShape, **settings: Any) -> None:
        self.shape = shape
        super().__init__(*args, **settings)

    def _build(self, lr_schedule: Callable[[float], float]) -> None:
        shape = self.shape
        self.network = PlainNetwork(shape.head_count, shape.width, shape.history_length, shape.feature_count)
        settings = {"lr": lr_schedule(1), **self.optimizer_kwargs}
        self.optimizer = self.optimizer_class(self.network.parameters(), **settings)

    def outputs(self, seen: PyTorchObs) -> tuple[Tensor, Tensor]:
        """Action scores (B, A) and values (B, 1) of observations."""
        assert isinstance(seen, dict)
        wanted = seen["target"].repeat(1, self.shape.history_length)
        fused = self.network.trunk(seen["observation"].flatten(1), wanted)
        scene = seen["scene"][:, 0].long()
        order = torch.argsort(scene)
        rows_per_scene = torch.bincount(scene, minlength=self.shape.head_count).tolist()
        output = self.network.heads(fused[order], rows_per_scene)[torch.argsort(order)]
        return output[:, :ACTION_COUNT], output[:, ACTION_COUNT:]

    def forward(self, obs: PyTorchObs, deterministic: bool = False) -> tuple[Tensor, Tensor, Tensor]:
        """Actions (B,), values (B, 1) and log-probabilities (B,)."""
        scores, value = self.outputs(obs)
        chances = self.action_dist.proba_distribution(action_logits=scores)
        action = chances.get_actions(deterministic=deterministic)
        return action, value, chances.log_prob(action)

    def evaluate_actions(self, obs: PyTorchObs, actions: Tensor) -> tuple[Tensor, Tensor, Tensor | None]:
        """Values (B, 1), log-probabilities (B,) of the actions, entropies (B,)."""
        scores, value = self.outputs(obs)
        chances = self.action_dist.proba_distribution(action_logits=scores)
        return value, chances.log_prob(actions), chances.entropy()

    def get_distribution(self, obs: PyTorchObs) -> Distribution:
        """The actions' chances."""
        return self.action_dist.proba_distribution(action_logits=self.outputs(obs)[0])

    def predict_values(self, obs: PyTorchObs) -> Tensor:
        """Values (B, 1)."""
        return self.outputs(obs)[1]

    @torch.no_grad()
    def copy_to(self, network: SiameseActorCritic) -> None:
        """Write the weights into the package's network, which computes the same function of them."""
        shape, plain = self.shape, self.network
        siamese = plain.siamese.weight.view(shape.width, shape.history_length, shape.feature_count)
        network.siamese_weight.copy_(siamese.transpose(0, 1))
        network.siamese_bias.copy_(plain.siamese.bias)
        network.fusion_weight.copy_(plain.fusion.weight.view(shape.width, 2, shape.width).transpose(0, 1))
        network.fusion_bias.copy_(plain.fusion.bias)
        for scene, (layer, output) in enumerate(zip(plain.scene_layers, plain.outputs, strict=True)):
            assert isinstance(layer, torch.nn.Linear) and isinstance(output, torch.nn.Linear)
            network.scene_weight[scene], network.scene_bias[scene] = layer.weight, layer.bias
            network.output_weight[scene], network.output_bias[scene] = output.weight, output.bias


def network_settings(world: World, **optimiser: float | bool) -> dict[str, object]:
    """SB3's policy_kwargs for a world; optimiser: settings of its Adam, where it is to have one."""
    assert world.features is not None
    shape = NetworkShape(world.scene_count, world.features.shape[1])
    return {"shape": shape, "optimizer_kwargs": optimiser} if optimiser else {"shape": shape}


def policy_of(model: OnPolicyAlgorithm) -> SiamesePolicy:
    """The model's policy, once its network is seen to be ours."""
    assert isinstance(model.policy, SiamesePolicy)
    check_same_network(model.policy)
    return model.policy


def check_same_network(policy: SiamesePolicy) -> None:
    """Hold the policy's outputs on random observations against the package's definition of the network."""
    shape, rows = policy.shape, 64
    network = SiameseActorCritic(shape)
    policy.copy_to(network)
    history = torch.randn(rows, shape.history_length, shape.feature_count)
    target, scene = torch.randn(rows, shape.feature_count), torch.randint(shape.head_count, (rows,))
    seen = {"observation": history, "target": target, "scene": scene[:, None].float()}
    with torch.no_grad():
        scores, value = network(history, target, scene)
        found_scores, found_value = policy.outputs(seen)
    torch.testing.assert_close(found_scores, scores, rtol=1e-4, atol=1e-4)
    torch.testing.assert_close(found_value[:, 0], value, rtol=1e-4, atol=1e-4)
