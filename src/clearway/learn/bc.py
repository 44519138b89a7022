"""Behaviour cloning from shortest paths: what the network reaches when it is told the right actions, without a reward.

The agent walks by its own policy and learns, in every pose that it comes to, which actions begin a shortest path
(DAgger: Ross, Gordon & Bagnell, AISTATS 2011). The loss is the cross-entropy to the set of these actions,

    L = mean( -log sum_{a right} pi(a) ),

so that it does not matter how the policy shares between equally short ways. The value is not learnt.

Axis letters: T steps, N environments, B = T * N rows, A actions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import Tensor

from clearway.errors import RunError
from clearway.learn.figures import Figures, check_finite
from clearway.learn.learner import Learner, OnFeatures, linear, next_steps
from clearway.learn.named_tensors import joined, part_of
from clearway.learn.optimiser import Adam, clip_gradients
from clearway.learn.rollout import ACTION_STREAM, Collector, as_rows
from clearway.learn.share import Share
from clearway.learn.statistics import EpisodeStatistics
from clearway.model.lookup import Activations, LookupNetwork
from clearway.model.network import NetworkShape, SiameseActorCritic
from clearway.model.policy import shortest_path_actions
from clearway.reward import Reward
from clearway.scenes.actions import ACTION_COUNT
from clearway.world.navigation import Navigation, TargetChoice
from clearway.world.streams import Streams
from clearway.world.world import World


@dataclass(frozen=True)
class BC(OnFeatures, Learner):
    """Behaviour cloning from shortest paths; rewards play no part."""

    algorithm: ClassVar[str] = "bc"

    frames: int = 1_000_000
    """Training frames over all environments; schedules end here."""
    envs: int = 400
    """Environments side by side, as many for each scene."""
    rollout_steps: int = 5
    """Steps of every environment between updates."""
    epochs: int = 4
    """Passes over each rollout, as one batch each."""
    step_limit: int = 40
    """Steps after which a training episode is cut."""
    lr_start: float = 5e-4
    lr_end: float = 5e-5
    """Adam's learning rate falls linearly from start to end."""
    clip_norm: float = 0.5
    """Largest norm of the gradient."""

    def trainer(self, world: World, reward: Reward, seed: int) -> Cloning:
        """A trainer at its first frame."""
        return Cloning(world, self, reward, seed)

    def check_workers(self, states: Tensor) -> None:
        """Raise RunError where there are fewer environments than scenes, which have so many states (C,)."""
        if self.envs < len(states):
            problem = f"{self.envs} environments for {len(states)} scenes"
            raise RunError(f"{problem}. Give more environments (envs)")

    def part_trainer(self, world: World, reward: Reward, seed: int, share: Share) -> Cloning:
        """The trainer of one of several workers."""
        return Cloning(world, self, reward, seed, share)


class Cloning:
    """Learns a policy for a world from its shortest paths.

    Args:
        world: tables of the scenes and targets; must hold features.
        learner: the settings.
        reward: what episodes earn, which nothing is learnt from.
        seed: of parameters, environments and actions.
        share: what the world's scenes are of those of all workers; None: there is one worker.

    Raises:
        RunError: features are missing or not finite, or a scene has no environment.
    """

    def __init__(self, world: World, learner: BC, reward: Reward, seed: int, share: Share | None = None) -> None:
        self.share = share = share or Share.whole(world)
        self.peers = share.peers
        scenes = len(share.states)
        learner.check_workers(share.states)
        self.feature_map, features = share.network_input(world, learner)
        self.world, self.learner = world, learner
        self.frames, self.updates = 0, 0
        scene = torch.arange(learner.envs, device=world.device) * scenes // learner.envs
        self.env_counts = torch.bincount(scene, minlength=scenes).tolist()  # of all workers
        self.envs_per_scene = tuple(self.env_counts[share.own])
        envs = torch.arange(learner.envs, device=world.device)[(scene >= share.first) & (scene < share.last)]
        heads = learner.head_count(scenes)
        shape = NetworkShape(heads, self.feature_map.input_count, learner.width, learner.history_length)
        network = SiameseActorCritic(shape, seed)
        self.network = share.own_network(network, learner.heads_by_scene).to(world.device)
        most_seen = len(envs) * (learner.history_length + learner.rollout_steps)
        self.lookup = LookupNetwork(self.network, features, world.target_state, most_seen=most_seen)
        self.optimiser = Adam(dict(self.network.named_parameters()))
        seeds = envs + (seed << 32)
        self.navigation = Navigation(
            world,
            reward,
            seeds,
            choice=TargetChoice.by_scene(world, scene[envs] - share.first),
            step_limit=learner.step_limit,
            history_length=learner.history_length,
        )
        self.statistics = EpisodeStatistics(len(envs), world.target_count, world.device, peers=self.peers)
        self.action_stream = Streams(seeds, ACTION_STREAM)
        self.collector = Collector(
            self.navigation,
            self.lookup,
            self.action_stream,
            self.envs_per_scene,
            learner.rollout_steps,
            keep_hidden=True,
        )
        self.distances = world.distance_table()
        self.navigation.reset()

    @property
    def finished(self) -> bool:
        """All frames of the settings are used."""
        return self.frames >= self.learner.frames

    def update(self) -> Figures:
        """Gather one rollout and learn from it; returns figures of it, see docs/metrics.md.

        Raises:
            RunError: the loss or a gradient is not finite.
        """
        lr = linear(self.learner.lr_start, self.learner.lr_end, self.frames, self.learner.frames)
        self.lookup.refresh()
        left = next_steps(self.frames, self.learner.frames, self.learner.envs, self.learner.rollout_steps)
        rollout = self.collector.collect(left)
        self.statistics.add(rollout)
        history, target = as_rows(rollout.history), as_rows(rollout.target)
        right = shortest_path_actions(self.world, self.distances, history[:, -1], target)
        told_of = None if self.peers.count == 1 else int(sum(n for [n] in self.peers.told(int(right.any(1).sum()))))
        told = []
        for number in range(self.learner.epochs):
            if number:
                self.lookup.refresh(few_rows=False)
            told.append(self._step(history, target, right, None if number else rollout.kept, lr, told_of))
        self.frames += self.learner.envs * rollout.steps
        self.updates += 1
        means = self._means(told)
        result = {**dict(zip(("loss", "agreement", "gradient_norm"), means, strict=True)), "lr": lr}
        check_finite(result, self.frames)
        return result

    def _means(self, told: list[Tensor]) -> list[float]:
        """Means over epochs of what `_step` told, (3,) each."""
        figures = torch.stack(told)
        own = figures[:, :2].clone()
        self.peers.add_up(own)  # the norm is everybody's already
        return torch.cat([own, figures[:, 2:]], 1).mean(0).tolist()

    def _step(
        self,
        history: Tensor,
        target: Tensor,
        right: Tensor,
        kept: Activations | None,
        lr: float,
        told_of: int | None,
    ) -> Tensor:
        """One step of the optimiser; returns loss, agreement and the gradient's norm before clipping, (3,).

        kept: the activations of these rows, where the parameters are still those of the rollout.
        told_of: rows of all workers that are told the right actions; None where there is one worker.
        """
        steps = len(target) // sum(self.envs_per_scene)
        known = history, target, tuple(count * steps for count in self.envs_per_scene)
        activations = kept or self.lookup.forward(*known)
        loss, agreement, gradient = cloning_loss(activations.output, right, told_of)
        self.lookup.backward(*known, activations, gradient)
        self.lookup.siamese_gradient()
        own: tuple[int, Tensor | None] = (0, None)
        if self.peers.count > 1:
            own = self.share.add_up_gradients(self.network, self.learner.heads_by_scene, siamese_weight=True)
        norm = clip_gradients(self.network.layer_gradients(), self.learner.clip_norm, False, *own)
        self.optimiser.step(lr)
        return torch.stack([loss, agreement, norm])

    def fixed_tensors(self) -> dict[str, Tensor]:
        """The map that prepares features."""
        return joined({"features": self.feature_map.tensors()})

    def close(self) -> None:
        """Nothing is held that would have to be given back; see `Learning` in `train`."""

    def tensors(self) -> dict[str, Tensor]:
        """All that `load_tensors` needs to go on bit for bit, besides `frames` and `updates`."""
        parts: dict[str, dict[str, Tensor]] = {
            "network": {name: p.data for name, p in self.network.named_parameters()},
            "optimiser": self.optimiser.tensors(),
            "navigation": self.navigation.tensors(),
            "statistics": self.statistics.tensors(),
            "actions": {"drawn": self.action_stream.drawn},
        }
        own = {name: tensor.detach() for name, tensor in joined(parts).items()}
        return self.share.joined(own, self.learner.heads_by_scene, self.world.sightings)

    @torch.no_grad()
    def load_tensors(self, tensors: dict[str, Tensor], frames: int, updates: int) -> None:
        """Go on from where `tensors` was called, after that many frames and updates, by however many workers."""
        tensors = self.share.own_part(tensors, self.env_counts, self.learner.heads_by_scene, self.world.sightings)
        for name, parameter in self.network.named_parameters():
            parameter.copy_(tensors[f"network.{name}"])
        self.optimiser.load_tensors(part_of(tensors, "optimiser"))
        self.navigation.load_tensors(part_of(tensors, "navigation"))
        self.statistics.load_tensors(part_of(tensors, "statistics"))
        self.action_stream.seek(tensors["actions.drawn"].to(self.world.device).clone())
        self.frames, self.updates = frames, updates


def cloning_loss(output: Tensor, right: Tensor, told_of: int | None = None) -> tuple[Tensor, Tensor, Tensor]:
    """The loss, the mean probability of right actions, and the loss's gradient with respect to the outputs.

    Args:
        output: (B, A + 1) action scores, then the value, of which nothing is learnt.
        right: (B, A) bool, actions that begin a shortest path; rows without one count for nothing.
        told_of: rows with one that means are over, those of other workers among them; None: these here.

    Returns:
        Two scalars and (B, A + 1).
    """
    leaf = output.detach().requires_grad_()
    told = right.any(1)
    with torch.enable_grad():
        log_pi = torch.log_softmax(leaf[:, :ACTION_COUNT], 1)
        on_right = torch.logsumexp(log_pi.masked_fill(~right, -torch.inf)[told], 1)
        rows = max(len(on_right) if told_of is None else told_of, 1)
        loss = -on_right.sum() / rows
        (gradient,) = torch.autograd.grad(loss, leaf)
    return loss.detach(), on_right.detach().exp().sum() / rows, gradient
