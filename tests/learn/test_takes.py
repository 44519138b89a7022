"""Training by several pictures of every pose."""

import numpy as np
import pytest
import torch
from torch import Tensor

from clearway.errors import RunError
from clearway.learn.bc import BC
from clearway.learn.run_record import record_of
from clearway.learn.train import train
from clearway.learn.trainer import Trainer
from clearway.reward import COLLISION_AWARE
from clearway.scenes.scene import Scene
from clearway.world.world import World
from helpers.small_runs import equal_bits, small_learner, small_request, small_scenes, small_world

TAKES = 3
MADE = {"label": "all", "takes": TAKES}


def takes_of(scenes: list[Scene], spread: float) -> list[np.ndarray]:
    """Features of takes (S, K, F) that differ so much from the scenes' own."""
    rng = np.random.default_rng(0)
    found = []
    for scene in scenes:
        assert scene.features is not None
        shape = (scene.state_count, TAKES, scene.features.shape[1])
        found.append(scene.features[:, None] + spread * rng.standard_normal(shape).astype(np.float32))
    return found


def with_takes(spread: float) -> World:
    return small_world().with_takes(takes_of(small_scenes(), spread))


def rolled_out(world: World) -> tuple[Trainer, dict[str, Tensor]]:
    trainer = Trainer(world, small_learner(), COLLISION_AWARE, seed=5)
    trainer.lookup.refresh()
    rollout = trainer.collector.collect()
    poses = {"history": world.pose(rollout.history), "last": world.pose(rollout.last_history)}
    return trainer, {**poses, **{name: getattr(rollout, name) for name in ("target", "action", "arrived", "reward")}}


def test_a_pose_s_rows_are_its_own_picture_s_and_its_takes() -> None:
    scenes, world = small_scenes(), with_takes(0.5)
    taken = np.concatenate(takes_of(scenes, 0.5))
    own = np.concatenate([scene.features for scene in scenes])
    rows = world.features.unflatten(0, (-1, world.sightings)).numpy()
    np.testing.assert_array_equal(rows[:, 0], own)
    np.testing.assert_array_equal(rows[:, 1:], taken)
    assert world.pose(torch.tensor([0, 3, 4, 9])).tolist() == [0, 0, 1, 2]


def test_takes_that_look_alike_change_nothing_of_a_walk() -> None:
    _, plain = rolled_out(small_world())
    _, same = rolled_out(with_takes(0.0))
    assert equal_bits(plain, same)


def test_another_picture_is_seen_at_every_step() -> None:
    world = with_takes(0.5)
    trainer, _ = rolled_out(world)
    seen = [trainer.collector.collect().history[..., -1] % world.sightings for _ in range(5)]
    share = torch.bincount(torch.cat(seen).flatten(), minlength=world.sightings) / sum(part.numel() for part in seen)
    assert len(share) == 1 + TAKES and share.min() > 0.15
    history = trainer.navigation.history
    trainer.navigation.step(torch.zeros(len(history), dtype=torch.int64))
    assert torch.equal(trainer.navigation.history[:, :-1], history[:, 1:])  # what was seen stays


@pytest.mark.slow
def test_it_learns_by_them_and_goes_on_bit_for_bit(tmp_path) -> None:
    scenes = small_scenes()
    request = small_request(takes=takes_of(scenes, 0.3), takes_made=MADE)
    whole, halved = request.trainer(), request.trainer()
    for _ in range(2):
        assert np.isfinite(whole.update()["loss"])
        halved.update()
    again = request.trainer()
    again.load_tensors(halved.tensors(), halved.frames, halved.updates)
    whole.update()
    again.update()
    assert equal_bits(whole.tensors(), again.tensors())
    folder = train(request, tmp_path / "run")
    record = folder.read_record()
    assert record.takes == MADE and record.same_experiment(record_of(request))
    assert not record.same_experiment(record_of(small_request(learner=request.learner)))


def test_poses_are_counted_whatever_was_seen_of_them() -> None:
    """Hindsight, look-ahead and rewards go by poses: what was observed of moves is the world's own."""
    world = with_takes(0.5)
    trainer, _ = rolled_out(world)
    trainer.update()
    known = trainer.observed.next_state
    assert known.shape == world.next_state.shape and (known >= 0).any()
    assert torch.equal(known[known >= 0], world.next_state[known >= 0])


def test_own_goals_are_poses_whatever_was_seen_of_them() -> None:
    trainer = Trainer(with_takes(0.5), small_learner(goals="seen"), COLLISION_AWARE, seed=5)
    for _ in range(3):
        figures = trainer.update()
    assert trainer.own_goals is not None and figures["own_goals"] > 0
    assert trainer.own_goals.known.sum() <= trainer.world.state_count


def test_takes_that_look_alike_teach_the_same() -> None:
    """Up to rounding, in one pass over all rows: hindsight, look-ahead and rewards go by poses."""
    learner = small_learner(epochs=1, minibatches=1, matmul_precision="highest", lookahead=0.1)
    plain, same = (Trainer(world, learner, COLLISION_AWARE, seed=5) for world in (small_world(), with_takes(0.0)))
    for _ in range(3):
        first, second = plain.update(), same.update()
        assert first["hindsight_rows"] == second["hindsight_rows"] > 0
    for one, other in zip(plain.network.parameters(), same.network.parameters(), strict=True):
        torch.testing.assert_close(one, other, rtol=0, atol=1e-5)


def test_other_algorithms_refuse_them() -> None:
    with pytest.raises(RunError, match=r"bc learns from the scenes' own pictures alone\. .* ppo, a2c or recurrent"):
        small_request(takes=takes_of(small_scenes(), 0.1), learner=small_learner(BC()))
