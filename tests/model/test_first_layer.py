"""What `VisitedStates` keeps. That it computes what `AllStates` does is tested in `test_lookup`."""

import pytest
import torch
from torch import Tensor

from clearway.model import first_layer
from clearway.model.first_layer import AllStates, VisitedStates

STATES, FEATURES, WIDTH, HISTORY = 50, 6, 5, 3
TARGETS = torch.tensor([4, 49])


def made_layers(
    features_type: torch.dtype = torch.float32, dtype: torch.dtype = torch.float32
) -> tuple[AllStates, VisitedStates]:
    """Both of the same weight and features."""
    generator = torch.Generator().manual_seed(0)
    weight = torch.randn(HISTORY, WIDTH, FEATURES, generator=generator)
    features = torch.randn(STATES, FEATURES, generator=generator).to(features_type)
    layers = (
        AllStates(weight.clone(), features.float(), TARGETS, dtype),
        VisitedStates(weight, features, TARGETS, dtype),
    )
    for layer in layers:
        layer.refresh(keep=False)
    return layers


def histories(first: int, last: int, rows: int = 20) -> Tensor:
    return torch.randint(first, last, (rows, HISTORY), generator=torch.Generator().manual_seed(first))


def gradient(layer: AllStates | VisitedStates, batches: list[Tensor]) -> Tensor:
    for number, history in enumerate(batches):
        grad_seen, grad_wanted = torch.ones(len(history), WIDTH) * (number + 1), torch.ones(2, WIDTH)
        layer.add(history, grad_seen, grad_wanted, begin=number == 0)
    out = torch.full((HISTORY, WIDTH, FEATURES), torch.nan)
    layer.gradient(out)
    return out


def test_only_states_that_occur_are_projected_and_each_once() -> None:
    everything, visited = made_layers()
    assert visited.known == 0
    for history in (histories(0, 10), histories(0, 10), histories(5, 15)):
        torch.testing.assert_close(visited.seen(history), everything.seen(history))
    occurred = torch.cat([histories(0, 10), histories(5, 15)]).unique()
    assert visited.known == len(occurred)
    assert torch.equal((visited.row_of >= 0).nonzero()[:, 0], occurred)
    for layer in (everything, visited):
        layer.weight.mul_(2)
        layer.refresh(keep=True)
    assert visited.known == len(occurred)
    torch.testing.assert_close(visited.seen(histories(0, 10)), everything.seen(histories(0, 10)))
    visited.refresh(keep=False)
    assert visited.known == 0


def test_batches_that_bring_new_states_add_up() -> None:
    everything, visited = made_layers()
    batches = [histories(0, 10), histories(20, 50), histories(0, 50)]
    torch.testing.assert_close(gradient(visited, batches), gradient(everything, batches))
    torch.testing.assert_close(gradient(visited, batches[1:]), gradient(everything, batches[1:]))


def test_float16_features_give_what_their_rounded_values_give() -> None:
    everything, visited = made_layers(torch.float16)
    batches = [histories(0, 10), histories(20, 50)]
    torch.testing.assert_close(visited.seen(batches[1]), everything.seen(batches[1]))
    torch.testing.assert_close(gradient(visited, batches), gradient(everything, batches))


def test_what_is_kept_without_learning_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(first_layer, "MOST_ROWS", 12)
    everything, visited = made_layers()
    for first in range(0, 40, 5):
        history = histories(first, first + 10)
        torch.testing.assert_close(visited.seen(history), everything.seen(history))
        assert visited.known <= 12


def test_rows_that_are_being_learnt_from_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(first_layer, "MOST_ROWS", 12)
    everything, visited = made_layers()
    batches = [histories(0, 10), histories(20, 50)]
    torch.testing.assert_close(gradient(visited, batches), gradient(everything, batches))


def test_round_numbers_of_rows_leave_nothing_of_other_states_behind() -> None:
    """With bfloat16 factors products take some rows more than there are states, of what was there before."""
    everything, visited = made_layers(dtype=torch.bfloat16)
    for batches in ([histories(0, 50)], [histories(0, 10), histories(20, 50), histories(3, 4)], [histories(7, 8)]):
        for layer in (everything, visited):
            layer.refresh(keep=False)
        torch.testing.assert_close(visited.seen(batches[0]), everything.seen(batches[0]))
        torch.testing.assert_close(gradient(visited, batches), gradient(everything, batches), rtol=0.02, atol=0.05)
    visited.refresh(keep=True)
    everything.refresh(keep=True)
    torch.testing.assert_close(visited.seen(histories(7, 8)), everything.seen(histories(7, 8)))
