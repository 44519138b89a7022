"""The two optimisers, and the clipping of gradients."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, Protocol

import torch
from torch import Tensor
from torch.nn import Parameter
from torch.optim.adam import adam

from clearway.model.network import SiameseActorCritic

BETAS = 0.9, 0.999  # of Adam's two moments
ALPHA, EPSILON = 0.99, 0.1  # of the published RMSProp


class Optimiser(Protocol):
    """Changes parameters along their `.grad`."""

    def step(self, lr: float) -> None:
        """One step with the given learning rate."""

    def tensors(self) -> dict[str, Tensor]:
        """All that `load_tensors` needs to go on from here."""

    def load_tensors(self, tensors: dict[str, Tensor]) -> None:
        """Go on from where `tensors` was called."""


class Adam:
    """PyTorch's fused Adam (Kingma & Ba, 2015).

    By its functional form: to make a `torch.optim.Adam` imports PyTorch's compiler, which takes a second.
    """

    def __init__(self, named: Mapping[str, Parameter], epsilon: float = 1e-8) -> None:
        self.named, self.epsilon = named, epsilon
        self.state = {
            name: {
                "step": torch.zeros((), dtype=torch.float32, device=parameter.device),
                "exp_avg": torch.zeros_like(parameter, requires_grad=False),
                "exp_avg_sq": torch.zeros_like(parameter, requires_grad=False),
            }
            for name, parameter in named.items()
        }

    @torch.no_grad()
    def step(self, lr: float) -> None:
        """One step with the given learning rate; parameters without a gradient stay as they are."""
        moved = {name: value.grad for name, value in self.named.items() if value.grad is not None}
        states = [self.state[name] for name in moved]
        adam(
            [self.named[name] for name in moved],
            list(moved.values()),
            [state["exp_avg"] for state in states],
            [state["exp_avg_sq"] for state in states],
            max_exp_avg_sqs=[],  # of AMSGrad, which this is not
            state_steps=[state["step"] for state in states],
            fused=True,
            amsgrad=False,
            beta1=BETAS[0],
            beta2=BETAS[1],
            lr=lr,
            weight_decay=0.0,
            eps=self.epsilon,
            maximize=False,
        )

    def tensors(self) -> dict[str, Tensor]:
        """Moments and step counts by parameter."""
        return {f"{key}.{name}": value for name, state in self.state.items() for key, value in state.items()}

    def load_tensors(self, tensors: dict[str, Tensor]) -> None:
        """Set moments and step counts."""
        for name, state in self.state.items():
            for key, value in state.items():
                value.copy_(tensors[f"{key}.{name}"])


class SharedRMSProp:
    """The RMSProp of A3C (Mnih et al., 2016) as Zhu et al. set it: epsilon inside the root, mean square starting at 1.

    ms <- alpha ms + (1 - alpha) g^2;   parameter <- parameter - lr g / sqrt(ms + epsilon)
    """

    def __init__(self, named: Mapping[str, Parameter], alpha: float = ALPHA, epsilon: float = EPSILON) -> None:
        self.named = named
        self.alpha, self.epsilon = alpha, epsilon
        self.mean_square = {name: torch.ones_like(parameter) for name, parameter in self.named.items()}

    @torch.no_grad()
    def step(self, lr: float) -> None:
        """One step with the given learning rate."""
        for name, parameter in self.named.items():
            gradient, mean_square = parameter.grad, self.mean_square[name]
            assert gradient is not None
            mean_square.mul_(self.alpha).addcmul_(gradient, gradient, value=1 - self.alpha)
            parameter.addcdiv_(gradient, (mean_square + self.epsilon).sqrt_(), value=-lr)

    def tensors(self) -> dict[str, Tensor]:
        """Mean squares by parameter."""
        return {f"mean_square.{name}": value for name, value in self.mean_square.items()}

    def load_tensors(self, tensors: dict[str, Tensor]) -> None:
        """Set the mean squares."""
        for name, value in self.mean_square.items():
            value.copy_(tensors[f"mean_square.{name}"])


def optimisers(network: SiameseActorCritic, kind: Literal["adam", "rmsprop"]) -> tuple[Optimiser, Optimiser]:
    """Of the first layer's weight, and of all other parameters."""
    made = Adam if kind == "adam" else SharedRMSProp
    named = dict(network.named_parameters())
    siamese = {"siamese_weight": named.pop("siamese_weight")}
    return made(siamese), made(named)


@torch.no_grad()
def clip_gradients(
    gradients: Sequence[Tensor], limit: float, each_tensor: bool, own: int = 0, own_squares: Tensor | None = None
) -> Tensor:
    """Scale gradients down, in place, to a norm of at most `limit`; returns the norm of all before that, a scalar.

    With `each_tensor` every one is clipped by itself, as TensorFlow's clip_by_norm in Zhu's code.

    Args:
        gradients: all that this worker has.
        limit: the largest norm.
        each_tensor: see above.
        own: how many of the last ones no other worker has.
        own_squares: a scalar, the squares of these and of the others' own, added up; None where nobody has any.
    """
    norms = torch.stack([torch.linalg.vector_norm(gradient) for gradient in gradients])
    norm = torch.linalg.vector_norm(norms)
    if own_squares is not None:
        norm = torch.sqrt(norms[: len(norms) - own].square().sum() + own_squares)
    for gradient, length in zip(gradients, norms, strict=True):
        gradient.mul_((limit / (length if each_tensor else norm).clamp_min(1e-12)).clamp(max=1.0))
    return norm
