import math
from dataclasses import replace

import pytest
import torch
from torch import Tensor

from clearway.learn.losses import Batch, LossSettings, actor_critic_loss, loss_gradient, merged
from clearway.learn.presets import DEFAULT, PAPER_A2C

LOG_4 = math.log(4)
SETTINGS = LossSettings(entropy_weight=0.1, value_weight=0.5, ratio_clip=0.2, sum_loss=False)


def made_batch(action: list[int], log_prob: list[float], advantage: list[float], value_target: list[float]) -> Batch:
    """A batch whose states do not matter."""
    count = len(action)
    return Batch(
        torch.zeros(count, 4, dtype=torch.int64),
        torch.zeros(count, dtype=torch.int64),
        torch.tensor(action),
        torch.tensor(log_prob),
        torch.tensor(advantage),
        torch.tensor(value_target),
        (count,),
    )


def uniform_output(value: float, rows: int = 1) -> Tensor:
    """Equal scores for all actions, and a value."""
    return torch.tensor([[0.0, 0.0, 0.0, 0.0, value]]).repeat(rows, 1)


def random_case(rows: int) -> tuple[Tensor, Batch]:
    """Outputs (B, 5) and a batch on its first pass: log_prob is the outputs' own."""
    rng = torch.Generator().manual_seed(0)
    output = torch.randn(rows, 5, generator=rng)
    action = torch.randint(4, (rows,), generator=rng)
    log_prob = torch.log_softmax(output[:, :4], 1)[torch.arange(rows), action]
    batch = made_batch(action.tolist(), [0.0] * rows, [0.0] * rows, [0.0] * rows)
    return output, replace(
        batch,
        log_prob=log_prob,
        advantage=torch.randn(rows, generator=rng),
        value_target=torch.randn(rows, generator=rng),
    )


def test_terms_worked_by_hand() -> None:
    terms = actor_critic_loss(uniform_output(1.0), made_batch([2], [-LOG_4], [2.0], [3.0]), SETTINGS)
    assert terms.policy.item() == pytest.approx(-2.0)
    assert terms.value.item() == pytest.approx(2.0)  # half of (3 - 1)^2
    assert terms.entropy.item() == pytest.approx(LOG_4)
    assert terms.clipped.item() == 0.0
    assert terms.total.item() == pytest.approx(-2.0 - 0.1 * LOG_4 + 0.5 * 2.0)


@pytest.mark.parametrize(("frames", "entropy", "left"), [(0, 0.1, 1.0), (400, 0.01, 0.5), (800, 0.001, 0.0)])
def test_weights_are_the_learner_s_at_that_many_frames(frames: int, entropy: float, left: float) -> None:
    learner = replace(
        DEFAULT,
        frames=800,
        entropy_start=0.1,
        entropy_end=0.001,
        log_barrier=0.3,
        lookahead=0.05,
        settle=0.0,
        value_weight=0.7,
        ratio_clip=0.25,
    )
    found = LossSettings.after(frames, learner)
    assert (found.value_weight, found.ratio_clip, found.sum_loss) == (0.7, 0.25, False)
    assert found.entropy_weight == pytest.approx(entropy)
    assert found.barrier_weight == pytest.approx(0.3 * left)
    assert found.lookahead_weight == pytest.approx(0.05 * left)
    assert LossSettings.after(frames, PAPER_A2C).sum_loss


def test_value_weight_a_half_is_zhu_s_quarter_of_the_squared_error() -> None:
    batch = made_batch([0], [-LOG_4], [0.0], [3.0])
    terms = actor_critic_loss(uniform_output(-1.0), batch, replace(SETTINGS, entropy_weight=0.0))
    assert terms.total.item() == pytest.approx(0.25 * (3 - -1) ** 2)


def test_sum_is_the_mean_times_the_rows() -> None:
    output, batch = random_case(6)
    mean, gradient = loss_gradient(output, batch, SETTINGS)
    total, summed = loss_gradient(output, batch, replace(SETTINGS, sum_loss=True))
    assert total.total.item() == pytest.approx(6 * mean.total.item(), rel=1e-5)
    torch.testing.assert_close(summed, 6 * gradient)
    assert total.policy.item() == pytest.approx(mean.policy.item())  # the parts are means either way


def test_on_the_first_pass_the_gradient_is_a2c_s() -> None:
    """d/dscores = (pi - 1_a) A + w pi (log pi + H);  d/dV = v (V - R)."""
    output, batch = random_case(9)
    _, gradient = loss_gradient(output, batch, SETTINGS)
    log_pi = torch.log_softmax(output[:, :4], 1)
    pi = log_pi.exp()
    entropy = -(pi * log_pi).sum(1, keepdim=True)
    taken = torch.nn.functional.one_hot(batch.action, 4)
    expected = torch.empty(9, 5)
    expected[:, :4] = (pi - taken) * batch.advantage[:, None] + 0.1 * pi * (log_pi + entropy)
    expected[:, 4] = 0.5 * (output[:, 4] - batch.value_target)
    torch.testing.assert_close(gradient, expected / 9)


@pytest.mark.parametrize(
    ("ratio", "advantage", "policy_loss", "moves"),
    [
        (2.0, 1.0, -1.2, False),  # already likelier by more than the clip: no further
        (2.0, -1.0, 2.0, True),  # wrongly likelier: pull back
        (0.5, 1.0, -0.5, True),  # wrongly unlikelier: pull back
        (0.5, -1.0, 0.8, False),  # already unlikelier by more than the clip: no further
    ],
)
def test_the_clip_stops_only_steps_that_go_too_far(
    ratio: float, advantage: float, policy_loss: float, moves: bool
) -> None:
    batch = made_batch([1], [-LOG_4 - math.log(ratio)], [advantage], [0.0])
    terms, gradient = loss_gradient(uniform_output(0.0), batch, replace(SETTINGS, entropy_weight=0.0))
    assert terms.policy.item() == pytest.approx(policy_loss, rel=1e-5)
    assert terms.clipped.item() == 1.0
    assert bool(gradient[0, :4].any()) == moves
    if moves:  # a positive advantage makes the action likelier: its score rises against the gradient
        assert (gradient[0, 1] < 0) == (advantage > 0)


def test_entropy_alone_pulls_towards_uniform() -> None:
    output = torch.tensor([[2.0, 0.0, 0.0, 0.0, 0.0]])
    log_prob = torch.log_softmax(output[0, :4], 0)[0].item()
    _, gradient = loss_gradient(output, made_batch([0], [log_prob], [0.0], [0.0]), SETTINGS)
    assert gradient[0, 0] > 0  # descending lowers the score that stands out
    assert (gradient[0, 1:4] < 0).all()


def test_the_log_barrier_pushes_an_impossible_action_as_hard_as_an_unlikely_one() -> None:
    """d/dscores of -w mean_a log pi(a) = w (pi - 1/4), where the entropy's gradient vanishes with pi."""
    settings = replace(SETTINGS, entropy_weight=0.0, barrier_weight=0.2)
    scores = torch.tensor([[0.0, 0.0, 0.0, -50.0, 0.0]])
    _, gradient = loss_gradient(scores, made_batch([0], [-math.log(3)], [0.0], [0.0]), settings)
    expected = 0.2 * (torch.tensor([1 / 3, 1 / 3, 1 / 3, 0.0]) - 0.25)
    torch.testing.assert_close(gradient[0, :4], expected)
    _, of_entropy = loss_gradient(scores, made_batch([0], [-math.log(3)], [0.0], [0.0]), SETTINGS)
    assert of_entropy[0, 3].abs() < 1e-12


def test_the_policy_is_drawn_towards_what_is_better_however_unlikely() -> None:
    """d/dscores of -w sum_a better(a) log pi(a) = w (pi sum(better) - better); rows of zeros feel nothing."""
    settings = replace(SETTINGS, entropy_weight=0.0, lookahead_weight=0.2)
    output = torch.tensor([[0.0, 0.0, 0.0, -50.0, 0.0]]).repeat(2, 1)
    better = torch.tensor([[0.1, 0.2, 0.0, 0.7], [0.0] * 4])
    batch = replace(made_batch([0, 0], [-math.log(3)] * 2, [0.0, 0.0], [0.0, 0.0]), better=better)
    _, gradient = loss_gradient(output, batch, settings)
    pi = torch.tensor([1 / 3, 1 / 3, 1 / 3, 0.0])
    torch.testing.assert_close(gradient[0, :4], 0.2 / 2 * (pi - better[0]))
    assert not gradient[1, :4].any()
    assert torch.equal(batch.rows(torch.tensor([1]), (1,)).better, better[1:])


def test_merged_rows_are_drawn_only_where_the_first_batch_was() -> None:
    _, batch = random_case(4)
    first = replace(batch, better=torch.full((4, 4), 0.25), rows_per_scene=(3, 1))
    both = merged(first, replace(batch, rows_per_scene=(2, 2)))
    assert both.rows_per_scene == (5, 3)
    assert both.better.sum(1).tolist() == [1, 1, 1, 0, 0, 1, 0, 0]
    assert merged(batch, batch).better is None


def test_rows_keep_what_belongs_together() -> None:
    _, batch = random_case(5)
    part = batch.rows(torch.tensor([4, 1]), (2,))
    assert len(part) == 2
    assert part.rows_per_scene == (2,)
    assert part.advantage.tolist() == [batch.advantage[4].item(), batch.advantage[1].item()]
    assert part.action.tolist() == [batch.action[4].item(), batch.action[1].item()]
