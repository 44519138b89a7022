import math

import pytest
import torch
from torch import Tensor

from clearway.learn.presets import PAPER_A2C
from clearway.learn.rollout import Rollout, as_rows, by_step, sample_actions
from clearway.learn.trainer import Trainer
from clearway.reward import COLLISION_AWARE
from clearway.world.world import World
from helpers.small_runs import corridor_world, small_learner, small_trainer


def collected(trainer: Trainer) -> Rollout:
    trainer.lookup.refresh()
    return trainer.collector.collect()


def evenly_spaced(count: int) -> Tensor:
    """Numbers in [0, 1), one in every 1 / count."""
    return (torch.arange(count, dtype=torch.float64) + 0.5) / count


def test_actions_follow_the_softmax() -> None:
    scores = torch.tensor([0.3, -1.0, 2.0, 0.0])
    action = sample_actions(scores.expand(10_000, 4), evenly_spaced(10_000))
    share = torch.bincount(action, minlength=4) / 10_000
    torch.testing.assert_close(share, torch.softmax(scores, 0), rtol=0, atol=2e-4)


@pytest.mark.parametrize("likely", [0, 1, 2, 3])
@pytest.mark.parametrize("uniform", [1e-9, 0.5, 1 - 2.0**-53])
def test_actions_of_no_probability_are_never_drawn(likely: int, uniform: float) -> None:
    """Also near both ends of [0, 1), where rounding could push a draw past the last action that is possible."""
    scores = torch.full((1, 4), -200.0)
    scores[0, likely] = 0.0
    assert sample_actions(scores, torch.tensor([uniform], dtype=torch.float64)).item() == likely


def test_as_rows_keeps_each_environment_s_steps_together_and_by_step_undoes_it() -> None:
    values = torch.arange(3 * 4).view(3, 4)  # T = 3, N = 4
    assert as_rows(values).tolist() == [0, 4, 8, 1, 5, 9, 2, 6, 10, 3, 7, 11]
    deep = torch.randn(5, 6, 4)
    assert torch.equal(by_step(as_rows(deep), 5), deep)


def check_steps(rollout: Rollout, world: World, history_before: Tensor) -> None:
    """Every step follows from the world's tables and the step before."""
    reward = torch.from_numpy(COLLISION_AWARE.table(world.moves())).float()
    history = history_before
    for t in range(len(rollout.action)):
        assert torch.equal(rollout.history[t], history)
        here, action = history[:, -1], rollout.action[t]
        arrived = world.next_state[here, action]
        assert torch.equal(rollout.arrived[t], arrived)
        reached = arrived == world.target_state[rollout.target[t]]
        assert torch.equal(rollout.reached[t], reached)
        blocked = world.blocked[here, action]
        assert torch.equal(rollout.blocked[t], blocked)
        assert torch.equal(rollout.reward[t], reward[reached.long(), here, action])
        assert not (rollout.truncated[t] & reached).any()
        after = torch.cat([history[:, 1:], arrived[:, None]], 1)
        assert torch.equal(rollout.last_history[t], after)
        ended = reached | rollout.truncated[t]
        last = t + 1 == len(rollout.action)
        history = rollout.history_after if last else rollout.history[t + 1]
        target = rollout.target_after if last else rollout.target[t + 1]
        assert torch.equal(history[~ended], after[~ended])
        assert torch.equal(target[~ended], rollout.target[t][~ended])
        begun = history[ended]
        assert (begun == begun[:, :1]).all()  # the first pose fills the history
        assert (begun[:, 0] != world.target_state[target[ended]]).all()
        assert torch.equal(world.target_scene[target], world.target_scene[rollout.target[t]])


def test_histories_targets_and_actions_follow_the_world_step_by_step() -> None:
    trainer = small_trainer(small_learner(step_limit=6, rollout_steps=9))
    reached = 0
    for _ in range(3):
        before = trainer.navigation.history.clone()
        rollout = collected(trainer)
        check_steps(rollout, trainer.world, before)
        assert rollout.truncated.any()
        reached += int(rollout.reached.sum())
    assert reached > 0


def test_episodes_are_cut_at_the_step_limit() -> None:
    """Away from the targets nothing but the limit ends an episode."""
    trainer = small_trainer(small_learner(step_limit=6, rollout_steps=30))
    rollout = collected(trainer)
    length = torch.zeros(trainer.env_count, dtype=torch.int64)
    lengths = []
    for t in range(30):
        length += 1
        assert (length <= 6).all()
        lengths += length[rollout.truncated[t]].tolist()
        length[rollout.reached[t] | rollout.truncated[t]] = 0
    assert min(lengths) < 6  # the first clocks are staggered
    assert lengths.count(6) > len(lengths) / 2


def test_kept_activations_are_those_of_the_histories_stored() -> None:
    trainer = small_trainer(small_learner(PAPER_A2C))
    rollout = collected(trainer)
    history, target = as_rows(rollout.history), as_rows(rollout.target)
    fresh = trainer.lookup.forward(history, target, [8 * count for count in trainer.collector.rows_per_scene])
    for name in ("seen", "fused", "special", "output"):
        torch.testing.assert_close(getattr(rollout.kept, name), getattr(fresh, name), rtol=1e-5, atol=1e-6)
    states = trainer.feature_map(trainer.world.features)
    scores, value = trainer.network(
        states[history], states[trainer.world.target_state][target], trainer.world.target_scene[target]
    )
    torch.testing.assert_close(rollout.kept.scores, scores.detach(), rtol=1e-4, atol=1e-5)
    torch.testing.assert_close(rollout.kept.value, value.detach(), rtol=1e-4, atol=1e-5)


def test_actions_are_drawn_from_the_policy() -> None:
    """Over many steps the taken actions' mean log probability is minus the policy's mean entropy."""
    trainer = small_trainer(small_learner(envs=200, rollout_steps=30))
    with torch.no_grad():
        trainer.network.output_weight.mul_(20)  # far from uniform
    rollout = collected(trainer)
    log_pi = torch.log_softmax(rollout.kept.scores, 1)
    entropy = -(log_pi.exp() * log_pi).sum(1)
    taken = log_pi.gather(1, as_rows(rollout.action)[:, None])
    assert entropy.mean() < 0.9 * math.log(4)
    assert -taken.mean().item() == pytest.approx(entropy.mean().item(), abs=0.04)


def test_a_seed_repeats_bit_for_bit_and_another_differs() -> None:
    rollouts = [collected(small_trainer(small_learner(), seed=seed)) for seed in (5, 5, 6)]
    first, again, other = rollouts
    assert all(torch.equal(getattr(first, n), getattr(again, n)) for n in ("history", "action", "reward"))
    assert torch.equal(first.kept.output, again.kept.output)
    assert not torch.equal(first.action, other.action)


def test_an_environment_walks_the_same_way_in_any_batch() -> None:
    few, many = (
        collected(Trainer(corridor_world(), small_learner(envs=envs), COLLISION_AWARE, seed=1)) for envs in (4, 12)
    )
    for name in ("history", "target", "action", "reward", "truncated"):
        assert torch.equal(getattr(few, name), getattr(many, name)[:, :4])


def test_environments_begin_with_every_target_in_turn() -> None:
    trainer = small_trainer(small_learner(envs=13))  # 20 and 40 states
    assert trainer.env_count == 13
    assert trainer.navigation.target.tolist() == [0, 1, 2, 0] + [3, 4] * 4 + [3]
    assert trainer.frames_per_update == 13 * 8
