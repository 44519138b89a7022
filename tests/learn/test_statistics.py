import torch
from torch import Tensor

from clearway.envs.navigation import Transition
from clearway.learn.metrics_log import episode_figures
from clearway.learn.statistics import WINDOW, EpisodeStatistics
from small_runs import equal_bits


def outcome(reached: list[int], truncated: list[int], blocked: list[int]) -> Transition:
    """What one step did, where only ends and blocked moves matter."""
    none = torch.zeros(len(reached), dtype=torch.int64)
    flags: list[Tensor] = [torch.tensor(flag).bool() for flag in (reached, truncated, blocked)]
    return Transition(none, none.float(), *flags, zone=none)


def made_statistics() -> EpisodeStatistics:
    return EpisodeStatistics(2, 3, torch.device("cpu"))


def test_episodes_are_counted_for_their_target_when_they_end() -> None:
    statistics, target = made_statistics(), torch.tensor([2, 0])
    statistics.add(target, outcome([0, 0], [0, 0], [1, 0]))
    statistics.add(target, outcome([1, 0], [0, 0], [1, 1]))  # environment 0 arrives: 2 steps, 2 collisions
    statistics.add(torch.tensor([1, 0]), outcome([0, 0], [0, 1], [0, 1]))  # environment 1 is cut: 3 and 2
    assert statistics.take().tolist() == [[1, 0, 3, 2], [0, 0, 0, 0], [1, 1, 2, 2]]
    assert statistics.take().any().item() is False  # taken
    assert statistics.open_steps.tolist() == [1, 0]
    assert statistics.open_collisions.tolist() == [0, 0]


def test_figures_are_means_over_ended_episodes() -> None:
    totals = torch.tensor([[3.0, 1.0, 30.0, 6.0], [1.0, 1.0, 10.0, 0.0]], dtype=torch.float64)
    assert episode_figures(totals) == {"episodes": 4, "success": 0.5, "steps": 10.0, "collisions": 1.5}
    assert episode_figures(torch.zeros(2, 4)) == {"episodes": 0, "success": 0, "steps": 0, "collisions": 0}


def test_success_is_taken_when_the_window_is_full_and_then_anew() -> None:
    statistics, target = made_statistics(), torch.tensor([0, 1])
    for _ in range(WINDOW - 1):
        statistics.add(target, outcome([1, 0], [0, 1], [0, 0]))
        statistics.refresh_success()
    assert statistics.solved == 0  # one episode short
    statistics.add(target, outcome([1, 1], [0, 0], [0, 0]))
    statistics.refresh_success()
    assert statistics.recent_success.tolist() == [1, 1 / WINDOW, 0]
    assert statistics.solved == 1
    for _ in range(WINDOW):
        statistics.add(target, outcome([0, 1], [1, 0], [0, 0]))
    statistics.refresh_success()
    assert statistics.recent_success.tolist() == [0, 1, 0]


def test_tensors_bring_it_back() -> None:
    statistics, copy = made_statistics(), made_statistics()
    statistics.add(torch.tensor([2, 0]), outcome([1, 0], [0, 0], [1, 1]))
    copy.load_tensors(statistics.tensors())
    assert equal_bits(copy.tensors(), statistics.tensors())
    copy.add(torch.tensor([2, 0]), outcome([1, 0], [0, 0], [1, 1]))  # a copy, not a view
    assert not equal_bits(copy.tensors(), statistics.tensors())
