"""Exact yardsticks: what the best agent, and an ideally trained one, would do, by dynamic programming.

For one scene, target and reward:

- shortest path: fewest steps, by breadth-first search;
- optimal: the policy of the highest discounted reward, equally good actions taken alike;
- soft: the fixed point pi = softmax(Q^pi / entropy weight), where the loss of A3C comes to rest if the network can
  represent anything (its entropy bonus counts for the step at hand, not for later ones).

Expected steps, collisions and zone visits of a policy come from one sparse linear solve, averaged over all starts or
over given ones, such as those of the agents that are compared with it. A visit is an arrival; the target belongs to no
zone, and the first pose of an episode is not an arrival.

Axis letters: S states, A actions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from clearway.errors import SceneError
from clearway.reward import Moves, Reward
from clearway.scenes.actions import ACTION_COUNT, BLOCKED
from clearway.scenes.graph import distances_to, next_states
from clearway.world.targets import is_start
from clearway.zones import Zone

DISCOUNT = 0.99
ENTROPY_WEIGHT = 0.01
TIE = 1e-9  # action values closer than this are equal
CONVERGED = 1e-11
NEAR = 1e-2  # error of values below which Newton's method takes over
MOST_ROUNDS = 1000


@dataclass(frozen=True)
class Task:
    """One target of one scene as a decision problem.

    Attributes:
        target: state.
        next_state: (S, A) int64.
        blocked: (S, A) bool.
        reward: (S, A) float64, earned by each action.
        zone: (S,) int, zone of each pose.
        starts: (K,) int64, all states from which the target can be reached, itself excluded.
        steps_to_go: (S,) int32 shortest-path steps to the target; -1 where there is no path.
    """

    target: int
    next_state: np.ndarray
    blocked: np.ndarray
    reward: np.ndarray
    zone: np.ndarray
    starts: np.ndarray
    steps_to_go: np.ndarray


@dataclass(frozen=True)
class Expected:
    """Means over starts, per episode."""

    steps: float
    collisions: float
    collision_visits: float
    precollision_visits: float


NEVER = Expected(np.inf, np.inf, np.inf, np.inf)


@dataclass(frozen=True)
class Yardstick:
    """What can be reached with one target.

    Attributes:
        shortest_path_steps: mean over starts.
        optimal, soft: figures of the two policies.
        optimal_policy, soft_policy: (S, A) action probabilities.
    """

    shortest_path_steps: float
    optimal: Expected
    soft: Expected
    optimal_policy: np.ndarray
    soft_policy: np.ndarray


def make_task(
    graph: np.ndarray, zone: np.ndarray, target: int, reward: Reward, clearance_m: np.ndarray | None = None
) -> Task:
    """The decision problem of reaching `target` in a graph (S, A) with zones (S,), under a reward.

    Args:
        graph: next state by action, -1 where a move is blocked.
        zone: of each pose.
        target: state.
        reward: is earned.
        clearance_m: (S,) float64, of each pose; None: there is no obstacle anywhere near.

    Raises:
        SceneError: no state leads to the target.
    """
    clearance_m = np.full(len(graph), np.inf) if clearance_m is None else clearance_m
    table = reward.table(Moves(next_states(graph), graph == BLOCKED, zone, clearance_m))
    return task_of(graph, zone, target, table)


def task_of(graph: np.ndarray, zone: np.ndarray, target: int, table: np.ndarray) -> Task:
    """Likewise, by what every action earns: (2, S, A), see `Reward.table`."""
    after, blocked = next_states(graph), graph == BLOCKED
    steps = distances_to(graph, np.array([target]))[0]
    starts = np.flatnonzero(is_start(steps))
    if not len(starts):
        raise SceneError("graph", f"no state leads to target {target}", "Choose a target in the largest component")
    step, arrival = table
    earned = np.where(after == target, arrival, step)
    return Task(target, after, blocked, earned, zone, starts, steps)


def yardstick(
    task: Task,
    discount: float = DISCOUNT,
    entropy_weight: float = ENTROPY_WEIGHT,
    starts: np.ndarray | None = None,
) -> Yardstick:
    """Shortest path, optimal and soft policy of a task, exactly.

    Args:
        task: see there.
        discount: of rewards to come.
        entropy_weight: of the soft policy.
        starts: (E,) int64 states among the task's to average over, one as often as it occurs; None: all of the task's.
    """
    best = optimal_policy(task, discount)
    soft = soft_policy(task, discount, entropy_weight)
    return Yardstick(
        shortest_path_steps=float(task.steps_to_go[task.starts if starts is None else starts].mean()),
        optimal=expected(task, best, starts),
        soft=expected(task, soft, starts),
        optimal_policy=best,
        soft_policy=soft,
    )


def action_values(task: Task, value: np.ndarray, discount: float) -> np.ndarray:
    """Q(s, a) = r(s, a) + discount V(s'), (S, A), from values (S,); the target's own value counts as 0."""
    return task.reward + discount * np.where(task.next_state == task.target, 0.0, value[task.next_state])


def optimal_policy(task: Task, discount: float = DISCOUNT) -> np.ndarray:
    """The policy of the highest discounted reward, (S, A); equally good actions are equally probable.

    Policy iteration (Howard, 1960), begun from a shortest-path policy.
    """
    forward = task.steps_to_go[task.next_state]
    choice = np.where(forward < 0, np.iinfo(np.int32).max, forward).argmin(1)
    for _ in range(MOST_ROUNDS):
        value = _policy_value(task, np.eye(ACTION_COUNT)[choice], discount)
        values = action_values(task, value, discount)
        better = values.max(1) > values[np.arange(len(choice)), choice] + TIE
        if not better.any():
            ties = values >= values.max(1, keepdims=True) - TIE
            return ties / ties.sum(1, keepdims=True)
        choice = np.where(better, values.argmax(1), choice)
    raise AssertionError("policy iteration did not end")


def soft_policy(
    task: Task,
    discount: float = DISCOUNT,
    entropy_weight: float = ENTROPY_WEIGHT,
    first_value: np.ndarray | None = None,
) -> np.ndarray:
    """The fixed point pi = softmax(Q^pi / entropy_weight), (S, A).

    Far from it each policy is evaluated exactly; near it Newton's method solves V = sum_a pi_V(a) Q_V(a), with
    d V / d Q_a = pi(a) (1 + (Q_a - V) / entropy_weight). Nothing proves that there is one alone: `first_value` is for
    looking for others.

    Args:
        task: see there.
        discount: of rewards to come.
        entropy_weight: of the bonus.
        first_value: (S,) values of states to begin from; None: zeros.

    Raises:
        SceneError: the policies do not settle, which a larger entropy weight or a smaller discount mends.
    """
    value = np.zeros(len(task.reward)) if first_value is None else first_value
    for _ in range(MOST_ROUNDS):
        values = action_values(task, value, discount)
        policy = np.exp((values - values.max(1, keepdims=True)) / entropy_weight)
        policy /= policy.sum(1, keepdims=True)
        renewed = (policy * values).sum(1)
        error = np.abs(renewed - value).max()
        if error < CONVERGED:
            return policy
        if error > NEAR:
            value = _policy_value(task, policy, discount)
        else:
            slope = policy * (1 + (values - renewed[:, None]) / entropy_weight)
            value = value + _discounted_solve(task, slope, discount, renewed - value)
    raise SceneError(
        f"target {task.target}",
        f"the soft policy did not settle in {MOST_ROUNDS} rounds",
        "Use a larger entropy weight or a smaller discount",
    )


def expected(task: Task, policy: np.ndarray, starts: np.ndarray | None = None) -> Expected:
    """Expected figures of an episode under a policy (S, A), averaged over starts as in `yardstick`.

    Inf where an episode may never end, or so rarely that float64 cannot tell.
    """
    walking = task.starts
    inside = np.zeros(len(task.reward), bool)
    inside[walking] = True
    mass = policy[walking]
    onward = task.next_state[walking]
    lost = ~inside[onward] & (onward != task.target)
    if (mass[lost] > 0).any() or not _arrives(task, policy):
        return NEVER
    zone = np.where(onward == task.target, Zone.FREE, task.zone[onward])

    def arrivals(at: Zone) -> np.ndarray:
        return (mass * (zone == at)).sum(1)

    per_step = np.stack(
        [
            np.ones(len(walking)),
            (mass * task.blocked[walking]).sum(1),
            arrivals(Zone.COLLISION),
            arrivals(Zone.PRECOLLISION),
        ],
        1,
    )
    try:
        place = np.where(inside, np.cumsum(inside) - 1, 0)  # of a state among those that walk
        per_episode = _solve(place[onward], np.where(inside[onward], mass, 0.0), per_step)
    except RuntimeError:  # singular: from some pose the chance to arrive is lost in rounding
        return NEVER
    lengths = per_episode[:, 0]
    if not ((lengths >= 1) & (lengths < 1 / np.finfo(np.float64).eps)).all():
        return NEVER
    chosen = slice(None) if starts is None else np.searchsorted(walking, starts)
    steps, collisions, collision_visits, precollision_visits = per_episode[chosen].mean(0).tolist()
    return Expected(steps, collisions, collision_visits, precollision_visits)


def _arrives(task: Task, policy: np.ndarray) -> bool:
    """From every start some actions that the policy may take lead to the target."""
    allowed = np.where(policy > 0, task.next_state, np.arange(len(policy))[:, None])
    steps = distances_to(allowed, np.array([task.target]))[0]
    return bool((steps[task.starts] > 0).all())


def _policy_value(task: Task, policy: np.ndarray, discount: float) -> np.ndarray:
    """V^pi (S,), the target's own value counted as 0."""
    return _discounted_solve(task, policy, discount, (policy * task.reward).sum(1))


def _discounted_solve(task: Task, weights: np.ndarray, discount: float, right: np.ndarray) -> np.ndarray:
    """X with x(s) = right(s) + discount sum_a weights(s, a) x(s'), where the target's own x counts as 0."""
    onward = np.where(task.next_state == task.target, 0.0, discount * weights)
    return _solve(task.next_state, onward, right)


def _solve(next_state: np.ndarray, weights: np.ndarray, right: np.ndarray) -> np.ndarray:
    """X with x(s) = right(s) + sum_a weights(s, a) x(next_state(s, a)); states by actions, right (S,) or (S, K).

    Raises:
        RuntimeError: there is none, or more than one.
    """
    state = np.arange(len(weights))
    rows, columns = np.repeat(state, ACTION_COUNT), next_state.reshape(-1)
    places = np.concatenate([state, rows]), np.concatenate([state, columns])
    values = np.concatenate([np.ones(len(state)), -weights.reshape(-1)])
    matrix = csc_array((values, places), shape=(len(state), len(state)))  # adds up what is at one place
    matrix.eliminate_zeros()
    return splu(matrix).solve(right)
