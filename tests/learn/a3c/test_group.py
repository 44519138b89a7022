"""Workers' rounds against A3C written plainly."""

from dataclasses import replace

import pytest
import torch

from clearway.choices import EpisodeTargets
from clearway.learn.a3c import rmsprop
from clearway.learn.a3c.config import A3C
from clearway.learn.a3c.gradients import clip_scales, squared_norms
from clearway.learn.a3c.group import WorkerGroup
from clearway.learn.a3c.own_copy import Factors
from clearway.learn.optimiser import EPSILON
from clearway.learn.presets import PAPER_A3C
from clearway.reward import COLLISION_AWARE
from clearway.scenes.actions import ACTION_COUNT
from helpers.plain_a3c import PlainA3C
from helpers.small_runs import small_learner, small_network, small_world

SMALL = small_learner(PAPER_A3C, frames=1000, envs=5, rollout_steps=5, lr_start=0.05)


def group_of(workers: list[int], learner: A3C, seed: int = 4) -> WorkerGroup:
    world = small_world()
    parameters = {name: p.data.clone() for name, p in small_network(world).named_parameters()}
    squares = {name: torch.full_like(p, 1 + EPSILON) for name, p in parameters.items()}
    return WorkerGroup(world, learner, learner.paid(COLLISION_AWARE), seed, torch.tensor(workers), parameters, squares)


def check_against_plain(workers: list[int], learner: A3C, rounds: int) -> list[int]:
    """Both must agree after every round; returns the frames of each round."""
    world, group = small_world(), group_of(workers, learner)
    plain = PlainA3C(world, learner, learner.paid(COLLISION_AWARE), 4, workers)
    plain.begin(small_network(world))
    frames, used = 0, []
    for _ in range(rounds):
        used.append(plain.round(frames))
        assert group.round(frames).frames == used[-1]
        frames += used[-1]
        plain.assert_learnt(group.parameters, group.squares)
    return used


@pytest.mark.parametrize("worker", [0, 4])
def test_sequential_updates_of_one_worker_equal_the_plain_ones(worker: int) -> None:
    used = check_against_plain([worker], replace(SMALL, step_limit=7), rounds=12)
    assert min(used) < 5, "no segment ended with its episode"


@pytest.mark.parametrize(
    "learner",
    [
        pytest.param(SMALL, id="paper"),
        pytest.param(replace(SMALL, step_limit=3), id="cut is an end"),
        pytest.param(replace(SMALL, step_limit=3, bootstrap_cut=True), id="cut is bootstrapped"),
        pytest.param(replace(SMALL, clip_norm=0.05), id="clipped"),
        pytest.param(replace(SMALL, clip_norm=0.05, clip_each_tensor=False), id="clipped together"),
        pytest.param(replace(SMALL, sum_loss=False), id="mean loss"),
        pytest.param(replace(SMALL, rollout_steps=2), id="segments shorter than the history"),
        pytest.param(replace(SMALL, rollout_steps=1), id="segments of one step"),
        pytest.param(replace(SMALL, value_weight=1.0, entropy_start=0.1, entropy_end=0.1, discount=0.9), id="weights"),
        pytest.param(replace(SMALL, entropy_start=0.5, entropy_end=0.005), id="entropy falls"),
        pytest.param(replace(SMALL, lr_warm_up=90), id="warm-up"),
        pytest.param(replace(SMALL, step_limit=4, episode_targets="drawn"), id="targets drawn"),
    ],
)
def test_rounds_of_several_workers_equal_the_plain_ones(learner: A3C) -> None:
    assert check_against_plain(
        [0, 5, 1, 2, 3, 4], learner, rounds=6
    )  # targets 0 0 1 2 in the corridor, 3 4 in the grid


def test_biases_whose_rows_cancel_have_no_gradient_and_are_not_clipped() -> None:
    """By inner products of the rows their squared norm came out at -1e-16, and its root is no number."""
    rows = [float.fromhex(text) for text in ("0x1.36fd68p+0", "-0x1.a938b0p-10", "-0x1.36931ap+0")]
    left = torch.tensor(rows)[None, :, None]
    other = torch.zeros(1, 3, 1)
    factors = Factors(
        siamese=torch.zeros(1, 4, 1),
        fusion=left,
        seen=other,
        term=torch.zeros(1, 1, 1),
        wanted=torch.zeros(1, 1, 1),
        fused=other,
        scene=left,
        special=other,
        output=torch.zeros(1, 3, ACTION_COUNT + 1),
    )
    squares = squared_norms(factors, torch.zeros(1, 8, 2), history_length=4)
    assert all(square >= 0 for square in squares.values())
    assert all(scale == 1 for scale in clip_scales(squares, 40.0, each_tensor=True).values())


def test_weights_larger_than_a_block_are_updated_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rmsprop, "BLOCK_ELEMENTS", 7 * 12)  # rows of 12 features: blocks of 7, 7 and 2 rows
    assert check_against_plain([0, 3], SMALL, rounds=3)


def test_a_worker_leaves_heads_of_other_scenes_alone() -> None:
    group = group_of([0, 1], SMALL)
    before = {name: tensor.clone() for name, tensor in group.parameters.items()}
    for _ in range(3):
        group.round(0)
    for name in ("scene_weight", "scene_bias", "output_weight", "output_bias"):
        assert torch.equal(group.parameters[name][1], before[name][1])
        assert (group.squares[name][1] == 1 + EPSILON).all()
        assert not torch.equal(group.parameters[name][0], before[name][0])


@pytest.mark.parametrize(("rule", "reached"), [("kept", [0]), ("drawn", [0, 1, 2])])
def test_a_worker_keeps_its_target_or_draws_those_of_its_scene(rule: EpisodeTargets, reached: list[int]) -> None:
    group = group_of([0], replace(SMALL, step_limit=8, episode_targets=rule))
    totals = sum(group.round(0).totals for _ in range(60))
    assert torch.nonzero(totals[:, 0])[:, 0].tolist() == reached


def test_ended_episodes_are_counted_with_all_their_steps() -> None:
    group = group_of([0, 1, 2, 3, 4], replace(SMALL, step_limit=8))
    rounds = [group.round(0) for _ in range(40)]
    totals = sum(r.totals for r in rounds)
    assert all(r.updates == 5 for r in rounds)
    episodes, reached, steps, collisions = totals.sum(0).tolist()
    assert 0 < reached < episodes
    assert steps + int(group.navigation.elapsed.sum()) == sum(r.frames for r in rounds)
    assert 0 < collisions < steps


def test_a_group_goes_on_bit_for_bit() -> None:
    group, resumed = group_of([0, 1, 4], SMALL), group_of([0, 1, 4], SMALL)
    for _ in range(3):
        group.round(0)
    resumed.load_tensors({name: tensor.clone() for name, tensor in group.tensors().items()})
    for ours, theirs in ((group.parameters, resumed.parameters), (group.squares, resumed.squares)):
        for name, tensor in ours.items():
            theirs[name].copy_(tensor)
    for _ in range(3):
        first, second = group.round(0), resumed.round(0)
        assert (first.frames, first.figures) == (second.frames, second.figures)
    assert all(torch.equal(group.parameters[name], resumed.parameters[name]) for name in group.parameters)


def test_figures_are_means_over_the_updates() -> None:
    learner = replace(SMALL, rollout_steps=3)
    together = group_of([0, 2], learner).round(0).figures
    alone = [group_of([worker], learner).round(0).figures for worker in (0, 2)]
    for name in ("loss", "gradient_norm"):
        assert together[name] == pytest.approx(sum(a[name] for a in alone) / 2, rel=1e-4)
    assert together["entropy"] == pytest.approx(1.38, abs=0.02)  # of four actions, about alike
    assert (together["lr"], together["entropy_weight"]) == (learner.lr_start, learner.entropy_start)


def test_the_published_settings() -> None:
    paper = PAPER_A3C
    assert (paper.algorithm, paper.envs, paper.rollout_steps, paper.step_limit) == ("a3c", 20, 5, 5000)
    assert (paper.discount, paper.entropy_start, paper.entropy_end, paper.value_weight / 2) == (0.99, 0.01, 0.01, 0.25)
    assert (paper.lr_at(0), paper.lr_at(paper.frames // 2), paper.lr_at(paper.frames)) == (7e-4, 3.5e-4, 0)
    assert (paper.clip_norm, paper.clip_each_tensor, paper.sum_loss) == (40, True, True)
    assert (paper.clip_rewards, paper.reward_scale, paper.bootstrap_cut, paper.gae_lambda) == (True, 1, False, 1)
    assert (paper.width, paper.history_length, paper.centre_features) == (512, 4, False)
