"""A3C written plainly: naive network, autograd, one environment a worker, returns step by step, plain RMSProp."""

from __future__ import annotations

import copy
from collections.abc import Mapping

import torch
from torch import Tensor

from clearway.learn.a3c.config import A3C
from clearway.learn.rollout import ACTION_STREAM, sample_actions
from clearway.model.network import SiameseActorCritic
from clearway.reward import Reward
from clearway.world.navigation import TARGET_STREAM, Navigation
from clearway.world.streams import Streams
from clearway.world.world import World

ALPHA, EPSILON = 0.99, 0.1


class PlainWorker:
    """One worker with its own environment."""

    def __init__(self, number: int, world: World, learner: A3C, reward: Reward, seed: int) -> None:
        self.world, self.learner = world, learner
        self.target = torch.tensor([number % world.target_count])
        self.scene = world.target_scene[self.target]
        seeds = torch.tensor([(seed << 32) + number])
        self.navigation = Navigation(world, reward, seeds, step_limit=learner.step_limit)
        self.drawn, self.targets = learner.episode_targets == "drawn", Streams(seeds, TARGET_STREAM)
        self.actions = Streams(seeds, ACTION_STREAM)
        self.ended, self.reached = 0, 0  # episodes
        self.navigation.reset(target=self.target)

    def output(self, network: SiameseActorCritic) -> tuple[Tensor, Tensor]:
        """Scores (A,) and value from 8,192-wide inputs, made afresh."""
        features, nav = self.world.features, self.navigation
        goal = features[self.world.target_state[self.target]]
        scores, value = network(features[nav.history], goal, self.scene)
        return scores[0], value[0]

    def segment(self, network: SiameseActorCritic, entropy_weight: float) -> tuple[Tensor, int]:
        """The loss of one segment and its number of steps."""
        learner, nav = self.learner, self.navigation
        steps = []
        value_after = torch.zeros(())
        for _ in range(learner.rollout_steps):
            scores, value = self.output(network)
            action = sample_actions(scores.detach()[None], self.actions.uniform())
            step = nav.step(action)
            steps.append((torch.log_softmax(scores, 0), action[0], value, step.reward[0]))
            if step.ended:
                break
        if not step.reached and (not step.truncated or learner.bootstrap_cut):
            value_after = self.output(network)[1].detach()
        if step.ended:
            self.ended += 1
            self.reached += int(step.reached)
            if self.drawn:
                own = torch.nonzero(self.world.target_scene == self.scene)[:, 0]
                self.target = own[(self.targets.uniform() * len(own)).long()]
            nav.reset(target=self.target)
        loss, outcome = torch.zeros(()), value_after
        for log_pi, action, value, reward in reversed(steps):
            outcome = reward + learner.discount * outcome
            advantage = (outcome - value).detach()
            entropy = -(log_pi.exp() * log_pi).sum()
            loss = loss - log_pi[action] * advantage - entropy_weight * entropy
            loss = loss + 0.5 * learner.value_weight * (outcome - value) ** 2
        return (loss if learner.sum_loss else loss / len(steps)), len(steps)


def published_tensors(network: SiameseActorCritic, scene: int) -> list[Tensor]:
    """Views of the parameters that a worker of a scene changes, as Zhu's code has them: policy and value apart."""
    weight, bias = network.output_weight[scene], network.output_bias[scene]
    return [
        network.siamese_weight,
        network.siamese_bias,
        network.fusion_weight,
        network.fusion_bias,
        network.scene_weight[scene],
        network.scene_bias[scene],
        weight[:4],
        weight[4:],
        bias[:4],
        bias[4:],
    ]


class PlainA3C:
    """All workers take turns: in a round they copy the parameters together, then update them one after the other."""

    def __init__(self, world: World, learner: A3C, reward: Reward, seed: int, workers: list[int]) -> None:
        self.learner = learner
        self.workers = [PlainWorker(number, world, learner, reward, seed) for number in workers]

    def begin(self, network: SiameseActorCritic) -> None:
        """Learn from these parameters on."""
        self.start, self.network = copy.deepcopy(network), copy.deepcopy(network)
        self.mean_square = copy.deepcopy(network)
        for tensor in self.mean_square.parameters():
            tensor.data.fill_(1.0)

    def round(self, frames: int) -> int:
        """Returns the frames used."""
        learner = self.learner
        entropy_weight = learner.entropy_weight_at(frames)
        gradients = []
        for worker in self.workers:
            local = copy.deepcopy(self.network)
            local.zero_grad()
            loss, steps = worker.segment(local, entropy_weight)
            loss.backward()
            for parameter in local.parameters():
                parameter.data = parameter.grad  # so that published_tensors finds the gradients
            scene = int(worker.scene)
            gradients.append((scene, steps, [g.detach() for g in published_tensors(local, scene)]))
        used = 0
        for scene, steps, gradient in gradients:
            lr = learner.lr_start * max(0.0, 1 - (frames + used) / learner.frames)
            if learner.lr_warm_up:
                lr *= min(1.0, (frames + used) / learner.lr_warm_up)
            self.step(scene, gradient, lr)
            used += steps
        return used

    def assert_learnt(self, parameters: Mapping[str, Tensor], squares: Mapping[str, Tensor]) -> None:
        """All has moved to these parameters, and to these mean squares plus epsilon."""
        start, mean_square = (dict(network.named_parameters()) for network in (self.start, self.mean_square))
        for name, expected in self.network.named_parameters():
            moved = (expected.data - start[name]).abs().max().item()
            assert moved > 0, name
            torch.testing.assert_close(parameters[name], expected.data, rtol=0, atol=1e-4 * moved + 1e-7)
            torch.testing.assert_close(squares[name] - EPSILON, mean_square[name].data, rtol=1e-5, atol=1e-6)

    @torch.no_grad()
    def step(self, scene: int, gradient: list[Tensor], lr: float) -> None:
        """Clip and apply one worker's gradient."""
        total = torch.cat([g.flatten() for g in gradient]).norm()
        parameters, squares = published_tensors(self.network, scene), published_tensors(self.mean_square, scene)
        for parameter, square, g in zip(parameters, squares, gradient, strict=True):
            norm = g.norm() if self.learner.clip_each_tensor else total
            g = g * min(1.0, self.learner.clip_norm / norm.item())
            square.data.copy_(ALPHA * square + (1 - ALPHA) * g**2)
            parameter.data.sub_(lr * g / (square + EPSILON).sqrt())
