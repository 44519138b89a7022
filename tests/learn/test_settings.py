import pytest

from clearway.errors import RunError
from clearway.learn.config import DEFAULT
from clearway.learn.settings import with_settings


def test_settings_keep_their_types() -> None:
    words = ["envs=200", "discount=0.5", "lr_start=1", "hindsight=false", "clip_rewards=true", "optimiser=rmsprop"]
    learner = with_settings(DEFAULT, words)
    assert (learner.envs, learner.discount, learner.lr_start) == (200, 0.5, 1.0)
    assert isinstance(learner.lr_start, float)
    assert (learner.hindsight, learner.clip_rewards, learner.optimiser) == (False, True, "rmsprop")
    assert learner.epochs == DEFAULT.epochs


def test_settings_that_belong_together_come_together() -> None:
    learner = with_settings(DEFAULT, ["algorithm=a2c", "epochs=1", "minibatches=1"])
    assert learner == DEFAULT.as_a2c()


def test_no_words_change_nothing() -> None:
    assert with_settings(DEFAULT, []) == DEFAULT


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("envs", "expected name=value with a name among frames, envs"),
        ("environments=3", "expected name=value"),
        ("envs=many", "--set envs=many: expected a whole number"),
        ("envs=1.5", "expected a whole number"),
        ("discount=high", "expected a number"),
        ("hindsight=yes", "expected true or false"),
        ("optimiser=sgd", "expected adam or rmsprop"),
        ("algorithm=dqn", "expected ppo or a2c or a3c"),
        ("epochs=0", "epochs is 0, expected at least 1"),
    ],
)
def test_words_that_cannot_be_read(word: str, message: str) -> None:
    with pytest.raises(RunError, match=message):
        with_settings(DEFAULT, [word])
