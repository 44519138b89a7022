"""The algorithms by name, and settings carried from one to another."""

from dataclasses import asdict, replace

import pytest

from clearway.errors import RunError
from clearway.learn.a2c import A2C
from clearway.learn.a3c.config import A3C
from clearway.learn.adapt import Adapt
from clearway.learn.algorithms import ALGORITHMS, algorithm, carried_over
from clearway.learn.bc import BC
from clearway.learn.learner import Learner
from clearway.learn.ppo import PPO
from clearway.learn.presets import DEFAULT, PAPER_A2C, PAPER_A3C
from clearway.learn.q_learning import QLearning
from clearway.learn.recurrent import Recurrent
from clearway.reward import COLLISION_AWARE


def test_algorithms_are_found_by_name() -> None:
    others = {"bc": BC, "q-learning": QLearning, "recurrent": Recurrent, "adapt": Adapt}
    assert {"ppo": PPO, "a2c": A2C, "a3c": A3C} | others == ALGORITHMS
    assert algorithm("a3c") is A3C
    with pytest.raises(RunError, match=r"algorithm 'dqn': no such algorithm\. Use one of ppo, a2c, a3c, bc"):
        algorithm("dqn")


def test_a_setting_that_an_algorithm_lacks_it_has_nowhere() -> None:
    assert asdict(PPO()).keys() - asdict(A2C()).keys() == {"epochs", "minibatches", "siamese_step", "ratio_clip"}
    assert asdict(A3C()).keys() < asdict(A2C()).keys()
    for name in ("hindsight", "lookahead", "balance", "optimiser", "heads", "matmul_precision", "reward_scale"):
        assert name not in asdict(A3C())
    for settings in (BC(), QLearning()):
        assert not asdict(settings).keys() & {"gae_lambda", "entropy_start", "hindsight", "reward_scale"}


def test_settings_of_the_same_name_are_carried_over() -> None:
    assert carried_over(DEFAULT, A2C) == A2C()
    assert carried_over(PAPER_A2C, A3C) == replace(PAPER_A3C, envs=100)
    assert (carried_over(PAPER_A3C, A2C).envs, carried_over(PAPER_A3C, A2C).episode_targets) == (20, "drawn")
    assert carried_over(replace(PAPER_A3C, episode_targets="drawn"), A2C).episode_targets == "drawn"
    assert carried_over(replace(PAPER_A2C, episode_targets="kept"), A3C).episode_targets == "kept"
    assert carried_over(replace(PAPER_A2C, episode_targets="kept"), PPO).episode_targets == "kept"
    assert carried_over(replace(DEFAULT, frames=77, width=33), BC) == replace(
        carried_over(DEFAULT, BC), frames=77, width=33
    )
    assert carried_over(PAPER_A2C, PAPER_A2C.__class__) == PAPER_A2C


@pytest.mark.parametrize("learner", [PAPER_A2C, PAPER_A3C, QLearning(clip_rewards=True)])
def test_an_algorithm_that_clips_pays_a_clipped_reward_whoever_was_asked(learner: Learner) -> None:
    clipped = replace(COLLISION_AWARE, clip=True)
    assert learner.paid(COLLISION_AWARE) == learner.paid(clipped) == clipped


def test_a_reward_that_clips_under_settings_that_do_not_is_refused_with_the_remedy() -> None:
    assert PPO().paid(COLLISION_AWARE) == COLLISION_AWARE
    with pytest.raises(RunError, match=r"reward collision-aware clips, .*ppo's setting.* Set clip_rewards to true"):
        PPO().paid(replace(COLLISION_AWARE, clip=True))


def test_an_algorithm_without_the_setting_pays_the_reward_as_it_is() -> None:
    for reward in (COLLISION_AWARE, replace(COLLISION_AWARE, clip=True)):
        assert BC().paid(reward) is reward
