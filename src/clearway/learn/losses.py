"""The loss that A2C and PPO share, as a pure function of a batch.

    L = mean( -min(ratio A, clip(ratio, 1 - c, 1 + c) A) - entropy_weight H(pi) + value_weight / 2 (R - V)^2
              - barrier_weight mean_a log pi(a) - lookahead_weight sum_a better(a) log pi(a) )

(Schulman et al., 2017, equation 9; the last term is the log barrier of Agarwal et al., JMLR 2021, section 5.2.) On the
first pass over a rollout the ratio is 1 and its gradient is A2C's, -A grad log pi, so A2C is the case of one pass.
Zhu's 0.25 (R - V)^2 is value_weight 0.5.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from clearway.learn.on_policy import OnPolicy
from clearway.scenes.actions import ACTION_COUNT


@dataclass(frozen=True)
class Batch:
    """Rows to learn from, ordered by scene.

    Attributes:
        history: (B, K) int64 states.
        target: (B,) int64.
        action: (B,) int64.
        log_prob: (B,) of the action when it was taken.
        advantage, value_target: (B,).
        rows_per_scene: number of rows of each scene.
        better: (B, A) probabilities that the policy is drawn towards, see `lookahead`; all 0 in rows without; or None.
    """

    history: Tensor
    target: Tensor
    action: Tensor
    log_prob: Tensor
    advantage: Tensor
    value_target: Tensor
    rows_per_scene: tuple[int, ...]
    better: Tensor | None = None

    def __len__(self) -> int:
        """B."""
        return len(self.action)

    def rows(self, index: Tensor, rows_per_scene: tuple[int, ...]) -> Batch:
        """The rows in index (b,) int64, which must keep the order of scenes."""
        return Batch(
            self.history[index],
            self.target[index],
            self.action[index],
            self.log_prob[index],
            self.advantage[index],
            self.value_target[index],
            rows_per_scene,
            None if self.better is None else self.better[index],
        )


def merged(first: Batch, second: Batch) -> Batch:
    """The rows of two batches, each ordered by scene, as one batch ordered by scene; `better` is the first one's."""
    scenes = torch.arange(len(first.rows_per_scene), device=first.action.device)
    rows = torch.tensor([first.rows_per_scene, second.rows_per_scene], device=scenes.device).flatten()
    scene = scenes.repeat(2).repeat_interleave(rows, output_size=len(first) + len(second))
    order = torch.argsort(scene, stable=True)

    better = None
    if first.better is not None:
        better = torch.cat([first.better, first.better.new_zeros(len(second), ACTION_COUNT)])[order]

    def joined(name: str) -> Tensor:
        return torch.cat([getattr(first, name), getattr(second, name)])[order]

    return Batch(
        history=joined("history"),
        target=joined("target"),
        action=joined("action"),
        log_prob=joined("log_prob"),
        advantage=joined("advantage"),
        value_target=joined("value_target"),
        better=better,
        rows_per_scene=tuple(a + b for a, b in zip(first.rows_per_scene, second.rows_per_scene, strict=True)),
    )


@dataclass(frozen=True)
class LossSettings:
    """Weights and limits of the loss, see the head of this file; `sum_loss`: sum over rows rather than average."""

    entropy_weight: float
    value_weight: float
    ratio_clip: float
    """Infinite: ratios are not clipped."""
    sum_loss: bool
    barrier_weight: float = 0.0
    lookahead_weight: float = 0.0
    row_count: int | None = None
    """Rows that means are over, those of other workers among them; None: the batch's own."""

    @classmethod
    def after(cls, frames: int, learner: OnPolicy) -> LossSettings:
        """A learner's settings after that many frames."""
        return cls(
            learner.entropy_weight_at(frames),
            learner.value_weight,
            learner.ratio_clip,
            learner.sum_loss,
            learner.barrier_weight_at(frames),
            learner.lookahead_weight_at(frames),
        )


@dataclass(frozen=True)
class LossTerms:
    """The loss and its parts, scalars."""

    total: Tensor
    policy: Tensor
    value: Tensor
    entropy: Tensor
    clipped: Tensor
    """Share of rows whose ratio lies outside the clip."""


def actor_critic_loss(output: Tensor, batch: Batch, settings: LossSettings) -> LossTerms:
    """The loss of network outputs (B, A + 1): action scores, then the value."""

    def mean(values: Tensor) -> Tensor:
        return values.mean() if settings.row_count is None else values.sum() / settings.row_count

    log_pi = torch.log_softmax(output[:, :ACTION_COUNT], 1)
    entropy = -(log_pi.exp() * log_pi).sum(1)
    ratio = (log_pi.gather(1, batch.action[:, None])[:, 0] - batch.log_prob).exp()
    limited = ratio.clamp(1 - settings.ratio_clip, 1 + settings.ratio_clip)
    policy = -torch.minimum(ratio * batch.advantage, limited * batch.advantage)
    value = 0.5 * (batch.value_target - output[:, ACTION_COUNT]).square()
    each = policy - settings.entropy_weight * entropy + settings.value_weight * value
    each = each - settings.barrier_weight * log_pi.mean(1)
    if batch.better is not None:
        each = each - settings.lookahead_weight * (batch.better * log_pi).sum(1)
    total = each.sum() if settings.sum_loss else mean(each)
    clipped = mean((ratio != limited).float())
    return LossTerms(total, mean(policy), mean(value), mean(entropy), clipped)


def loss_gradient(output: Tensor, batch: Batch, settings: LossSettings) -> tuple[LossTerms, Tensor]:
    """The loss and its gradient with respect to the outputs, (B, A + 1)."""
    leaf = output.detach().requires_grad_()
    with torch.enable_grad():
        terms = actor_critic_loss(leaf, batch, settings)
        (gradient,) = torch.autograd.grad(terms.total, leaf)
    return LossTerms(**{name: value.detach() for name, value in vars(terms).items()}), gradient
