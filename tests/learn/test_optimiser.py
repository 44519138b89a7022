import copy
import math

import pytest
import torch
from torch import Tensor, nn

from clearway.learn.optimiser import Adam, Optimiser, SharedRMSProp, clip_gradients
from helpers.small_runs import equal_bits


class Two(nn.Module):
    """Two parameter tensors with given gradients."""

    def __init__(self) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.tensor([[1.0, -2.0], [0.5, 3.0]]))
        self.bias = nn.Parameter(torch.tensor([0.25]))


def give_gradients(network: nn.Module, seed: int) -> None:
    rng = torch.Generator().manual_seed(seed)
    for parameter in network.parameters():
        parameter.grad = torch.randn(parameter.shape, generator=rng)


def test_rmsprop_starts_at_1_and_has_epsilon_inside_the_root() -> None:
    network = Two()
    optimiser = SharedRMSProp(dict(network.named_parameters()))
    network.weight.grad, network.bias.grad = torch.zeros(2, 2), torch.tensor([2.0])
    optimiser.step(0.01)
    mean_square = 0.99 * 1 + 0.01 * 4  # 1.03
    expected = 0.25 - 0.01 * 2 / math.sqrt(mean_square + 0.1)
    assert network.bias.item() == pytest.approx(expected, rel=1e-6)
    assert network.weight.tolist() == [[1.0, -2.0], [0.5, 3.0]]
    optimiser.step(0.01)
    mean_square = 0.99 * mean_square + 0.01 * 4
    expected -= 0.01 * 2 / math.sqrt(mean_square + 0.1)
    assert network.bias.item() == pytest.approx(expected, rel=1e-6)


def test_adam_is_pytorch_s() -> None:
    network = Two()
    other = copy.deepcopy(network)
    optimiser = Adam(dict(network.named_parameters()))
    reference = torch.optim.Adam(other.parameters(), lr=1e-3, eps=1e-8)
    for step in range(5):
        give_gradients(network, step)
        give_gradients(other, step)
        lr = 1e-3 / (step + 1)
        reference.param_groups[0]["lr"] = lr
        optimiser.step(lr)
        reference.step()
    for here, there in zip(network.parameters(), other.parameters(), strict=True):
        torch.testing.assert_close(here, there, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("kind", [Adam, SharedRMSProp])
def test_tensors_bring_an_optimiser_back_bit_for_bit(kind: type[Adam] | type[SharedRMSProp]) -> None:
    network = Two()
    optimiser: Optimiser = kind(dict(network.named_parameters()))
    for step in range(3):
        give_gradients(network, step)
        optimiser.step(0.01)
    resumed_network = copy.deepcopy(network)
    resumed: Optimiser = kind(dict(resumed_network.named_parameters()))
    resumed.load_tensors({name: tensor.clone() for name, tensor in optimiser.tensors().items()})
    for step in range(3, 6):
        for each, its_optimiser in ((network, optimiser), (resumed_network, resumed)):
            give_gradients(each, step)
            its_optimiser.step(0.01)
    assert equal_bits(dict(network.named_parameters()), dict(resumed_network.named_parameters()))
    assert equal_bits(optimiser.tensors(), resumed.tensors())


def gradients_3_4_and_12() -> list[Tensor]:
    """Two gradients of norm 5 and 12, 13 together."""
    return [torch.tensor([3.0, 4.0]), torch.tensor([12.0])]


def test_clipping_all_together() -> None:
    gradients = gradients_3_4_and_12()
    assert clip_gradients(gradients, 6.5, each_tensor=False).item() == 13.0
    assert [gradient.tolist() for gradient in gradients] == [[1.5, 2.0], [6.0]]


def test_clipping_each_tensor_by_itself() -> None:
    gradients = gradients_3_4_and_12()
    assert clip_gradients(gradients, 6.0, each_tensor=True).item() == 13.0
    assert [gradient.tolist() for gradient in gradients] == [[3.0, 4.0], [6.0]]  # 5 is within the limit


@pytest.mark.parametrize("each_tensor", [False, True])
def test_small_and_zero_gradients_stay(each_tensor: bool) -> None:
    gradients = [torch.tensor([3.0, 4.0]), torch.zeros(1)]
    clip_gradients(gradients, 40.0, each_tensor)
    assert [gradient.tolist() for gradient in gradients] == [[3.0, 4.0], [0.0]]
