"""Where a GPU would have to wait for the host, or the host for it: seen on the CPU, by the operations asked for."""

from collections.abc import Callable
from typing import Any

import pytest
import torch
from torch import Tensor
from torch.overrides import TorchFunctionMode
from torch.utils._python_dispatch import TorchDispatchMode

from clearway.learn.on_policy import OnPolicy
from clearway.learn.presets import DEFAULT, PAPER_A2C
from clearway.learn.trainer import Trainer
from helpers.small_runs import small_learner, small_trainer

SIZED_BY_VALUES = ("nonzero", "_unique2", "unique_consecutive", "unique_dim", "masked_select", "bincount")
READ = (
    torch.tensor,
    Tensor.tolist,
    Tensor.item,
    Tensor.numpy,
    Tensor.cpu,
    Tensor.__bool__,
    Tensor.__int__,
    Tensor.__float__,
)


class Operations(TorchDispatchMode):
    """Notes operations whose result has a size, or is a number, that the host learns from the device."""

    def __init__(self, found: list[str]) -> None:
        super().__init__()
        self.found = found

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        name = func.overloadpacket.__name__
        indices = args[1] if name in ("index", "index_put", "index_put_") else ()
        masked = any(index is not None and index.dtype == torch.bool for index in indices)
        if masked or name in SIZED_BY_VALUES or (name == "repeat_interleave" and "output_size" not in (kwargs or {})):
            self.found.append(name)
        return func(*args, **(kwargs or {}))


class Reads(TorchFunctionMode):
    """Notes tensors that Python reads the values of, or makes of values: copying those waits too."""

    def __init__(self, found: list[str]) -> None:
        super().__init__()
        self.found = found

    def __torch_function__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        if func in READ:
            self.found.append(func.__name__)
        return func(*args, **(kwargs or {}))


def waits(work: Callable[[], object]) -> list[str]:
    """What the host would wait for."""
    found: list[str] = []
    with Reads(found), Operations(found):
        work()
    return found


def trainer_after_a_while(learner: OnPolicy, **changes: Any) -> Trainer:
    """A trainer whose episodes end now and then, on four times as many rows as states: all states are projected."""
    trainer = small_trainer(small_learner(learner, envs=20, frames=100_000, **changes))
    for _ in range(3):
        trainer.update()
    return trainer


@pytest.mark.parametrize(
    "work",
    [
        lambda t: t.nonzero(),
        lambda t: t[t > 0],
        lambda t: t.sum().item(),
        lambda t: t.tolist(),
        lambda t: torch.tensor([1]),
    ],
)
def test_what_waits_is_found(work: Callable[[Tensor], object]) -> None:
    assert len(waits(lambda: work(torch.ones(3)))) == 1


@pytest.mark.parametrize("learner", [DEFAULT, PAPER_A2C])
def test_a_rollout_never_waits(learner: OnPolicy) -> None:
    trainer = trainer_after_a_while(learner)
    trainer.lookup.refresh()
    assert waits(lambda: trainer.collector.collect()) == []


def test_an_update_of_a2c_waits_once_for_its_figures() -> None:
    trainer = trainer_after_a_while(PAPER_A2C)
    ended = trainer.statistics.totals[:, 0].sum()
    assert waits(trainer.update) == ["tolist"]
    assert trainer.statistics.totals[:, 0].sum() > ended


def test_ppo_s_waits_do_not_grow_with_the_number_of_minibatches() -> None:
    few, many = (waits(trainer_after_a_while(DEFAULT, minibatches=count).update) for count in (2, 5))
    assert few == many
    assert 0 < len(few) < 30
