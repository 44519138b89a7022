"""The synchronous trainer of PPO and A2C: rollout, advantages, update; one call an update, no files and no printing.

Axis letters: T steps, N environments, C scenes, B = T * N rows, M targets.
"""

from __future__ import annotations

import math
from dataclasses import replace

import torch
from torch import Tensor

from clearway.learn.figures import Figures, check_finite
from clearway.learn.hindsight import hindsight_batch
from clearway.learn.learner import next_steps
from clearway.learn.lookahead import Observed, better_policy
from clearway.learn.losses import Batch, LossSettings, loss_gradient, merged
from clearway.learn.minibatches import Minibatch, dealt_epochs
from clearway.learn.named_tensors import joined, part_of
from clearway.learn.on_policy import OnPolicy
from clearway.learn.optimiser import clip_gradients, optimisers
from clearway.learn.own_goals import OwnGoals, goal_world
from clearway.learn.returns import generalised_advantages
from clearway.learn.rollout import ACTION_STREAM, Collector, Rollout, as_rows, by_step
from clearway.learn.rotation import Rotation, check_division, check_kept, divided_envs, scene_of_envs
from clearway.learn.share import Share
from clearway.learn.statistics import EpisodeStatistics
from clearway.learn.step_figures import StepFigures, loss_figures, row_figures
from clearway.model.lookup import Activations, LookupNetwork
from clearway.model.network import NetworkShape, SiameseActorCritic
from clearway.model.precision import factor_dtype
from clearway.model.sums import counted
from clearway.reward import Reward
from clearway.world.navigation import Navigation, TargetChoice
from clearway.world.streams import Streams
from clearway.world.world import World

SHUFFLE_SALT = 1_000_003


class Trainer:
    """Learns a policy for a world.

    Args:
        world: tables of the scenes and targets; must hold features.
        learner: the settings, of PPO or A2C.
        reward: what is earned.
        seed: of parameters, environments, actions and shuffling.
        share: what the world's scenes are of those of all workers; None: there is one worker.

    Raises:
        RunError: features are missing or not finite, or a scene has no environment or fewer rows than there are
            minibatches.
    """

    def __init__(self, world: World, learner: OnPolicy, reward: Reward, seed: int, share: Share | None = None) -> None:
        self.share = share = share or Share.whole(world)
        self.peers = share.peers
        self.world, self.learner, self.seed = world, learner, seed
        self.own_goals: OwnGoals | None = None
        if learner.goals == "seen":
            world = goal_world(world)  # that episodes are in; `self.world` has the given targets alone
            self.own_goals = OwnGoals(world, self.world.target_state)
        self.frames, self.updates = 0, 0
        device = world.device
        self.rotation = Rotation(len(share.states), learner.scenes_at_once, learner.scene_updates, seed)
        check_division(share.states, learner, self.rotation)
        self.env_counts = divided_envs(share.states, learner, self.rotation.scenes(0))  # of all workers
        envs_per_scene = self.env_counts[share.own]
        self.env_count, env_scene = sum(self.env_counts), scene_of_envs(envs_per_scene, device)
        self.feature_map, features = share.network_input(world, learner)
        first_env = sum(self.env_counts[: share.first])
        seeds = torch.arange(first_env, first_env + len(env_scene), dtype=torch.int64, device=device) + (seed << 32)
        keep_targets = learner.episode_targets == "kept"
        if keep_targets:
            check_kept(world, envs_per_scene)
        choice = TargetChoice.by_scene(world, env_scene)
        told = None
        if self.own_goals:
            told = self.own_goals.given
            choice.reweigh(
                self.own_goals.weights(choice, torch.ones(world.target_count, dtype=torch.float64, device=device))
            )
        self.navigation = Navigation(
            world,
            reward,
            seeds,
            choice=choice,
            keep_targets=keep_targets,
            step_limit=learner.step_limit,
            history_length=learner.history_length,
            reward_dtype=torch.get_default_dtype(),
        )
        heads = learner.head_count(len(share.states))
        shape = NetworkShape(heads, self.feature_map.input_count, learner.width, learner.history_length)
        self.network = share.own_network(SiameseActorCritic(shape, seed), learner.heads_by_scene).to(device)
        self.lookup = LookupNetwork(
            self.network,
            features,
            world.target_state * world.sightings,  # seen in the scene's own pictures
            factor_dtype(learner.matmul_precision, device),
            most_seen=len(seeds) * (learner.history_length + learner.rollout_steps),
        )
        self.siamese_optimiser, self.optimiser = optimisers(self.network, learner.optimiser)
        self.observed = Observed(world)
        self.statistics = EpisodeStatistics(len(seeds), world.target_count, device, told, self.peers)
        self.action_stream = Streams(seeds, ACTION_STREAM)
        self.one_pass = learner.epochs * learner.minibatches == 1
        self.collector = Collector(
            self.navigation, self.lookup, self.action_stream, envs_per_scene, learner.rollout_steps, self.one_pass
        )
        self.navigation.begin_staggered()

    @property
    def frames_per_update(self) -> int:
        """Frames that one update uses."""
        return self.env_count * self.learner.rollout_steps

    @property
    def finished(self) -> bool:
        """All frames of the settings are used."""
        return self.frames >= self.learner.frames

    def update(self) -> Figures:
        """Gather one rollout and learn from it; returns figures of it, see docs/metrics.md.

        Raises:
            RunError: the loss or a gradient is not finite.
        """
        learner = self.learner
        self._rotate()
        lr, settings = learner.lr_at(self.frames), LossSettings.after(self.frames, learner)
        self.lookup.refresh()
        rollout = self.collector.collect(self._next_steps())
        self.statistics.add(rollout)
        batch, explained = self._batch(rollout, looks_ahead=settings.lookahead_weight > 0)
        rows = len(batch)
        if learner.hindsight:
            batch = self._with_hindsight(rollout, batch)
        kept = self.collector.kept if self.one_pass and len(batch) == rows else None
        steps = self.learn(batch, kept, lr, settings, self._shuffler(self.updates))
        self.frames += self.env_count * rollout.steps
        self.updates += 1
        if self.own_goals:
            self.own_goals.see(self.world.pose(rollout.history[:, :, -1]))
            self.own_goals.see(rollout.arrived)
        self._rebalance()
        result = {
            **loss_figures(steps, explained, self.peers, clips=not math.isinf(learner.ratio_clip)),
            **row_figures(steps, len(batch) - rows, self.peers),
            "lr": lr,
            "entropy_weight": settings.entropy_weight,
        }
        if self.own_goals:
            result["own_goals"] = self.own_goals.count
        check_finite(result, self.frames)
        return result

    def _next_steps(self) -> int:
        """Steps of the next rollout; every scene has a row for every minibatch."""
        learner, fewest = self.learner, min(count for count in self.env_counts if count)
        least = -(-learner.minibatches // fewest)
        return next_steps(self.frames, learner.frames, self.env_count, learner.rollout_steps, least)

    def _rotate(self) -> None:
        """Put the environments into other scenes where it is their turn."""
        if self.updates and self.rotation.begins(self.updates):
            self._seat(self.updates)
            self.statistics.drop_open()
            self.navigation.begin_staggered()

    def _seat(self, update: int) -> None:
        """Put the environments into the scenes of that update."""
        self.env_counts = divided_envs(self.share.states, self.learner, self.rotation.scenes(update))
        counts = self.env_counts[self.share.own]
        self.navigation.choice.groups = scene_of_envs(counts, self.world.device)
        self.collector.rows_per_scene = counts

    @torch.no_grad()
    def _batch(self, rollout: Rollout, looks_ahead: bool) -> tuple[Batch, Tensor]:
        """The rollout's rows with their advantages, and the explained variance of the values, a scalar."""
        learner = self.learner
        log_pi = torch.log_softmax(rollout.kept.scores, 1)
        action = as_rows(rollout.action)
        log_prob = log_pi.gather(1, action[:, None])[:, 0]
        value = by_step(rollout.kept.value, rollout.steps)
        rows_per_scene = self.collector.rows_per_scene
        _, after = self.lookup.judged(rollout.history_after, rollout.target_after, rows_per_scene)
        ended = rollout.reached | rollout.truncated
        advantage = generalised_advantages(
            rollout.reward * learner.reward_scale + self._value_at_cuts(rollout),
            learner.discount * (~ended),
            value,
            after,
            learner.gae_lambda,
        )
        value_target = advantage + value
        left, all_of_it = self.peers.variances(advantage, value_target)
        explained = 1 - left / all_of_it.clamp_min(1e-12)
        batch = Batch(
            as_rows(rollout.history),
            as_rows(rollout.target),
            action,
            log_prob,
            as_rows(advantage),
            as_rows(value_target),
            tuple(count * rollout.steps for count in rows_per_scene),
        )
        if learner.lookahead:
            self.observed.add(self.world.pose(batch.history[:, -1]), action, as_rows(rollout.arrived))
        if looks_ahead:
            batch = replace(batch, better=self._better(batch, log_pi, rollout.kept.value))
        return batch, explained

    def _better(self, batch: Batch, log_pi: Tensor, value: Tensor) -> Tensor:
        """(B, A) what looking one step ahead finds better."""
        learner = self.learner
        return better_policy(
            batch.history,
            batch.target,
            log_pi,
            value,
            self.observed,
            self.navigation,
            self.lookup,
            discount=learner.discount,
            reward_scale=learner.reward_scale,
            temperature=learner.lookahead_temperature,
        )

    def _value_at_cuts(self, rollout: Rollout) -> Tensor:
        """(T, N) discounted value of the pose where an episode was cut, to be added to that step's reward; else 0."""
        bonus = torch.zeros_like(rollout.reward)
        if not self.learner.bootstrap_cut:
            return bonus
        env, step = rollout.truncated.T.nonzero(as_tuple=True)  # ordered by scene, as environments are
        if len(env):
            target = rollout.target[step, env]
            scene = self.navigation.world.target_scene[target]
            rows_per_scene = counted(scene, self.world.scene_count).tolist()
            _, values = self.lookup.judged(rollout.last_history[step, env], target, rows_per_scene)
            bonus[step, env] = self.learner.discount * values
        return bonus

    def _with_hindsight(self, rollout: Rollout, batch: Batch) -> Batch:
        """The batch with hindsight's rows put among those of their scene."""
        learner = self.learner
        told = hindsight_batch(
            rollout,
            by_step(batch.log_prob, rollout.steps),
            self.navigation,
            self.lookup,
            discount=learner.discount,
            reward_scale=learner.reward_scale,
            trace_lambda=learner.gae_lambda,
            told=self.own_goals.told(self.seed, self.updates) if self.own_goals else None,
        )
        return batch if told is None else merged(batch, told)

    def _shuffler(self, update: int) -> torch.Generator:
        """Random numbers that deal an update's rows."""
        return torch.Generator(self.world.device).manual_seed(self.seed * SHUFFLE_SALT + update)

    def learn(
        self,
        batch: Batch,
        kept: Activations | None,
        lr: float,
        settings: LossSettings,
        generator: torch.Generator,
    ) -> list[StepFigures]:
        """Epochs of minibatches.

        Args:
            batch: rows to learn from.
            kept: the activations of a single pass over the rollout as it is.
            lr, settings: of this update.
            generator: deals the rows.
        """
        learner, world = self.learner, self.navigation.world
        epochs = dealt_epochs(
            batch,
            world.state_count * world.sightings,
            world.target_count,
            epochs=learner.epochs,
            parts=learner.minibatches,
            row_step=self.lookup.row_step,
            generator=generator,
            peers=self.peers,
        )
        steps: list[StepFigures] = []
        siamese_moved = False
        for minibatches in epochs:
            row_counts = self._row_counts(minibatches)
            for number, part in enumerate(minibatches, start=1):
                if steps:
                    self.lookup.refresh(siamese_weight=siamese_moved, few_rows=False)
                siamese_moved = learner.siamese_step == "minibatch" or number == len(minibatches)
                counted_over = replace(settings, row_count=row_counts[number - 1])
                steps.append(self._step(part, kept, lr, counted_over, siamese_moved))
        return steps

    def _row_counts(self, minibatches: list[Minibatch]) -> list[int | None]:
        """Rows of all workers in each minibatch; None where there is one worker."""
        if self.peers.count == 1:
            return [None] * len(minibatches)
        return [int(sum(counts)) for counts in zip(*self.peers.told(*(len(m.rows) for m in minibatches)), strict=True)]

    def _step(
        self, part: Minibatch, kept: Activations | None, lr: float, settings: LossSettings, siamese_moves: bool
    ) -> StepFigures:
        """One step of the optimisers, of the first layer's weight where it moves."""
        learner = self.learner
        known = part.history, part.target, part.pairs_per_scene
        activations = kept or self.lookup.forward(*known, history_of=part.history_of)
        loss, gradient = loss_gradient(part.by_row(activations.output), part.rows, settings)
        self.lookup.backward(*known, activations, part.by_pair(gradient), part.history_of)
        if siamese_moves:
            self.lookup.siamese_gradient()
        gradients = self.network.layer_gradients()[0 if siamese_moves else 1 :]
        own = self._add_up_gradients(siamese_moves)
        norm = clip_gradients(gradients, learner.clip_norm, learner.clip_each_tensor, *own)
        self.optimiser.step(lr)
        if siamese_moves:
            self.siamese_optimiser.step(lr * learner.siamese_lr)
        return StepFigures(loss, norm, len(part.rows), part.pair_count, part.history_count)

    def _add_up_gradients(self, siamese_moves: bool) -> tuple[int, Tensor | None]:
        """Add up over workers; what `clip_gradients` has to know of those that only one of them has."""
        if self.peers.count == 1:
            return 0, None
        sent_as = torch.bfloat16 if self.learner.sent_gradients == "bfloat16" else None
        return self.share.add_up_gradients(self.network, self.learner.heads_by_scene, siamese_moves, sent_as)

    def _rebalance(self) -> None:
        """Draw targets more often that are reached less often, and own goals as far as there are any."""
        choice, learner = self.navigation.choice, self.learner
        if self.own_goals:
            choice.reweigh(self.own_goals.weights(choice, 1 + learner.balance * (1 - self.statistics.recent_success)))
        elif learner.balance:
            choice.reweigh(balanced_weights(choice, self.statistics.recent_success, learner.balance))

    def fixed_tensors(self) -> dict[str, Tensor]:
        """The map that prepares features."""
        return joined({"features": self.feature_map.tensors()})

    def close(self) -> None:
        """Nothing is held that would have to be given back; see `Learning` in `train`."""

    def tensors(self) -> dict[str, Tensor]:
        """All that `load_tensors` needs to go on bit for bit, besides `frames` and `updates`."""
        parts: dict[str, dict[str, Tensor]] = {
            "network": {name: p.data for name, p in self.network.named_parameters()},
            "optimiser": {**self.siamese_optimiser.tensors(), **self.optimiser.tensors()},
            "navigation": self.navigation.tensors(),
            "statistics": self.statistics.tensors(),
            "actions": {"drawn": self.action_stream.drawn},
            "choice": {"weights": self.navigation.choice.weights},
            "observed": {"next_state": self.observed.next_state},
        }
        if self.own_goals:
            parts["own_goals"] = {"known": self.own_goals.known}
        own = {name: tensor.detach() for name, tensor in joined(parts).items()}
        return self.share.joined(own, self.learner.heads_by_scene, self.world.sightings)

    @torch.no_grad()
    def load_tensors(self, tensors: dict[str, Tensor], frames: int, updates: int) -> None:
        """Go on from where `tensors` was called, after that many frames and updates, by however many workers."""
        tensors = self.share.own_part(tensors, self.env_counts, self.learner.heads_by_scene, self.world.sightings)
        for name, parameter in self.network.named_parameters():
            parameter.copy_(tensors[f"network.{name}"])
        for optimiser in (self.siamese_optimiser, self.optimiser):
            optimiser.load_tensors(part_of(tensors, "optimiser"))
        self.navigation.load_tensors(part_of(tensors, "navigation"))
        self.statistics.load_tensors(part_of(tensors, "statistics"))
        self.action_stream.seek(tensors["actions.drawn"].to(self.world.device).clone())
        self.observed.next_state = tensors["observed.next_state"].to(self.world.device).clone()
        self.navigation.choice.reweigh(tensors["choice.weights"].to(self.world.device).clone())
        if self.own_goals:
            self.own_goals.known = tensors["own_goals.known"].to(self.world.device).clone()
        self.frames, self.updates = frames, updates
        self._seat(max(updates - 1, 0))
        self.lookup.refresh()


def balanced_weights(choice: TargetChoice, success: Tensor, balance: float) -> Tensor:
    """Weights (G, J) by which targets are drawn more often that are reached less often; `success` (M,) of each target.

    1 + balance (1 - success); what is never drawn keeps its 0.
    """
    weight = 1 + balance * (1 - success)
    return torch.where(choice.weights > 0, weight[choice.members], 0.0)
