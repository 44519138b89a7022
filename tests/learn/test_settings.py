from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Optional

import numpy as np
import pytest

from clearway.errors import RunError
from clearway.learn.ppo import PPO
from clearway.learn.presets import DEFAULT, PAPER_A2C, PAPER_A3C
from clearway.learn.settings import with_settings


def test_settings_keep_their_types() -> None:
    words = ["envs=200", "discount=0.5", "lr_start=1", "hindsight=false", "clip_rewards=true", "optimiser=rmsprop"]
    learner = with_settings(DEFAULT, words)
    assert (learner.envs, learner.discount, learner.lr_start) == (200, 0.5, 1.0)
    assert isinstance(learner.lr_start, float)
    assert (learner.hindsight, learner.clip_rewards, learner.optimiser) == (False, True, "rmsprop")
    assert learner.epochs == DEFAULT.epochs


def test_a_setting_that_the_algorithm_lacks_is_refused_with_the_names_of_those_it_has() -> None:
    for learner, word, has in ((PAPER_A2C, "epochs=2", "hindsight"), (PAPER_A3C, "hindsight=true", "clip_norm")):
        with pytest.raises(RunError, match=rf"^--set {word}: .* {learner.algorithm}'s settings: frames, .*{has}"):
            with_settings(learner, [word])


def test_a_setting_of_other_learners_is_told_with_their_names_and_the_one_that_was_asked_for() -> None:
    told = (
        r"a name among paper's settings: frames, .*\. epochs is a setting of default, ppo, .*recurrent.*\. Correct it$"
    )
    with pytest.raises(RunError, match=told) as caught:
        with_settings(PAPER_A2C, ["epochs=2"], "paper")
    of = str(caught.value).partition("epochs is a setting of ")[2]
    assert "a2c" not in of and "paper" not in of
    for word, hint in (("epoch=2", r"\. Correct it$"), ("env=2", r"\. Did you mean envs\? Correct it$")):
        with pytest.raises(RunError, match=hint) as caught:
            with_settings(PAPER_A2C, [word])
        assert "is a setting of" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"frames": 4e2}, "frames is 400.0, expected a whole number"),
        ({"envs": "10"}, "envs is '10', expected a whole number"),
        ({"optimiser": "Adam"}, "optimiser is 'Adam', expected 'adam' or 'rmsprop'"),
        ({"hindsight": "no"}, "hindsight is 'no', expected True or False"),
        ({"discount": None}, "discount is None, expected a finite number"),
    ],
)
def test_settings_of_another_type_are_refused_before_anything_is_written(changes: dict, message: str) -> None:
    with pytest.raises(RunError, match=f"^{message}. Correct it"):
        PPO(**changes)


def test_numbers_of_numpy_are_kept_as_records_hold_them() -> None:
    learner = PPO(frames=np.int64(400), lr_start=np.float32(0.5), hindsight=np.bool_(True))
    assert [type(value) for value in (learner.frames, learner.lr_start, learner.hindsight)] == [int, float, bool]


@dataclass(frozen=True)
class Unkept(PPO):
    shapes: tuple[int, ...] = (1, 2)


@dataclass(frozen=True)
class Elsewhere(PPO):
    known: ClassVar[Nowhere]  # noqa: F821 (as of an import for types alone)
    start: Optional[float] = None  # noqa: UP045 (written so before Python 3.10)


def test_types_of_another_package_s_settings() -> None:
    with pytest.raises(RunError, match=r"^Unkept: shapes is of the type .*, and settings are numbers, True"):
        Unkept()
    assert (Elsewhere().start, Elsewhere(start=1.0).start) == (None, 1.0)
    with pytest.raises(RunError, match="start is 'x', expected a finite number or None"):
        Elsewhere(start="x")


def test_no_words_change_nothing() -> None:
    assert with_settings(DEFAULT, []) == DEFAULT


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("envs", "expected name=value with a name among ppo's settings: frames, "),
        ("environments=3", "expected name=value"),
        ("envs=many", "--set envs=many: expected a whole number"),
        ("envs=1.5", "expected a whole number"),
        ("discount=high", "expected a number"),
        ("hindsight=yes", "expected true or false"),
        ("optimiser=sgd", "expected adam or rmsprop"),
        ("algorithm=dqn", "expected name=value"),
        ("epochs=0", "epochs is 0, expected at least 1"),
    ],
)
def test_words_that_cannot_be_read(word: str, message: str) -> None:
    with pytest.raises(RunError, match=message):
        with_settings(DEFAULT, [word])
