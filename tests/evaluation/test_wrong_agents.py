"""An agent that does what no agent may is refused in one line, not in a traceback out of somewhere else."""

from collections.abc import Callable

import numpy as np
import pytest

from clearway.agents.agent import Decisions
from clearway.agents.by_pose import RandomWalk
from clearway.errors import AgentError
from clearway.evaluation.episodes import run_episodes
from clearway.scenes.actions import Action
from clearway.world.world import make_world
from helpers.made import corridor_scene

WORLD = make_world([corridor_scene(5)], {"corridor": [0, 8]})


class Wrong(RandomWalk):
    """Takes good steps, then a wrong one."""

    def __init__(self, wrong: Callable[[int], Decisions], after: int) -> None:
        self.wrong, self.left = wrong, after

    def act(self, observation, state):
        self.left -= 1
        decisions, after = super().act(observation, state)
        return (self.wrong(len(decisions.action)) if self.left < 0 else decisions), after


def told(last: float) -> Callable[[int], Decisions]:
    def decisions(count: int) -> Decisions:
        probabilities = np.full((count, 4), 0.25)
        probabilities[-1, 2] = last
        return Decisions(np.zeros(count, np.int64), probabilities)

    return decisions


WRONG = {
    "too few": (lambda n: Decisions(np.zeros(n - 1, np.int64)), r"actions int64 \(5,\), expected int64 \(6,\)"),
    "a column": (lambda n: Decisions(np.zeros((n, 1), np.int64)), r"actions int64 \(6, 1\), expected int64 \(6,\)"),
    "a scalar": (lambda n: Decisions(np.array(2)), r"actions int64 \(\), expected int64 \(6,\)"),
    "floats": (lambda n: Decisions(np.zeros(n)), r"actions float64 \(6,\), expected int64 \(6,\)"),
    "flags": (lambda n: Decisions(np.ones(n, bool)), r"actions bool \(6,\), expected int64 \(6,\)"),
    "words": (lambda n: Decisions(np.array(["left"] * n)), r"actions <U4 \(6,\), expected int64 \(6,\)"),
    "unsigned": (lambda n: Decisions(np.zeros(n, np.uint8)), r"actions uint8 \(6,\), expected int64 \(6,\)"),
    "a list": (lambda n: Decisions([0] * n), r"actions list, expected int64 \(6,\)"),
    "a fifth": (lambda n: Decisions(np.array([0, 1, 2, 3, 4, 0])), "action 4, expected 0 to 3"),
    "a negative one": (lambda n: Decisions(np.array([0, 1, 2, 3, -1, 7])), "action -1, expected 0 to 3"),
    "NaN": (told(np.nan), "probabilities that are negative, not finite or all zero"),
    "infinite": (told(np.inf), "probabilities that are negative, not finite or all zero"),
    "negative": (told(-0.25), "probabilities that are negative, not finite or all zero"),
    "negative in sum": (told(-1.0), "probabilities that are negative, not finite or all zero"),
    "all zero": (lambda n: Decisions(np.zeros(n, np.int64), np.zeros((n, 4))), "negative, not finite or all zero"),
    "too few told": (
        lambda n: Decisions(np.zeros(n, np.int64), np.ones((n, 3))),
        r"probabilities float64 \(6, 3\), expected float32 \(6, 4\)",
    ),
    "actions alone": (lambda n: np.zeros(n, np.int64), r"gave ndarray, expected Decisions\. Give clearway\.Decisions"),
    "told once": (
        lambda n: Decisions(np.zeros(n, np.int64), np.ones(4)),
        r"probabilities float64 \(4,\), expected float32 \(6, 4\)",
    ),
}


@pytest.mark.parametrize("after", [0, 2], ids=["at once", "later"])
@pytest.mark.parametrize("name", WRONG)
def test_what_no_agent_may_do_is_said_in_one_line(name: str, after: int) -> None:
    wrong, said = WRONG[name]
    with pytest.raises(AgentError, match=said) as caught:
        run_episodes(WORLD, Wrong(wrong, after), episodes_per_target=3, seed=4)
    assert str(caught.value).startswith("the agent gave ") and "\n" not in str(caught.value)


def test_certainty_for_all_at_once_is_none() -> None:
    """One flag for all would make circles of walks that are none."""
    agent = Wrong(lambda count: Decisions(np.zeros(count, np.int64), certain=np.ones(1, bool)), 0)
    with pytest.raises(
        AgentError, match=r"gave certain bool \(1,\), expected bool \(6,\)\. Give a row for each episode"
    ):
        run_episodes(WORLD, agent, episodes_per_target=3)


ARRIVED = {
    "one for all": (lambda n: np.ones(1, bool), r"gave arrived bool \(1,\), expected bool \(6,\)"),
    "how sure": (lambda n: np.full(n, 0.2), r"gave arrived float64 \(6,\), expected bool \(6,\)"),
    "not any more": (lambda n: None, "gave arrived at some steps alone. Give it at each, or at none"),
}


@pytest.mark.parametrize("name", ARRIVED)
def test_whether_it_has_arrived_is_a_flag_for_each_episode_at_each_step(name: str) -> None:
    wrong, said = ARRIVED[name]

    class Tells(RandomWalk):
        steps = 0

        def act(self, observation, state):
            self.steps += 1
            decisions, after = super().act(observation, state)
            count = len(decisions.action)
            told = np.zeros(count, bool) if self.steps == 1 else wrong(count)
            return Decisions(decisions.action, arrived=told), after

    with pytest.raises(AgentError, match=said):
        run_episodes(WORLD, Tells(), episodes_per_target=3, seed=4)


@pytest.mark.parametrize("kind", [np.int8, np.int32])
def test_short_integers_are_actions_too(kind: type) -> None:
    turning, short = (
        run_episodes(
            WORLD, Wrong(lambda count, of=of: Decisions(np.ones(count, of)), 0), episodes_per_target=3, step_limit=9
        )
        for of in (np.int64, kind)
    )
    assert np.array_equal(turning.steps, short.steps) and np.array_equal(turning.start, short.start)


def test_the_same_good_steps_alone_are_walked_to_the_end() -> None:
    assert run_episodes(WORLD, Wrong(told(0.25), 2), episodes_per_target=3, step_limit=9, seed=4).steps.max() <= 9


STATES = {
    "none": (lambda n: None, r"the agent gave NoneType as its state, expected arrays by name\. Give \{\} where"),
    "an array": (lambda n: np.zeros((n, 2)), "the agent gave ndarray as its state, expected arrays by name"),
    "a list": (lambda n: {"turns": [0] * n}, r"state has 'turns', list, expected an array \(6, \.\.\.\)\. Give a row"),
    "too few rows": (lambda n: {"turns": np.zeros(n - 1)}, r"has 'turns' of shape \(5,\), expected \(6, \.\.\.\)"),
}


@pytest.mark.parametrize("when", ["reset", "act"])
@pytest.mark.parametrize("name", STATES)
def test_what_is_no_state_is_said_in_one_line(name: str, when: str) -> None:
    wrong, said = STATES[name]

    class Forgets(RandomWalk):
        def reset(self, target, seed):
            good = super().reset(target, seed)
            return wrong(len(seed)) if when == "reset" else good

        def act(self, observation, state):
            decisions, after = super().act(observation, state)
            return decisions, wrong(len(decisions.action)) if when == "act" else after

    with pytest.raises(AgentError, match=said) as caught:
        run_episodes(WORLD, Forgets(), episodes_per_target=3)
    assert "\n" not in str(caught.value)


def turns_seven_times(count: np.ndarray) -> Decisions:
    """Then goes forward, with a turn every fifth step."""
    action = np.where((count < 8) | (count % 5 == 0), Action.TURN_RIGHT, Action.MOVE_FORWARD)
    return Decisions(action.astype(np.int64), certain=np.ones(len(count), bool))


class Counts(RandomWalk):
    """Remembers how often it was asked."""

    def reset(self, target, seed):
        return {"count": np.zeros(len(seed), np.int64)}

    def act(self, observation, state):
        count = state["count"] + 1
        return turns_seven_times(count), {"count": count}


class CountsInPlace(Counts):
    """Writes to the state that it was given, which it should not."""

    def act(self, observation, state):
        state["count"] += 1
        return turns_seven_times(state["count"]), state


class CountsByChance(Counts):
    """Calls its memory so."""

    def reset(self, target, seed):
        return {"chance": np.zeros(len(seed), np.int64)}

    def act(self, observation, state):
        count = state["chance"] + 1
        return turns_seven_times(count), {"chance": count}


class Grows(Counts):
    """Keeps a row of all its steps, of more and more columns."""

    def reset(self, target, seed):
        return {"all": np.zeros((len(seed), 0))}

    def act(self, observation, state):
        steps = np.concatenate([state["all"], np.ones((len(state["all"]), 1))], axis=1)
        return turns_seven_times(steps.sum(1)), {"all": steps}


class AddsNames(Counts):
    """Remembers something else from the third step on."""

    def act(self, observation, state):
        count = state["count"] + 1
        return turns_seven_times(count), {"count": count, **({"late": count} if count[0] > 2 else {})}


@pytest.mark.parametrize("kind", [CountsInPlace, CountsByChance, Grows, AddsNames])
def test_however_an_agent_keeps_its_count_no_circle_is_seen_where_there_is_none(kind: type) -> None:
    plain, other = (run_episodes(WORLD, agent(), episodes_per_target=8, step_limit=200) for agent in (Counts, kind))
    assert not plain.looped.any() and not other.looped.any()
    assert plain.reached.any() and np.array_equal(plain.steps, other.steps)
