from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from clearway.errors import RunError
from clearway.experiments import plan
from clearway.experiments.plan import Job, PlannedRun, SceneFile, Trial, merged
from clearway.reward import COLLISION_AWARE, SHORTEST, Arrival, Reward, Term, Time
from helpers import own_terms
from helpers.small_runs import small_learner

RUN = PlannedRun((SceneFile("room", Path("a/room.h5"), "digest"),), ((1, 2),), SHORTEST, small_learner(), 0)


def test_a_name_says_what_a_person_wants_to_know() -> None:
    assert RUN.name.startswith("ppo-shortest-2t-0.0008M-s0-")


def test_a_scene_s_path_does_not_matter_its_content_does() -> None:
    moved = replace(RUN, scenes=(SceneFile("room", Path("elsewhere/room.h5"), "digest"),))
    other = replace(RUN, scenes=(SceneFile("room", Path("a/room.h5"), "another"),))
    assert moved.name == RUN.name != other.name


@pytest.mark.parametrize(
    "change",
    [
        {"seed": 1},
        {"targets": ((1, 3),)},
        {"reward": COLLISION_AWARE},
        {"reward": SHORTEST.with_changes(alpha=-0.02)},
        {"learner": small_learner(lr_end=1e-6)},
    ],
)
def test_whatever_changes_the_agent_changes_the_name(change: dict) -> None:
    assert replace(RUN, **change).name != RUN.name


def test_a_seed_out_of_range_is_refused() -> None:
    assert replace(RUN, seed=2**31 - 1).seed == 2**31 - 1
    with pytest.raises(RunError, match=f"seed is {2**31}, expected 0 to {2**31 - 1}"):
        replace(RUN, seed=2**31)


def test_a_learner_s_name_is_what_it_was_before_it_could_set_itself_goals() -> None:
    assert RUN.name.endswith("fdeec392ab")
    assert replace(RUN, learner=small_learner(goals="seen")).name != RUN.name


@dataclass(frozen=True)
class Dear(Term):
    cost: float = 0.1

    def __call__(self, earned, moves):
        return earned - self.cost


@dataclass(frozen=True)
class Cheap(Dear):
    def __call__(self, earned, moves):
        return earned + self.cost


def test_terms_of_one_s_own_are_told_apart_by_their_class() -> None:
    first, second = (replace(RUN, reward=Reward("mine", (Time(), kind(0.1), Arrival()))) for kind in (Dear, Cheap))
    assert first.name != second.name
    assert replace(RUN, seed=np.int64(7)).name == replace(RUN, seed=7).name
    numpy = Reward("shortest", (Time(np.float32(-0.5)), Arrival()))
    assert replace(RUN, reward=numpy).name == replace(RUN, reward=Reward("shortest", (Time(-0.5), Arrival()))).name


def test_the_code_of_terms_of_one_s_own_is_part_of_the_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def name(*edits: tuple[str, str]) -> str:
        return replace(RUN, reward=own_terms.imported(tmp_path / "turning.py", monkeypatch, *edits).REWARD).name

    assert name() == name(("return UNUSED", "return 7")) != name(own_terms.DEARER)


@pytest.mark.parametrize(("frames", "half"), [(1, 1), (2, 1), (3, 1), (10, 5)])
def test_every_training_comes_by_its_half(frames: int, half: int) -> None:
    assert replace(RUN, learner=replace(RUN.learner, frames=frames)).halfway == half


def test_a_trial_s_name_tells_it_from_others() -> None:
    trials = [
        Trial(((1,),)),
        Trial(((2,),)),
        Trial(((1,),), halfway=True),
        Trial(((1,),), step_limit=9),
        Trial(((1,),), seed=2),
    ]
    assert len({trial.name for trial in trials}) == len(trials)


def test_a_run_is_planned_once_with_all_its_trials() -> None:
    other = replace(RUN, seed=1)
    first, second = Trial(((1,),)), Trial(((1,),), halfway=True)
    jobs = merged([Job(RUN, (first,)), Job(other, (first,)), Job(RUN, (second, first))])
    assert jobs == [Job(RUN, (first, second)), Job(other, (first,))]


def test_a_name_is_computed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Many runs' names are asked for several times a second while others train."""
    named = replace(RUN), Trial(((1, 2),))
    names = [each.name for each in named]
    monkeypatch.setattr(plan, "_digest", lambda content: pytest.fail("computed again"))
    assert [each.name for each in named] == names
    assert named == (replace(RUN), Trial(((1, 2),)))  # that a name is known is no difference
