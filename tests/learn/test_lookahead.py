import pytest
import torch
from torch import Tensor

from clearway.learn.lookahead import UNKNOWN, Observed, better_policy
from clearway.learn.trainer import Trainer
from clearway.reward import COLLISION_AWARE
from helpers.small_runs import small_learner, small_trainer

SHARP = 0.05  # a temperature


@pytest.fixture
def trainer() -> Trainer:
    """A trainer on the corridor and the grid that knows half of all transitions."""
    reward = COLLISION_AWARE.with_changes(blocked=-0.5)
    trainer = small_trainer(small_learner(matmul_precision="highest"), reward=reward)
    state, action = torch.meshgrid(torch.arange(trainer.world.state_count), torch.arange(4), indexing="ij")
    taken = torch.rand(state.shape, generator=torch.Generator().manual_seed(1)) < 0.5
    trainer.observed.add(state[taken], action[taken], trainer.world.next_state[taken])
    return trainer


def made_rows(trainer: Trainer, each: int = 40) -> tuple[Tensor, Tensor, list[int]]:
    """Histories and targets, as many of each scene, and rows a scene; every target is stood beside."""
    rng = torch.Generator().manual_seed(2)
    world = trainer.world
    history, target = [], []
    for scene in range(world.scene_count):
        first, last = world.scene_offset[scene : scene + 2].tolist()
        own = torch.nonzero(world.target_scene == scene)[:, 0]
        history.append(torch.randint(first, last, (each, 4), generator=rng))
        target.append(own[torch.randint(len(own), (each,), generator=rng)])
    return torch.cat(history), torch.cat(target), [each] * world.scene_count


def better(
    trainer: Trainer, history: Tensor, target: Tensor, log_pi: Tensor, value: Tensor, temperature: float = SHARP
) -> Tensor:
    return better_policy(
        history,
        target,
        log_pi,
        value,
        trainer.observed,
        trainer.navigation,
        trainer.lookup,
        discount=0.9,
        reward_scale=0.1,
        temperature=temperature,
    )


@pytest.mark.parametrize("temperature", [SHARP, 1.0])  # the sharp one alone hides what is added to the target's reward
def test_against_one_row_and_action_at_a_time(trainer: Trainer, temperature: float) -> None:
    history, target, rows = made_rows(trainer)
    kept = trainer.lookup.forward(history, target, rows)
    log_pi = torch.log_softmax(kept.scores, 1)
    found = better(trainer, history, target, log_pi, kept.value, temperature)
    world, table = trainer.world, trainer.navigation.reward_table
    features = trainer.lookup.first_layer.features
    known_at_goal = 0
    for row in range(len(history)):
        here, goal = int(history[row, -1]), int(target[row])
        logits = []
        for action in range(4):
            after = int(trainer.observed.next_state[here, action])
            gain = 0.0
            if after != UNKNOWN:
                assert after == int(world.next_state[here, action])
                reached = after == int(world.target_state[goal])
                known_at_goal += reached
                gain = 0.1 * float(table[int(reached), here, action])
                if not reached:
                    seen, wanted = features[[after] * 4][None], features[world.target_state[goal]][None]
                    with torch.no_grad():
                        _, value = trainer.network(seen, wanted, world.target_scene[goal : goal + 1])
                    gain += 0.9 * float(value)
                gain -= float(kept.value[row])
            logits.append(float(log_pi[row, action]) + gain / temperature)
        torch.testing.assert_close(found[row], torch.softmax(torch.tensor(logits), 0), rtol=1e-4, atol=1e-5)
    assert known_at_goal


def test_who_knows_nothing_stays_with_the_policy(trainer: Trainer) -> None:
    history, target, rows = made_rows(trainer)
    kept = trainer.lookup.forward(history, target, rows)
    trainer.observed = Observed(trainer.world)
    found = better(trainer, history, target, torch.log_softmax(kept.scores, 1), kept.value)
    torch.testing.assert_close(found, torch.softmax(kept.scores, 1))


def test_a_certain_policy_learns_of_an_action_that_it_never_takes(trainer: Trainer) -> None:
    """Beside the target, with a policy that takes the step towards it once in 20,000 times."""
    world = trainer.world
    trainer.observed.next_state = world.next_state.clone()
    target = 1
    beside, action = torch.nonzero(world.next_state[:12] == world.target_state[target])[0].tolist()
    log_pi = torch.log_softmax(torch.full((1, 4), 10.0).index_fill(1, torch.tensor([action]), 0.0), 1)
    value = trainer.lookup.forward(torch.full((1, 4), beside), torch.tensor([target]), [1, 0]).value
    found = better(trainer, torch.full((1, 4), beside), torch.tensor([target]), log_pi, value)
    assert log_pi.exp()[0, action] < 1e-4
    assert found[0, action] > 0.9


def test_the_trainer_remembers_only_what_its_environments_did() -> None:
    trainer = small_trainer(small_learner(lookahead=0.02))
    assert (trainer.observed.next_state == UNKNOWN).all()
    taken = torch.zeros_like(trainer.observed.next_state, dtype=torch.bool)
    collect = trainer.collector.collect

    def watched(steps):
        rollout = collect(steps)
        taken[rollout.history[:, :, -1], rollout.action] = True
        return rollout

    trainer.collector.collect = watched
    for _ in range(3):
        trainer.update()
    known = trainer.observed.next_state != UNKNOWN
    assert torch.equal(known, taken)
    assert not known.all()
    assert torch.equal(trainer.observed.next_state[known], trainer.world.next_state[known])


def test_without_it_nothing_is_remembered() -> None:
    trainer = small_trainer(small_learner(lookahead=0.0))
    trainer.update()
    assert (trainer.observed.next_state == UNKNOWN).all()
