"""Looking one step ahead with transitions observed before (Dyna; Sutton, 1990).

The learner remembers where every action led that any environment ever took. At each row of a rollout it can therefore
weigh all actions whose effect is known, not only the one taken, and draw the policy towards

    better(a)  ~  pi(a) exp(A(a) / temperature),      A(a) = r(a) + discount V(next pose, as a start) - V(here)

which does not vanish where pi(a) does. The next pose is judged as the start of an episode, because starts are drawn
from all poses: its value with the history at hand may be wrong for the very reason that nobody goes there.

Axis letters: B rows, A actions, K history, S states, M targets, P pairs of a pose and a target.
"""

from __future__ import annotations

import torch
from torch import Tensor

from clearway.learn.teacher import UNKNOWN
from clearway.model.lookup import LookupNetwork
from clearway.model.sums import counted
from clearway.world.navigation import Navigation
from clearway.world.world import World


class Observed:
    """Where actions led, as far as they were ever taken.

    Attributes:
        next_state: (S, A) int64; -1 where unknown.
    """

    def __init__(self, world: World) -> None:
        self.next_state = torch.full_like(world.next_state, UNKNOWN)

    def add(self, state: Tensor, action: Tensor, arrived: Tensor) -> None:
        """Remember steps, each (B,) int64."""
        self.next_state[state, action] = arrived


@torch.no_grad()
def better_policy(
    history: Tensor,
    target: Tensor,
    log_pi: Tensor,
    value: Tensor,
    observed: Observed,
    navigation: Navigation,
    network: LookupNetwork,
    *,
    discount: float,
    reward_scale: float,
    temperature: float,
) -> Tensor:
    """Probabilities that the policy is to be drawn towards, (B, A).

    Args:
        history, target: (B, K), (B,) int64, rows ordered by scene; histories as navigation has them.
        log_pi: (B, A) of the policy.
        value: (B,) of the rows.
        observed: known transitions.
        navigation: holds the world and the reward.
        network: judges the next poses.
        discount, reward_scale, temperature: as in the learner's settings.
    """
    world = navigation.world
    here = world.pose(history[:, -1])
    after = observed.next_state[here]  # (B, A)
    row, action = (after != UNKNOWN).nonzero(as_tuple=True)
    arrived = after[row, action]
    keys = target[row] * world.state_count + arrived
    pairs, pair_of = torch.unique(keys, return_inverse=True)  # ascending: ordered by target, so by scene
    state, goal = pairs % world.state_count, pairs // world.state_count
    rows_per_scene = counted(world.target_scene[goal], world.scene_count).tolist()
    start_value = network.start_values(state * world.sightings, goal, rows_per_scene)  # (P,) by own pictures
    reached = state == world.target_state[goal]
    worth = discount * torch.where(reached, 0.0, start_value)
    reward = navigation.earned(here[row], action, reached[pair_of]) * reward_scale
    advantage = torch.zeros_like(log_pi)
    advantage[row, action] = reward + worth[pair_of] - value[row]
    return torch.softmax(log_pi + advantage / temperature, 1)
