"""Hindsight: what a rollout teaches about other targets that it passed by (after Andrychowicz et al., 2017).

Where a stretch of an episode arrives at another training target of its scene, its steps are told again as if that had
been the target. The actions came from the policy for the original target, so advantages and values are corrected by
V-trace's truncated importance ratios.

Axis letters: T steps, N environments, J targets of a scene, R rows found.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from clearway.learn.losses import Batch
from clearway.learn.returns import vtrace
from clearway.learn.rollout import Rollout
from clearway.model.lookup import LookupNetwork
from clearway.model.sums import counted
from clearway.world.navigation import Navigation


@dataclass(frozen=True)
class Segments:
    """Steps told again, R rows ordered by scene.

    Attributes:
        step, env, slot: (R,) int64, indices into (T, N, J).
        target: (R,) int64, the target passed by.
        hit: (R,) bool, the step arrives at it.
        rows_per_scene: rows of each scene.
    """

    step: Tensor
    env: Tensor
    slot: Tensor
    target: Tensor
    hit: Tensor
    rows_per_scene: tuple[int, ...]


def find_segments(rollout: Rollout, navigation: Navigation, told: Tensor | None = None) -> Segments:
    """The stretches of a rollout that arrive at another target of their scene, one of `told` (M,) bool, all if None."""
    world, choice = navigation.world, navigation.choice
    members, valid = choice.members, choice.weights > 0
    if told is not None:
        valid = valid & told[members]
        slots = torch.argsort(~valid, dim=1, stable=True)[:, : max(1, int(valid.sum(1).max()))]
        members, valid = members.gather(1, slots), valid.gather(1, slots)
    members, valid = members[choice.groups], valid[choice.groups]  # (N, J)
    member_state = world.target_state[members]
    hit = rollout.arrived[..., None] == member_state  # (T, N, J)
    hit &= valid & (rollout.target[..., None] != members)
    elsewhere = world.pose(rollout.history[:, :, -1, None]) != member_state
    open_t = ~(rollout.reached | rollout.truncated)[..., None]
    used = torch.empty_like(hit)
    alive = torch.zeros_like(hit[0])
    for t in range(len(hit) - 1, -1, -1):
        alive = ((alive & open_t[t]) | hit[t]) & elsewhere[t]
        used[t] = alive
    env, step, slot = used.transpose(0, 1).nonzero(as_tuple=True)  # ordered by scene, as environments are
    rows_per_scene = tuple(counted(choice.groups[env], world.scene_count).tolist())
    return Segments(step, env, slot, members[env, slot], hit[step, env, slot], rows_per_scene)


@torch.no_grad()
def hindsight_batch(
    rollout: Rollout,
    log_prob: Tensor,
    navigation: Navigation,
    network: LookupNetwork,
    *,
    discount: float,
    reward_scale: float,
    trace_lambda: float,
    told: Tensor | None = None,
) -> Batch | None:
    """The rows that hindsight adds to a rollout, ordered by scene; None if it passed no other target.

    Args:
        rollout: what happened.
        log_prob: (T, N) of the actions when they were taken.
        navigation: the environments that the rollout came from.
        network: values and probabilities under the targets passed by.
        discount, reward_scale, trace_lambda: as in the learner's settings.
        told: (M,) bool, the targets that steps are told again for; None for all.
    """
    rows = find_segments(rollout, navigation, told)
    if not len(rows.step):
        return None
    history = rollout.history[rows.step, rows.env]
    action = rollout.action[rows.step, rows.env]
    scores, value = network.judged(history, rows.target, rows.rows_per_scene)
    log_pi = torch.log_softmax(scores, 1).gather(1, action[:, None])[:, 0]
    ratio = (log_pi - log_prob[rows.step, rows.env]).exp()
    reward = _reward(rollout, rows, navigation) * reward_scale
    shape = (len(rollout.action), len(rollout.target_after) * (int(rows.slot.max()) + 1))
    column = rows.env * (shape[1] // len(rollout.target_after)) + rows.slot

    def dense(values: Tensor) -> Tensor:
        """(R,) values in a (T, N * J) table of zeros."""
        table = torch.zeros(shape, dtype=values.dtype, device=values.device)
        table[rows.step, column] = values
        return table

    value_target, advantage = vtrace(
        dense(reward),
        dense(discount * (~rows.hit)),
        dense(value),
        dense(ratio),
        dense(torch.ones_like(rows.hit)),
        trace_lambda,
    )
    picked = rows.step, column
    return Batch(history, rows.target, action, log_pi, advantage[picked], value_target[picked], rows.rows_per_scene)


def _reward(rollout: Rollout, rows: Segments, navigation: Navigation) -> Tensor:
    """(R,) the reward each step would have earned with the target passed by."""
    here = navigation.world.pose(rollout.history[rows.step, rows.env, -1])
    action = rollout.action[rows.step, rows.env]
    return navigation.earned(here, action, rows.hit)
