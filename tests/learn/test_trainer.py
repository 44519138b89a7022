"""The trainer against the same update written plainly: the naive network, autograd, returns step by step."""

import copy
import math
from dataclasses import replace
from itertools import pairwise

import pytest
import torch
from torch import Tensor, nn

from clearway.choices import EpisodeTargets
from clearway.errors import RunError
from clearway.learn import trainer as trainer_module
from clearway.learn.a2c import A2C
from clearway.learn.losses import Batch, merged
from clearway.learn.on_policy import OnPolicy
from clearway.learn.presets import DEFAULT, PAPER_A2C
from clearway.learn.rollout import Rollout
from clearway.learn.trainer import Trainer, balanced_weights
from clearway.model import lookup
from clearway.model.first_layer import AllStates, VisitedStates
from clearway.model.network import SiameseActorCritic
from clearway.reward import COLLISION_AWARE, SHORTEST
from helpers.small_runs import corridor_world, equal_bits, small_learner, small_request, small_trainer, small_world

PLAIN_A2C = small_learner(A2C(), hindsight=False, lookahead=0.0, step_limit=5, matmul_precision="highest")


def predicted(trainer: Trainer, network: SiameseActorCritic, history: Tensor, target: Tensor) -> tuple[Tensor, Tensor]:
    """Scores (..., A) and values (...) of the naive network for states (..., K) and targets (...)."""
    world, states = trainer.world, trainer.feature_map(trainer.world.features)
    rows, wanted = history.reshape(-1, history.shape[-1]), target.reshape(-1)
    scene = world.target_scene[wanted]
    scores, value = network(states[rows], states[world.target_state][wanted], scene)
    return scores.view(*target.shape, -1), value.view(target.shape)


def advantages_step_by_step(trainer: Trainer, rollout: Rollout, value: Tensor, after: Tensor) -> Tensor:
    """(T, N) GAE, one environment at a time, from reward, ends and values."""
    learner = trainer.learner
    advantage = torch.zeros_like(value)
    _, at_cut = predicted(trainer, copy.deepcopy(trainer.network), rollout.last_history, rollout.target)
    for env in range(trainer.env_count):
        running, following = 0.0, after[env]
        for t in reversed(range(learner.rollout_steps)):
            reward = rollout.reward[t, env] * learner.reward_scale
            if rollout.reached[t, env]:
                running, following = 0.0, 0.0
            elif rollout.truncated[t, env]:
                running, following = 0.0, at_cut[t, env] if learner.bootstrap_cut else 0.0
            delta = reward + learner.discount * following - value[t, env]
            running = delta + learner.discount * learner.gae_lambda * running
            advantage[t, env], following = running, value[t, env]
    return advantage.detach()


def naive_update(trainer: Trainer, lr: float) -> SiameseActorCritic:
    """The network after one PLAIN_A2C update from where the trainer stands, computed afresh; uses up the rollout."""
    learner, network = trainer.learner, copy.deepcopy(trainer.network)
    rollout = trainer.collector.collect()
    scores, value = predicted(trainer, network, rollout.history, rollout.target)
    _, after = predicted(trainer, network, rollout.history_after, rollout.target_after)
    advantage = advantages_step_by_step(trainer, rollout, value.detach(), after.detach())
    log_pi = torch.log_softmax(scores, -1)
    taken = log_pi.gather(-1, rollout.action[..., None])[..., 0]
    entropy = -(log_pi.exp() * log_pi).sum(-1)
    error = advantage + value.detach() - value
    loss = -taken * advantage - learner.entropy_start * entropy + learner.value_weight / 2 * error**2
    loss = loss - learner.log_barrier * log_pi.mean(-1)
    network.zero_grad()
    (loss.sum() if learner.sum_loss else loss.mean()).backward()
    if learner.optimiser == "adam":
        nn.utils.clip_grad_norm_(network.parameters(), learner.clip_norm)
        first, *others = network.parameters()
        torch.optim.Adam([{"params": [first], "lr": lr * learner.siamese_lr}, {"params": others}], lr).step()
    else:
        published_step(network, learner.clip_norm, lr)
    return network


@torch.no_grad()
def published_step(network: SiameseActorCritic, clip_norm: float, lr: float) -> None:
    """The first step of the published RMSProp after clipping layer by layer and head by head."""
    for parameter in network.parameters():
        parts = [parameter.grad]
        if len(parameter) == network.shape.head_count and parameter is not network.fusion_weight:
            parts = [part for head in parameter.grad for part in ((head[:4], head[4:]) if len(head) == 5 else (head,))]
        for part in parts:
            part *= min(1.0, clip_norm / part.norm().item())
        parameter -= lr * parameter.grad / (0.99 + 0.01 * parameter.grad**2 + 0.1).sqrt()


@pytest.mark.parametrize(
    "learner",
    [
        pytest.param(PLAIN_A2C, id="default as a2c"),
        pytest.param(replace(PLAIN_A2C, clip_norm=0.01), id="clipped"),
        pytest.param(replace(PLAIN_A2C, sum_loss=True, clip_norm=1e9, gae_lambda=1.0), id="summed"),
        pytest.param(replace(PLAIN_A2C, bootstrap_cut=False), id="cut is an end"),
        pytest.param(small_learner(PAPER_A2C, step_limit=5), id="paper"),
        pytest.param(small_learner(PAPER_A2C, step_limit=5, clip_norm=0.02), id="paper, clipped"),
    ],
)
def test_an_a2c_update_equals_the_naive_one(learner: OnPolicy) -> None:
    trainer, other = small_trainer(learner, seed=2), small_trainer(learner, seed=2)
    before = copy.deepcopy(trainer.network)
    expected = naive_update(other, learner.lr_start)
    trainer.update()
    for (name, after), start, naive in zip(
        trainer.network.named_parameters(), before.parameters(), expected.parameters(), strict=True
    ):
        largest = naive.grad.abs().max().item()
        assert largest > 0
        torch.testing.assert_close(
            after.grad, naive.grad, rtol=0, atol=2e-5 * largest, msg=lambda m, n=name: f"{n}: {m}"
        )
        moved, should = after - start, naive - start
        # Adam's first step is nearly lr * sign(g): where g is within rounding of 0 the two may differ
        off = (moved - should).abs() > 1e-3 * should.abs().max()
        assert off.float().mean() < (0.005 if learner.optimiser == "adam" else 1e-9), name


def test_rewards_are_clipped_and_scaled_as_set() -> None:
    paper, default = small_trainer(small_learner(PAPER_A2C)), small_trainer(small_learner())
    assert paper.navigation.reward_table.max() == 1
    assert default.navigation.reward_table.max() == 10
    assert paper.learner.reward_scale == 1
    assert default.learner.reward_scale == 0.1


def test_schedules_run_from_start_to_end() -> None:
    learner = small_learner(lr_start=1e-2, lr_end=1e-3, entropy_start=0.1, entropy_end=0.001)
    trainer = small_trainer(learner)
    updates = [trainer.update() for _ in range(10)]
    assert trainer.finished
    assert [u["lr"] for u in updates] == pytest.approx([1e-2 - 9e-4 * k for k in range(10)])
    assert learner.barrier_weight_at(0) == learner.log_barrier
    ahead = replace(learner, lookahead=0.02, log_barrier=0.4, settle=0.2)
    moments = [0, 320, 639, 640, 800, 1600]  # of 800 frames
    assert [ahead.lookahead_weight_at(n) for n in moments] == pytest.approx([0.02, 0.01, 0.02 / 640, 0, 0, 0])
    assert [ahead.barrier_weight_at(n) for n in moments] == pytest.approx([0.4, 0.2, 0.4 / 640, 0, 0, 0])
    assert [u["entropy_weight"] for u in updates] == pytest.approx([0.1 * 0.01 ** (k / 10) for k in range(10)])
    assert trainer.frames == 800
    assert trainer.updates == 10


def test_merged_keeps_the_order_of_scenes() -> None:
    def batch(first: int, rows_per_scene: tuple[int, ...]) -> Batch:
        rows = torch.arange(first, first + sum(rows_per_scene))
        return Batch(rows[:, None], rows, rows, rows, rows, rows, rows_per_scene)

    joined = merged(batch(0, (2, 0, 3)), batch(100, (1, 2, 0)))
    assert joined.action.tolist() == [0, 1, 100, 101, 102, 2, 3, 4]
    assert joined.history[:, 0].tolist() == joined.target.tolist() == joined.action.tolist()
    assert joined.rows_per_scene == (3, 2, 3)


def test_the_first_layer_moves_once_a_pass_or_with_every_minibatch(monkeypatch: pytest.MonkeyPatch) -> None:
    def moves(**settings: object) -> list[bool]:
        trainer = small_trainer(small_learner(epochs=2, minibatches=3, **settings))
        weights, clip = [trainer.network.siamese_weight.clone()], trainer_module.clip_gradients

        def noted(*arguments: object) -> Tensor:
            weights.append(trainer.network.siamese_weight.clone())
            return clip(*arguments)

        with monkeypatch.context() as patch:
            patch.setattr(trainer_module, "clip_gradients", noted)  # comes before every step of the optimisers
            trainer.update()
        weights.append(trainer.network.siamese_weight)
        return [not torch.equal(before, after) for before, after in pairwise(weights[1:])]

    assert moves(siamese_step="pass") == [False, False, True, False, False, True]
    assert moves(siamese_step="minibatch") == [True] * 6


def test_what_repeats_is_counted_once() -> None:
    update = small_trainer(small_learner(epochs=2, minibatches=2)).update()
    assert 0 < update["distinct_histories"] < update["distinct_pairs"] < 1
    whole = small_trainer(small_learner(PAPER_A2C)).update()
    assert whole["distinct_histories"] == whole["distinct_pairs"] == 1


def test_hindsight_adds_rows_only_when_asked() -> None:
    assert small_trainer(small_learner(step_limit=200, hindsight=True)).update()["hindsight_rows"] > 0
    assert small_trainer(small_learner(step_limit=200, hindsight=False)).update()["hindsight_rows"] == 0


def test_hindsight_and_look_ahead_get_the_learner_s_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    learner = small_learner(
        step_limit=200, discount=0.9, reward_scale=0.3, gae_lambda=0.8, lookahead=0.1, lookahead_temperature=0.07
    )
    given: dict[str, dict] = {}

    def noted(name: str) -> None:
        whole = getattr(trainer_module, name)

        def call(*arguments, **settings):
            given[name] = settings
            return whole(*arguments, **settings)

        monkeypatch.setattr(trainer_module, name, call)

    noted("hindsight_batch")
    noted("better_policy")
    small_trainer(learner).update()
    assert given == {
        "hindsight_batch": {"discount": 0.9, "reward_scale": 0.3, "trace_lambda": 0.8, "told": None},
        "better_policy": {"discount": 0.9, "reward_scale": 0.3, "temperature": 0.07},
    }


def test_look_ahead_is_computed_as_long_as_it_weighs(monkeypatch: pytest.MonkeyPatch) -> None:
    trainer = small_trainer(small_learner(lookahead=0.1, settle=0.5))
    looked, better = [], trainer_module.better_policy

    def noted(*arguments: object, **settings: object) -> Tensor:
        looked.append(trainer.updates)
        return better(*arguments, **settings)

    monkeypatch.setattr(trainer_module, "better_policy", noted)
    while not trainer.finished:
        trainer.update()
    assert looked == [0, 1, 2, 3, 4]


@pytest.mark.parametrize("rule", ["drawn", "kept"])
def test_environments_draw_a_target_for_every_episode_or_keep_their_own(rule: EpisodeTargets) -> None:
    trainer = small_trainer(small_learner(step_limit=4, episode_targets=rule))
    begun = trainer.navigation.target.clone()
    seen = [begun]
    for _ in range(5):
        trainer.update()
        seen.append(trainer.navigation.target.clone())
    assert sorted(begun.unique().tolist()) == [0, 1, 2, 3, 4]
    assert all(torch.equal(target, begun) for target in seen) == (rule == "kept")


@pytest.mark.parametrize(
    ("other", "said"),
    [
        ({"balance": 3.0}, "balance is 3.0"),
        ({"goals": "seen"}, "goals is seen"),
        ({"scenes_at_once": 1}, "scenes_at_once is 1"),
    ],
)
def test_kept_targets_are_refused_where_another_setting_would_have_them_drawn(other: dict, said: str) -> None:
    with pytest.raises(RunError, match=f"episode_targets is kept and {said}, which needs targets drawn"):
        small_learner(episode_targets="kept", **other)


def test_fewer_environments_than_kept_targets_are_refused() -> None:
    few = small_learner(envs=4, envs_by="scenes", episode_targets="kept")  # two for the corridor's three targets
    with pytest.raises(RunError, match=r"scene 'corridor': 2 environments for 3 targets that they keep"):
        small_trainer(few)


def test_the_learning_rate_may_rise_before_it_falls() -> None:
    learner = small_learner(lr_start=1e-2, lr_end=0.0, lr_warm_up=200)  # of 800 frames
    assert [learner.lr_at(n) for n in (0, 100, 200, 400, 800)] == pytest.approx([0, 0.00875 / 2, 0.0075, 0.005, 0])


def test_an_update_ends_with_weighing_the_targets_anew() -> None:
    trainer = small_trainer(small_learner(balance=3.0))
    before = trainer.navigation.choice.weights.clone()
    trainer.statistics.window[:, :2] = torch.tensor([[9, 9], [9, 0], [9, 3], [9, 9], [9, 9]])
    trainer.update()
    assert not torch.equal(trainer.navigation.choice.weights, before)


def test_targets_reached_less_often_are_drawn_more_often() -> None:
    choice = small_trainer(small_learner()).navigation.choice
    success = torch.tensor([1.0, 0.5, 0.0, 1.0, 1.0], dtype=torch.float64)
    weights = balanced_weights(choice, success, balance=3.0)
    assert weights.tolist() == [[1.0, 2.5, 4.0], [1.0, 1.0, 0.0]]  # 0 is padding


def test_without_balance_all_targets_are_drawn_alike() -> None:
    trainer = small_trainer(small_learner(balance=0.0))
    trainer.update()
    assert trainer.navigation.choice.weights.tolist() == [[1.0, 1.0, 1.0], [1.0, 1.0, 0.0]]


@pytest.mark.parametrize("preset", [DEFAULT, replace(DEFAULT, balance=3.0), A2C(), PAPER_A2C])
def test_a_seed_repeats_and_tensors_bring_a_trainer_back_bit_for_bit(preset: OnPolicy) -> None:
    learner = small_learner(preset)
    trainer, again, resumed = (small_trainer(learner, SHORTEST, seed=9) for _ in range(3))
    for each in (trainer, again):
        for _ in range(4):
            each.update()
    assert equal_bits(trainer.tensors(), again.tensors())
    saved = {name: tensor.clone() for name, tensor in trainer.tensors().items()}
    resumed.load_tensors(saved, trainer.frames, trainer.updates)
    for _ in range(4):
        assert trainer.update() == resumed.update()
    assert equal_bits(trainer.tensors(), resumed.tensors())
    assert not equal_bits(trainer.tensors(), saved)


def test_another_seed_gives_another_network() -> None:
    first, second = (small_trainer(small_learner(), seed=seed) for seed in (0, 1))
    assert not torch.equal(first.network.siamese_weight, second.network.siamese_weight)
    assert not torch.equal(first.navigation.history, second.navigation.history)


@pytest.mark.parametrize("value", [torch.nan, torch.inf])
def test_features_that_are_not_finite_are_refused(value: float) -> None:
    world = small_world()
    world.features[7, 3] = value
    with pytest.raises(RunError, match="NaN or Inf"):
        Trainer(world, small_learner(), COLLISION_AWARE, 0)


def test_a_world_without_features_is_refused() -> None:
    with pytest.raises(RunError, match="no features"):
        Trainer(replace(small_world(), features=None), small_learner(), COLLISION_AWARE, 0)


@pytest.mark.parametrize("seed", [-1, 2**31])
def test_seeds_out_of_range_are_refused(seed: int) -> None:
    with pytest.raises(RunError, match="seed is"):
        small_request(seed=seed)
    small_request(seed=2**31 - 1).trainer().update()


@pytest.mark.parametrize(("envs_by", "counts"), [("states", [20, 40]), ("scenes", [30, 30])])
def test_environments_are_divided_by_states_or_evenly(envs_by: str, counts: list[int]) -> None:
    trainer = small_trainer(small_learner(envs=60, envs_by=envs_by))
    assert torch.diff(trainer.world.scene_offset).tolist() == [20, 40]
    scene = trainer.world.target_scene[trainer.navigation.target]
    assert torch.bincount(scene).tolist() == counts == list(trainer.collector.rows_per_scene)


def test_fewer_environments_than_scenes_are_refused() -> None:
    with pytest.raises(RunError, match="1 environments for 2 scenes"):
        small_trainer(small_learner(envs=1, minibatches=1))


def test_a_loss_that_is_not_finite_stops_training() -> None:
    trainer = small_trainer(small_learner())
    with torch.no_grad():
        trainer.network.output_bias[0, 4] = torch.nan
    with pytest.raises(RunError, match="nan after 80 frames"):
        trainer.update()


def test_more_minibatches_than_rows_of_a_scene_are_refused() -> None:
    with pytest.raises(RunError, match="minibatches"):
        small_trainer(small_learner(envs=2, rollout_steps=3, minibatches=4))


def test_one_row_an_update_gives_finite_figures() -> None:
    learner = small_learner(envs=1, rollout_steps=1, minibatches=1, epochs=1)
    figures = Trainer(corridor_world(), learner, COLLISION_AWARE, 0).update()
    assert all(math.isfinite(value) for value in figures.values())


@pytest.mark.parametrize("heads", ["scene", "shared"])
def test_projecting_visited_states_alone_changes_nothing_but_rounding(
    monkeypatch: pytest.MonkeyPatch, heads: str
) -> None:
    learner = small_learner(heads=heads, matmul_precision="highest")
    everywhere = small_trainer(learner)
    monkeypatch.setattr(lookup, "FEW_STATES", 0)
    visited = small_trainer(learner)
    assert isinstance(everywhere.lookup.first_layer, AllStates)
    assert isinstance(visited.lookup.first_layer, VisitedStates)
    for _ in range(3):
        first, second = everywhere.update(), visited.update()
        assert second["loss"] == pytest.approx(first["loss"], rel=1e-3)
        assert second["gradient_norm"] == pytest.approx(first["gradient_norm"], rel=1e-3)
    for name, parameter in visited.network.named_parameters():
        torch.testing.assert_close(parameter, everywhere.network.get_parameter(name), rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize(("steps", "layer"), [(2, VisitedStates), (3, AllStates)])
def test_batches_too_small_for_all_states_project_those_that_occur(steps: int, layer: type) -> None:
    trainer = small_trainer(small_learner(envs=12, history_length=2, rollout_steps=steps))
    assert 12 * (2 + 2) < trainer.world.state_count <= 12 * (2 + 3)
    assert isinstance(trainer.lookup.first_layer, layer)


def test_one_head_learns_for_all_scenes() -> None:
    trainer = small_trainer(small_learner(heads="shared"))
    before = trainer.network.scene_weight.clone()
    trainer.update()
    assert trainer.network.scene_weight.shape == (1, 16, 16)
    assert not torch.equal(trainer.network.scene_weight, before)


def test_bfloat16_factors_learn_nearly_the_same_and_leave_nothing_of_it_behind(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On any processor: one without instructions for it takes longer."""
    learner = small_learner(epochs=2, minibatches=2, step_limit=200)
    exact = small_trainer(replace(learner, matmul_precision="highest"))
    monkeypatch.setattr(trainer_module, "factor_dtype", lambda precision, device: torch.bfloat16)
    rounded = small_trainer(learner)
    assert rounded.lookup.dtype == torch.bfloat16
    for _ in range(2):
        expected, found = exact.update(), rounded.update()
        assert found["hindsight_rows"] > 0
        assert found["loss"] == pytest.approx(expected["loss"], abs=0.02)
        assert found["gradient_norm"] == pytest.approx(expected["gradient_norm"], rel=0.1)
    for name, parameter in rounded.network.named_parameters():
        moved = parameter - exact.network.get_parameter(name)
        assert 0 < moved.abs().max() < 0.01, name
    assert torch.bfloat16 not in {tensor.dtype for tensor in rounded.tensors().values()}
