import pytest
import torch
from torch import Tensor

from clearway.learn.returns import generalised_advantages, vtrace


def column(*values: float) -> Tensor:
    """(T, 1)."""
    return torch.tensor(values)[:, None]


def test_generalised_advantages_worked_by_hand() -> None:
    # First environment: discount 0.5 throughout. Second: its episode ends in step 1.
    reward = torch.tensor([[1.0, 0.0], [0.0, 10.0], [2.0, 0.0]])
    discount = torch.tensor([[0.5, 0.5], [0.5, 0.0], [0.5, 0.5]])
    value = torch.tensor([[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]])
    after = torch.tensor([4.0, 4.0])
    found = generalised_advantages(reward, discount, value, after, 0.5)
    # delta: [1, -0.5, 1] and [0, 8, -1]; A_t = delta_t + 0.25 A_{t+1}, cut after the end
    assert found.T.tolist() == [[0.9375, -0.25, 1.0], [2.0, 8.0, -1.0]]


def test_lambda_1_gives_n_step_returns_minus_the_value() -> None:
    reward, value = column(1.0, 0.0, 2.0), column(1.0, 2.0, 3.0)
    found = generalised_advantages(reward, torch.full((3, 1), 0.5), value, torch.tensor([4.0]), 1.0)
    # R_0 = 1 + 0.25 * 2 + 0.125 * 4 = 2, R_1 = 0.5 * 2 + 0.25 * 4 = 2, R_2 = 2 + 0.5 * 4 = 4
    assert (found + value)[:, 0].tolist() == [2.0, 2.0, 4.0]


def test_lambda_0_gives_one_step_errors() -> None:
    reward, value = column(1.0, 0.0, 2.0), column(1.0, 2.0, 3.0)
    found = generalised_advantages(reward, torch.full((3, 1), 0.5), value, torch.tensor([4.0]), 0.0)
    assert found[:, 0].tolist() == [1.0, -0.5, 1.0]


def test_nothing_crosses_the_end_of_an_episode() -> None:
    reward, value, discount = torch.randn(6, 3), torch.randn(6, 3), torch.full((6, 3), 0.9)
    discount[2] = 0.0
    before = generalised_advantages(reward, discount, value, torch.randn(3), 0.95)
    reward[3:], value[3:] = 100.0, -50.0
    later = generalised_advantages(reward, discount, value, torch.randn(3), 0.95)
    assert torch.equal(before[:3], later[:3])
    assert not torch.equal(before[3:], later[3:])


@pytest.mark.parametrize(
    ("trace_lambda", "targets", "advantages"),
    [
        (1.0, [0.46875, 0.875, 1.75], [-0.03125, -0.125, -0.25]),
        (0.5, [0.4921875, 0.9375, 1.75], [-0.015625, -0.125, -0.25]),
    ],
)
def test_vtrace_worked_by_hand(trace_lambda: float, targets: list[float], advantages: list[float]) -> None:
    # rho = [0.5, 1 (of 2), 0.25]; delta = [0, 0, -0.25]
    target, advantage = vtrace(
        column(0.0, 0.0, 1.0),
        column(0.5, 0.5, 0.0),
        column(0.5, 1.0, 2.0),
        column(0.5, 2.0, 0.25),
        column(1.0, 1.0, 1.0).bool(),
        trace_lambda,
    )
    assert target[:, 0].tolist() == targets
    assert advantage[:, 0].tolist() == advantages


def test_vtrace_on_policy_gives_n_step_returns() -> None:
    rng = torch.Generator().manual_seed(0)
    reward, value = torch.randn(7, 4, generator=rng), torch.randn(7, 4, generator=rng)
    discount = torch.full((7, 4), 0.9)
    discount[-1] = 0.0
    discount[2, 1] = 0.0
    every = torch.ones(7, 4, dtype=torch.bool)
    target, advantage = vtrace(reward, discount, value, torch.ones(7, 4), every, 1.0)
    expected = generalised_advantages(reward, discount, value, torch.zeros(4), 1.0)
    torch.testing.assert_close(target - value, expected)
    torch.testing.assert_close(advantage, expected)


def test_vtrace_segments_do_not_see_each_other_or_what_lies_between() -> None:
    """Two segments in one column, a gap of unused steps between them, against each by itself."""
    rng = torch.Generator().manual_seed(1)
    reward, value = torch.randn(6, 1, generator=rng), torch.randn(6, 1, generator=rng)
    ratio = torch.rand(6, 1, generator=rng) * 2
    discount = column(0.9, 0.0, 0.9, 0.9, 0.9, 0.0)
    used = column(1, 1, 0, 0, 1, 1).bool()
    target, advantage = vtrace(reward, discount, value, ratio, used, 0.95)
    for part in (slice(0, 2), slice(4, 6)):
        alone = vtrace(reward[part], discount[part], value[part], ratio[part], used[part], 0.95)
        assert torch.equal(target[part], alone[0])
        assert torch.equal(advantage[part], alone[1])


def test_a_step_that_the_policy_would_never_take_teaches_nothing() -> None:
    target, advantage = vtrace(column(10.0), column(0.0), column(3.0), column(0.0), column(1.0).bool(), 0.95)
    assert target.item() == 3.0
    assert advantage.item() == 0.0
