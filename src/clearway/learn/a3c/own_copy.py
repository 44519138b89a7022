"""A process's own copy of the parameters: forward pass for its workers' segments, and the way back to low-rank factors.

The function is that of `model.network`; only what five steps of a few workers need is computed. A history is a window
on the trail of poses that a worker has come along, so a pose enters the first layer once in every slot that a history
of the segment shows it in, and never as a copied 8,192-vector.

Axis letters: R workers (ordered by scene), T steps, K history, H width, F features, P = K + T poses of a trail,
C scenes, A actions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from clearway.model.network import OUTPUTS, NetworkShape


@dataclass(frozen=True)
class Factors:
    """Every worker's gradient as products of thin matrices: that of a weight is left^T right, summed over rows.

    Attributes:
        siamese: (R, T + 1, H), with respect to the first layer's sums: T steps, then the target.
        fusion, term: (R, T, H) and (R, 1, H), left factors of the observation's and the target's half.
        scene: (R, T, H), left factor of the scene's own layer.
        output: (R, T, A + 1), left factor of the outputs.
        seen, wanted, fused, special: right factors of fusion, term, scene and output, shaped like these (H last).
    """

    siamese: Tensor
    fusion: Tensor
    term: Tensor
    scene: Tensor
    output: Tensor
    seen: Tensor
    wanted: Tensor
    fused: Tensor
    special: Tensor


class LocalNetwork:
    """A copy of the parameters, and the activations of R workers' segments under it.

    Args:
        shape: of the network.
        features: (S, F), prepared features of all states, in any store.
        rows_per_scene: number of workers in each scene, in order.
        steps: T.
    """

    def __init__(self, shape: NetworkShape, features: Tensor, rows_per_scene: list[int], steps: int) -> None:
        self.features, self.steps = features, steps
        self.history_length, self.width = shape.history_length, shape.width
        self.siamese = torch.empty(shape.history_length, shape.width, shape.feature_count)  # newest slot first
        self.copied: dict[str, Tensor] = {}
        self.heads = _head_rows(rows_per_scene)
        workers = sum(rows_per_scene)
        self.trail_features = torch.zeros(workers, self.history_length + steps + 1, shape.feature_count)
        self.seen, self.fused, self.special = torch.zeros(3, workers, steps + 1, self.width).unbind(0)
        self.output = torch.empty(workers, steps + 1, OUTPUTS)

    def copy(self, parameters: Mapping[str, Tensor]) -> None:
        """Take the shared parameters as they are now; heads of other scenes are left out."""
        for slot in range(self.history_length):
            self.siamese[self.history_length - 1 - slot].copy_(parameters["siamese_weight"][slot])
        for name in ("siamese_bias", "fusion_weight", "fusion_bias"):
            self.copied[name] = parameters[name].clone()
        for name in ("scene_weight", "scene_bias", "output_weight", "output_bias"):
            for scene, _ in self.heads:
                self.copied[f"{name}.{scene}"] = parameters[name][scene].clone()

    def begin(self, history: Tensor, target_state: Tensor) -> None:
        """Start segments from histories (R, K) int64 to poses (R,) int64; then `output_at(0)` may be asked for."""
        slots, most = self.history_length, self.steps + 1
        self.trail_features[:, :slots] = self.features[history]
        self.trail_features[:, -1] = self.features[target_state]
        self.seen.copy_(self.copied["siamese_bias"].expand_as(self.seen))
        wanted = self.copied["siamese_bias"].repeat(len(history), 1)
        for slot in range(slots):
            count = min(slots - slot, most)  # histories of the segment that show an old pose in this slot
            poses = self.trail_features[:, slot : slot + count].flatten(0, 1)
            rows = torch.cat([poses, self.trail_features[:, -1]])
            projected = _projected(rows, self.siamese[slots - 1 - slot])
            self.seen[:, :count] += projected[: len(poses)].view(len(history), count, self.width)
            wanted += projected[len(poses) :]
        self.wanted = wanted.relu_()
        self.term = torch.addmm(self.copied["fusion_bias"], self.wanted, self.copied["fusion_weight"][1].T)

    def arrive(self, step: int, state: Tensor) -> None:
        """Add the poses (R,) int64 that step number `step` (1 to T) led to."""
        features = self.features[state].float()
        self.trail_features[:, self.history_length + step - 1] = features
        count = min(self.history_length, self.steps + 1 - step)  # histories of the segment that show it
        projected = _projected(features, self.siamese[:count].flatten(0, 1))
        self.seen[:, step : step + count] += projected.view(len(state), count, self.width)

    def output_at(self, step: int) -> Tensor:
        """(R, A + 1) action scores and value after `step` steps."""
        seen, fused = self.seen[:, step], self.fused[:, step]
        seen.relu_()
        fused.copy_(torch.addmm(self.term, seen, self.copied["fusion_weight"][0].T).relu_())
        for scene, rows in self.heads:
            weight, bias = self.copied[f"scene_weight.{scene}"], self.copied[f"scene_bias.{scene}"]
            self.special[rows, step] = torch.addmm(bias, fused[rows], weight.T).relu_()
            weight, bias = self.copied[f"output_weight.{scene}"], self.copied[f"output_bias.{scene}"]
            self.output[rows, step] = torch.addmm(bias, self.special[rows, step], weight.T)
        return self.output[:, step]

    def backward(self, grad_output: Tensor) -> Factors:
        """Factors of every worker's gradients from those of the outputs (R, T, A + 1), 0 for steps not taken."""
        steps = slice(0, self.steps)
        grad_special, grad_fused = torch.empty_like(self.special[:, steps]), torch.empty_like(self.fused[:, steps])
        for scene, rows in self.heads:
            grad_special[rows] = grad_output[rows] @ self.copied[f"output_weight.{scene}"]
            grad_special[rows] *= self.special[rows, steps] > 0
            grad_fused[rows] = grad_special[rows] @ self.copied[f"scene_weight.{scene}"]
        grad_fused *= self.fused[:, steps] > 0
        grad_term = grad_fused.sum(1, keepdim=True)
        grad_seen = (grad_fused @ self.copied["fusion_weight"][0]) * (self.seen[:, steps] > 0)
        wanted = self.wanted[:, None]
        grad_wanted = (grad_term @ self.copied["fusion_weight"][1]) * (wanted > 0)
        return Factors(
            siamese=torch.cat([grad_seen, grad_wanted], 1),
            fusion=grad_fused,
            term=grad_term,
            scene=grad_special,
            output=grad_output,
            seen=self.seen[:, steps],
            wanted=wanted,
            fused=self.fused[:, steps],
            special=self.special[:, steps],
        )


def _head_rows(rows_per_scene: list[int]) -> list[tuple[int, slice]]:
    """Each scene that has workers, and which rows these are."""
    found, first = [], 0
    for scene, count in enumerate(rows_per_scene):
        if count:
            found.append((scene, slice(first, first + count)))
        first += count
    return found


def _projected(rows: Tensor, weight: Tensor) -> Tensor:
    """(B, O) product of rows (B, F) and weight^T, weight (O, F)."""
    return torch.mm(weight, rows.T.contiguous()).T  # the fastest order for few rows
