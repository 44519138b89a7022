import numpy as np
import pytest

from clearway.reward import BUMP, COLLISION_AWARE, REWARDS, SHORTEST, Reward

NOT_REACHED, REACHED = 0, 1
MOVED, BLOCKED = 0, 1


def test_collision_aware_pays_by_the_zone_of_arrival() -> None:
    table = COLLISION_AWARE.table()
    assert table.shape == (2, 2, 3)
    assert table[NOT_REACHED, MOVED].tolist() == [-0.01, -0.011, -0.02]  # free, precollision, collision
    assert table[NOT_REACHED, BLOCKED].tolist() == [-0.01, -0.011, -0.02]


def test_shortest_charges_every_step_alike() -> None:
    assert SHORTEST.table()[NOT_REACHED].tolist() == [[-0.01] * 3] * 2


def test_bump_charges_a_blocked_move_whatever_the_zone() -> None:
    table = BUMP.table()
    assert table[NOT_REACHED, MOVED].tolist() == [-0.01] * 3
    assert table[NOT_REACHED, BLOCKED].tolist() == [-0.1] * 3


@pytest.mark.parametrize("reward", REWARDS.values(), ids=REWARDS)
def test_the_target_comes_before_all_zones(reward: Reward) -> None:
    assert (reward.table()[REACHED] == 10.0).all()


@pytest.mark.parametrize("reward", REWARDS.values(), ids=REWARDS)
def test_clipping_changes_the_target_alone(reward: Reward) -> None:
    clipped = reward.with_changes(clip=True).table()
    assert (clipped[REACHED] == 1.0).all()
    assert np.array_equal(clipped[NOT_REACHED], reward.table()[NOT_REACHED])


def test_clipping_works_downwards_too() -> None:
    assert Reward("harsh", beta=-3.0, clip=True).table()[NOT_REACHED, MOVED].tolist() == [-0.01, -0.011, -1.0]


def test_with_changes_leaves_what_is_none() -> None:
    changed = COLLISION_AWARE.with_changes(beta=-0.5, gamma=None)
    assert (changed.alpha, changed.beta, changed.gamma, changed.terminal) == (-0.01, -0.5, -0.011, 10.0)
    assert COLLISION_AWARE.beta == -0.02
