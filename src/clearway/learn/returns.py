"""Returns and advantages as pure functions.

Arrays are (T, N): row t belongs to step t. `discount_t` is the discount after step t: 0 where the episode ended there.
`values` V(s_t) come before the step; `value_after` V(s_T) belongs to the pose after the last step.
"""

from __future__ import annotations

import torch
from torch import Tensor


def generalised_advantages(
    reward_t: Tensor, discount_t: Tensor, value_t: Tensor, value_after: Tensor, gae_lambda: float
) -> Tensor:
    """Generalised advantage estimates, (T, N) (Schulman et al., 2016, equation 16).

        delta_t = r_t + discount_t V(s_{t+1}) - V(s_t);   A_t = delta_t + discount_t lambda A_{t+1}

    With gae_lambda 1 they are n-step returns minus the value.

    Args:
        reward_t, discount_t, value_t: (T, N).
        value_after: (N,).
        gae_lambda: in [0, 1].
    """
    advantage = torch.empty_like(reward_t)
    running = torch.zeros_like(value_after)
    value_next = value_after
    for t in range(len(reward_t) - 1, -1, -1):
        delta = reward_t[t] + discount_t[t] * value_next - value_t[t]
        running = delta + discount_t[t] * gae_lambda * running
        advantage[t] = running
        value_next = value_t[t]
    return advantage


def vtrace(
    reward_t: Tensor,
    discount_t: Tensor,
    value_t: Tensor,
    ratio_t: Tensor,
    used_t: Tensor,
    trace_lambda: float,
) -> tuple[Tensor, Tensor]:
    """V-trace targets and advantages for segments that another policy acted out (Espeholt et al., 2018, equation 1).

        rho_t = min(1, ratio_t);  delta_t = rho_t (r_t + discount_t V(s_{t+1}) - V(s_t))
        v_t - V(s_t) = delta_t + discount_t lambda rho_t (v_{t+1} - V(s_{t+1}))
        A_t = rho_t (r_t + discount_t v_{t+1} - V(s_t))

    Every segment must end in a step with discount 0, so that nothing after it counts.

    Args:
        reward_t, discount_t, value_t, ratio_t: (T, N); ratio is the learner's probability over the actor's.
        used_t: (T, N) bool, steps that belong to a segment.
        trace_lambda: in [0, 1].

    Returns:
        Value targets v_t and advantages A_t, (T, N) each; meaningless where not used.
    """
    rho = ratio_t.clamp(max=1.0)
    target, advantage = torch.zeros_like(value_t), torch.zeros_like(value_t)
    correction = torch.zeros_like(value_t[0])
    value_next, target_next = torch.zeros_like(value_t[0]), torch.zeros_like(value_t[0])
    for t in range(len(reward_t) - 1, -1, -1):
        delta = rho[t] * (reward_t[t] + discount_t[t] * value_next - value_t[t])
        correction = torch.where(used_t[t], delta + discount_t[t] * trace_lambda * rho[t] * correction, 0.0)
        advantage[t] = rho[t] * (reward_t[t] + discount_t[t] * target_next - value_t[t])
        target[t] = value_t[t] + correction
        value_next, target_next = value_t[t], target[t]
    return target, advantage
