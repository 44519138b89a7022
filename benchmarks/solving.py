"""When is everything solved? Checks an agent now and then while it trains, with the clock stopped.

A target is solved when every one of 100 sampled episodes from random starts ends at it in under 500 steps.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from clearway.agents.agent import Agent
from clearway.evaluation.criteria import quality
from clearway.evaluation.episodes import EPISODES_PER_TARGET, run_episodes
from clearway.evaluation.metrics import SC_STEPS, by_target
from clearway.world.world import World

CHECK_SEED = 1
SCREENING_EPISODES = 5  # a target; the rest is walked only where these show no failure
SHORTEST_PAUSE_S = 5.0
PAUSE_SHARE = 0.05  # of the training time so far: the precision of the answer


def solved_count(world: World, agent: Agent, episodes: int = EPISODES_PER_TARGET) -> int:
    """How many targets are solved."""
    table = run_episodes(world, agent, episodes_per_target=episodes, step_limit=SC_STEPS, seed=CHECK_SEED)
    return quality(world, by_target(table, world.target_count)).solved_targets


class SolvingClock:
    """Seconds of training until every target is solved.

    Args:
        world: scenes and targets.
        agent: gives it as it stands.
        cap_s: seconds of training after which the agent has failed.

    Attributes:
        seconds: of training so far, checks left out.
        solved: every target was solved at the last check.
        out_of_time: the seconds are used up.
    """

    def __init__(self, world: World, agent: Callable[[], Agent], cap_s: float) -> None:
        self.world, self.agent, self.cap_s = world, agent, cap_s
        self.seconds, self.solved, self.out_of_time = 0.0, False, False
        self._check_at = SHORTEST_PAUSE_S
        self._since = time.perf_counter()

    def start(self) -> None:
        """Training begins now."""
        self._since = time.perf_counter()

    def over(self) -> bool:
        """Called after an update: every target is solved, or time is up. Looks only now and then."""
        self.seconds += time.perf_counter() - self._since
        self.out_of_time = self.seconds >= self.cap_s
        if self.seconds >= self._check_at or self.out_of_time:
            self.solved = self._all_solved()
            self._check_at = self.seconds + max(SHORTEST_PAUSE_S, PAUSE_SHARE * self.seconds)
        self._since = time.perf_counter()
        return self.solved or self.out_of_time

    def solved_count(self) -> int:
        """Targets that the agent solves as it stands."""
        return solved_count(self.world, self.agent())

    def _all_solved(self) -> bool:
        agent, targets = self.agent(), self.world.target_count
        return all(solved_count(self.world, agent, n) == targets for n in (SCREENING_EPISODES, EPISODES_PER_TARGET))
