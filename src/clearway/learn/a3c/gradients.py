"""Every worker's gradient in low-rank form: its norms are known, and it can be clipped, before it is ever written out.

A weight's gradient over T steps is left^T right with T rows each (T + 1 in the siamese layer, for the target). So

    |left^T right|^2 = sum((left left^T) * (right right^T)),

two small matrices instead of one of 4 million entries.

Axis letters: R workers, T steps, K history, H width, F features, A actions, P = K + T poses of a trail.
"""

from __future__ import annotations

from dataclasses import replace

import torch
from torch import Tensor

from clearway.learn.a3c.own_copy import Factors
from clearway.scenes.actions import ACTION_COUNT

POLICY, VALUE = slice(0, ACTION_COUNT), slice(ACTION_COUNT, ACTION_COUNT + 1)


def squared_norms(factors: Factors, trail_features: Tensor, history_length: int) -> dict[str, Tensor]:
    """Squared norm of every worker's gradient by tensor, (R,) float64 each.

    Policy and value are tensors of their own, as in Zhu's code.

    Args:
        factors: of the gradients.
        trail_features: (R, P + 1, F) poses of the trails, then the target.
        history_length: K.
    """
    siamese = _gram(factors.siamese)
    poses = _gram(trail_features)
    slots = [poses[:, rows][:, :, rows] for rows in window_rows(history_length, factors.fusion.shape[1])]
    fused, special = _gram(factors.fused), _gram(factors.special)
    outputs = {"policy": factors.output[..., POLICY], "value": factors.output[..., VALUE]}
    return {
        "siamese_weight": _inner(siamese, torch.stack(slots).sum(0)),
        "siamese_bias": _summed(factors.siamese),
        "fusion_weight": _inner(_gram(factors.fusion), _gram(factors.seen))
        + _inner(_gram(factors.term), _gram(factors.wanted)),
        "fusion_bias": _summed(factors.fusion),
        "scene_weight": _inner(_gram(factors.scene), fused),
        "scene_bias": _summed(factors.scene),
        **{f"{name}_weight": _inner(_gram(left), special) for name, left in outputs.items()},
        **{f"{name}_bias": _summed(left) for name, left in outputs.items()},
    }


def window_rows(history_length: int, steps: int) -> list[list[int]]:
    """For each slot of the history, the rows of a trail that T steps show in it, and the target's row."""
    target = history_length + steps
    return [[*range(slot, slot + steps), target] for slot in range(history_length)]


def clip_scales(squares: dict[str, Tensor], limit: float, each_tensor: bool) -> dict[str, Tensor]:
    """Factors (R,) float32 that scale gradients down to a norm of at most `limit`, by tensor."""
    total = torch.stack(list(squares.values())).sum(0)
    return {
        name: (limit / (own if each_tensor else total).sqrt().clamp_min(1e-12)).clamp(max=1.0).float()
        for name, own in squares.items()
    }


def clipped(factors: Factors, scales: dict[str, Tensor]) -> tuple[Factors, dict[str, Tensor]]:
    """Factors of the clipped weights' gradients, and the clipped gradients of biases and outputs, (R, ...) each."""

    def scaled(left: Tensor, name: str) -> Tensor:
        return left * scales[name][:, None, None]

    def summed(left: Tensor, name: str) -> Tensor:
        return left.sum(1) * scales[name][:, None]

    policy, value = factors.output[..., POLICY], factors.output[..., VALUE]
    weights = torch.cat([scaled(policy, "policy_weight"), scaled(value, "value_weight")], 2)
    dense = {
        "siamese_bias": summed(factors.siamese, "siamese_bias"),
        "fusion_bias": summed(factors.fusion, "fusion_bias"),
        "scene_bias": summed(factors.scene, "scene_bias"),
        "output_weight": weights.transpose(1, 2) @ factors.special,
        "output_bias": torch.cat([summed(policy, "policy_bias"), summed(value, "value_bias")], 1),
    }
    low_rank = replace(
        factors,
        siamese=scaled(factors.siamese, "siamese_weight"),
        fusion=scaled(factors.fusion, "fusion_weight"),
        term=scaled(factors.term, "fusion_weight"),
        scene=scaled(factors.scene, "scene_weight"),
    )
    return low_rank, dense


def _gram(rows: Tensor) -> Tensor:
    """Inner products of each worker's rows, (R, J, J) float64 from (R, J, N)."""
    rows = rows.double()
    return rows @ rows.transpose(1, 2)


def _summed(rows: Tensor) -> Tensor:
    """Squared norms (R,) float64 of the sums of each worker's rows, (R, J, N)."""
    return rows.double().sum(1).square().sum(1)


def _inner(left: Tensor, right: Tensor) -> Tensor:
    """Squared norms (R,) from the Gram matrices of both factors, (R, J, J) each; never negative by rounding."""
    return (left * right).sum((1, 2)).clamp_min(0)
