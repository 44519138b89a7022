import torch

from clearway.learn.metrics_log import episode_figures
from clearway.learn.rollout import Rollout
from clearway.learn.statistics import WINDOW, EpisodeStatistics
from clearway.model.lookup import Activations
from helpers.small_runs import equal_bits

Steps = list[list[int]]


def rollout(target: Steps, reached: Steps, truncated: Steps, blocked: Steps) -> Rollout:
    """Steps (T, N), where only targets, ends and blocked moves matter."""
    none = torch.zeros(len(target), len(target[0]), dtype=torch.int64)
    history = none[..., None]
    return Rollout(
        history=history,
        target=torch.tensor(target),
        action=none,
        arrived=none,
        reward=none.float(),
        reached=torch.tensor(reached).bool(),
        truncated=torch.tensor(truncated).bool(),
        blocked=torch.tensor(blocked).bool(),
        last_history=history,
        kept=Activations.empty(0, 1, none.device),
        history_after=history[-1],
        target_after=none[-1],
    )


def one_step(target: list[int], reached: list[int], truncated: list[int]) -> Rollout:
    """One step without collisions."""
    return rollout([target], [reached], [truncated], [[0, 0]])


def made_statistics() -> EpisodeStatistics:
    return EpisodeStatistics(2, 3, torch.device("cpu"))


def test_episodes_are_counted_for_their_target_when_they_end() -> None:
    statistics = made_statistics()
    first = rollout([[2, 0], [2, 0]], [[0, 0], [1, 0]], [[0, 0], [0, 0]], [[1, 0], [1, 1]])  # 0 arrives: 2 steps, 2
    statistics.add(first)
    statistics.add(rollout([[1, 0]], [[0, 0]], [[0, 1]], [[0, 1]]))  # 1 is cut: 3 steps, 2 collisions
    assert statistics.take().tolist() == [[1, 0, 3, 2], [0, 0, 0, 0], [1, 1, 2, 2]]
    assert statistics.take().any().item() is False  # taken
    assert statistics.open_steps.tolist() == [1, 0]
    assert statistics.open_collisions.tolist() == [0, 0]


def test_several_episodes_may_end_within_a_rollout() -> None:
    statistics = made_statistics()
    target = [[0, 1], [0, 1], [2, 1], [2, 1], [0, 1], [0, 1]]
    reached = [[0, 0], [1, 0], [0, 0], [0, 0], [0, 0], [0, 0]]
    truncated = [[0, 0], [0, 0], [0, 0], [1, 0], [0, 0], [0, 0]]
    blocked = [[1, 1], [1, 1], [0, 1], [1, 0], [1, 0], [0, 1]]
    statistics.add(rollout(target, reached, truncated, blocked))
    assert statistics.totals.tolist() == [[1, 1, 2, 2], [0, 0, 0, 0], [1, 0, 2, 1]]
    assert statistics.open_steps.tolist() == [2, 6]
    assert statistics.open_collisions.tolist() == [1, 4]
    statistics.add(rollout([[0, 1]], [[1, 1]], [[0, 0]], [[0, 1]]))
    assert statistics.totals.tolist() == [[2, 2, 5, 3], [1, 1, 7, 5], [1, 0, 2, 1]]


def test_figures_are_means_over_ended_episodes() -> None:
    totals = torch.tensor([[3.0, 1.0, 30.0, 6.0], [1.0, 1.0, 10.0, 0.0]], dtype=torch.float64)
    assert episode_figures(totals) == {"episodes": 4, "success": 0.5, "steps": 10.0, "collisions": 1.5}
    assert episode_figures(torch.zeros(2, 4)) == {"episodes": 0, "success": 0, "steps": 0, "collisions": 0}


def test_success_is_taken_when_the_window_is_full_and_then_anew() -> None:
    statistics, target = made_statistics(), [0, 1]
    for _ in range(WINDOW - 1):
        statistics.add(one_step(target, [1, 0], [0, 1]))
    assert statistics.solved == 0  # one episode short
    statistics.add(one_step(target, [1, 1], [0, 0]))
    assert statistics.recent_success.tolist() == [1, 1 / WINDOW, 0]
    assert statistics.solved == 1
    for _ in range(WINDOW):
        statistics.add(one_step(target, [0, 1], [1, 0]))
    assert statistics.recent_success.tolist() == [0, 1, 0]


def test_tensors_bring_it_back() -> None:
    statistics, copy = made_statistics(), made_statistics()
    statistics.add(one_step([2, 0], [1, 0], [0, 0]))
    copy.load_tensors(statistics.tensors())
    assert equal_bits(copy.tensors(), statistics.tensors())
    copy.add(one_step([2, 0], [1, 0], [0, 0]))  # a copy, not a view
    assert not equal_bits(copy.tensors(), statistics.tensors())
