"""The siamese actor-critic computed from tables: same outputs, same gradients, a fraction of the operations.

Features are frozen and states finite, so the first layer needs no picture twice:

    W_k f(s)             one matrix product of the states' features an update, then K rows are summed per sample;
    target branch        one row a target (M of them, or those that occur), not one a sample;
    observation branch   one row a history (U of them), where samples share them;
    dL/dW_k              gradients are added up by state (S, H), then multiplied with the features once; several
                         batches may be added up before that, as long as W_k stays what it is.

The first layer is computed of all states, or in large worlds, and for small batches, of those that occur:
`first_layer`.

Nothing is approximated, apart from rounding, see `LookupNetwork`. Gradients are written by hand into `.grad`; the tests
hold them against autograd on `network`.

Axis letters: B rows, U histories, K history, S states, F features, H width, M targets, C scenes, A actions.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from itertools import accumulate

import torch
from torch import Tensor

from clearway.model.first_layer import AllStates, FirstLayer, VisitedStates
from clearway.model.network import OUTPUTS, SiameseActorCritic, grad_of
from clearway.model.padding import Padding, row_step
from clearway.model.sums import add_up, counted, multiply, sum_ascending, sum_listed
from clearway.scenes.actions import ACTION_COUNT
from clearway.world.feature_store import FEW_STATES

FEW_TARGETS = 1_024  # up to so many, the target branch is computed of all, beyond of those that occur


def _relu_backward_(grad: Tensor, result: Tensor) -> Tensor:
    """Set to 0, in place, the gradient (B, H) where ReLU's result (B, H) is 0."""
    return torch.ops.aten.threshold_backward.grad_input(grad, result, 0, grad_input=grad)


@dataclass(frozen=True)
class Activations:
    """What the forward pass leaves for the backward pass; rows are ordered by scene.

    Attributes:
        seen: (U, H) observation branch after ReLU; B = U where rows share no history.
        fused: (B, H).
        special: (B, H) the scene layer.
        output: (B, A + 1) action scores and value; in the parameters' dtype, the others in the network's.
    """

    seen: Tensor
    fused: Tensor
    special: Tensor
    output: Tensor

    @property
    def scores(self) -> Tensor:
        """(B, A) action scores before the softmax."""
        return self.output[:, :ACTION_COUNT]

    @property
    def value(self) -> Tensor:
        """(B,)."""
        return self.output[:, ACTION_COUNT]

    @classmethod
    def empty(
        cls,
        rows: int,
        width: int,
        device: torch.device,
        histories: int | None = None,
        dtype: torch.dtype | None = None,
    ) -> Activations:
        """Memory for `rows` rows, of as many histories by default; `dtype` is that of all but the output."""
        seen = torch.empty(rows if histories is None else histories, width, device=device, dtype=dtype)
        fused, special = (torch.empty(rows, width, device=device, dtype=dtype) for _ in range(2))
        return cls(seen, fused, special, torch.empty(rows, OUTPUTS, device=device))

    def by_step(self, steps: int) -> list[Activations]:
        """Views of each step's rows, where rows hold so many steps of every environment together."""
        parts = {name: rows.unflatten(0, (-1, steps)).unbind(1) for name, rows in vars(self).items()}
        return [Activations(**{name: part[step] for name, part in parts.items()}) for step in range(steps)]


def projects_all(states: int, most_seen: int | None, device: torch.device) -> bool:
    """Whether the first layer is computed of all states, or of those that occur, of which there are `most_seen`.

    On a GPU all of them, unless they are many: it would have to wait until the host knows which occur.
    """
    if device.type != "cpu" or most_seen is None:
        return states <= FEW_STATES
    return states <= min(FEW_STATES, most_seen)


class LookupNetwork:
    """`SiameseActorCritic` on the states of a world.

    Args:
        network: the parameters; shared, not copied. Call `refresh` after every change of them.
        features: (S, F) float32, prepared features of all states; with more than `FEW_STATES` in any store.
        target_state: (M,) int64.
        dtype: of features, activations and the factors of matrix products, the parameters' by default. What is added
            up, outputs, gradients and the parameters themselves keep the parameters'.
        most_seen: states that histories between two refreshes hold, at most; by default as many as there are.

    Attributes:
        row_step: numbers of rows are best multiples of it, see `padding`.
        batches: backward passes since `siamese_gradient` was last called.
    """

    def __init__(
        self,
        network: SiameseActorCritic,
        features: Tensor,
        target_state: Tensor,
        dtype: torch.dtype | None = None,
        most_seen: int | None = None,
    ) -> None:
        shape = network.shape
        assert features.shape[1] == shape.feature_count, "features do not fit the network"
        self.network = network
        self.width, self.history_length = shape.width, shape.history_length
        weight = network.siamese_weight.data
        self.dtype = dtype or weight.dtype
        self.row_step = row_step(self.dtype)
        layer = AllStates if projects_all(len(features), most_seen, features.device) else VisitedStates
        self.first_layer: FirstLayer = layer(weight, features, target_state, self.dtype)
        self.workspace, self.batches = torch.empty(0, self.width, device=features.device, dtype=self.dtype), 0
        self._make_room(target_state)
        for parameter in network.parameters():
            parameter.grad = torch.zeros_like(parameter)
        self.refresh()

    def for_targets(self, target_state: Tensor) -> LookupNetwork:
        """The same network with other targets (M,) int64, for forward passes: no state is projected anew."""
        other = copy(self)
        other.first_layer = self.first_layer.for_targets(target_state)
        other._make_room(target_state)
        if len(target_state) <= FEW_TARGETS:
            other._know(other.all_targets)
        return other

    def _make_room(self, target_state: Tensor) -> None:
        """Tables of the target branch, nothing known yet."""
        goals, device = len(target_state), target_state.device
        self.target_state = target_state
        self.all_targets = torch.arange(goals, device=device)
        self.known = torch.zeros(goals, dtype=torch.bool, device=device)  # whose rows below are up to date
        self.wanted = self.network.siamese_bias.new_zeros(goals, self.width)
        self.target_term = self.wanted.to(self.dtype, copy=True)  # of the fusion layer, before its ReLU

    @torch.no_grad()
    def refresh(self, siamese_weight: bool = True, few_rows: bool = True) -> None:
        """Compute the tables with the parameters as they are now.

        Args:
            siamese_weight: it has changed too.
            few_rows: forward passes of few rows follow, which transposed copies of the weights speed up.
        """
        net = self.network
        if siamese_weight:
            self.first_layer.refresh(keep=not few_rows)
        factors = (net.siamese_bias, net.fusion_weight[0], net.scene_weight, net.scene_bias, net.output_weight)
        self.siamese_bias, self.fusion_weight, self.scene_weight, self.scene_bias, self.output_weight = (
            factor.to(self.dtype) for factor in factors
        )  # the parameters themselves, where the dtype is theirs
        self.fusion_in, self.scene_in = self.fusion_weight.T, self.scene_weight.transpose(1, 2)
        if few_rows:
            self.fusion_in, self.scene_in = self.fusion_in.contiguous(), self.scene_in.contiguous()
        self.known.zero_()
        if len(self.known) <= FEW_TARGETS:
            self._know(self.all_targets)

    @torch.no_grad()
    def forward(
        self,
        history: Tensor,
        target: Tensor,
        rows_per_scene: Sequence[int],
        out: Activations | None = None,
        history_of: Tensor | None = None,
    ) -> Activations:
        """Policy and value of B rows, with all that the backward pass needs.

        Args:
            history: (U, K) int64 states, newest last.
            target: (B,) int64 index of the target.
            rows_per_scene: number of rows of each scene, in order; rows are ordered by scene.
            out: where to write; new memory by default.
            history_of: (B,) int64, ascending, the history of each row; None: every row has its own, U = B.
        """
        out = out or Activations.empty(len(target), self.width, history.device, len(history), self.dtype)
        torch.add(self.first_layer.seen(history), self.siamese_bias, out=out.seen).relu_()
        self._target_terms(target, out=out.fused)
        if history_of is None:
            out.fused.addmm_(out.seen, self.fusion_in).relu_()
        else:
            out.fused.add_((out.seen @ self.fusion_in).index_select(0, history_of)).relu_()
        self._forward_scenes(rows_per_scene, out)
        return out

    @torch.no_grad()
    def judged(self, history: Tensor, target: Tensor, rows_per_scene: Sequence[int]) -> tuple[Tensor, Tensor]:
        """Action scores (B, A) and values (B,) of rows that are not learnt from; arguments as in `forward`."""
        padding = Padding.to_multiples(self.row_step, rows_per_scene, target.device)
        kept = self.forward(history[padding.rows], target[padding.rows], padding.rows_per_scene)
        return kept.scores[padding.place], kept.value[padding.place]

    @torch.no_grad()
    def start_values(self, state: Tensor, target: Tensor, rows_per_scene: Sequence[int]) -> Tensor:
        """Values (B,) of standing in states (B,) int64 at the start of an episode; other arguments as in `forward`.

        A start's history is one pose, so the observation branch is computed once a state, not once a row.
        """
        padding = Padding.to_multiples(self.row_step, rows_per_scene, state.device)
        out = Activations.empty(len(padding.rows), self.width, state.device, dtype=self.dtype)
        sums, row = self.first_layer.starts(state)
        seen = sums.add_(self.siamese_bias).relu_()
        row, target = row[padding.rows], target[padding.rows]
        self._target_terms(target, out=out.fused).add_((seen @ self.fusion_in).index_select(0, row)).relu_()
        self._forward_scenes(padding.rows_per_scene, out)
        return out.value[padding.place]

    def _forward_scenes(self, rows_per_scene: Sequence[int], out: Activations) -> None:
        """The scenes' own layers, from `fused` on."""
        net = self.network
        parts = [(head, rows) for head, rows in self._rows_of_heads(rows_per_scene) if rows.start < rows.stop]
        for head, rows in parts:
            torch.addmm(self.scene_bias[head], out.fused[rows], self.scene_in[head], out=out.special[rows])
        special = out.special.relu_().to(out.output.dtype)
        for head, rows in parts:
            torch.addmm(net.output_bias[head], special[rows], net.output_weight[head].T, out=out.output[rows])

    @torch.no_grad()
    def backward(
        self,
        history: Tensor,
        target: Tensor,
        rows_per_scene: Sequence[int],
        kept: Activations,
        grad_output: Tensor,
        history_of: Tensor | None = None,
    ) -> None:
        """Set `.grad` from the loss's gradient with respect to the output, (B, A + 1).

        Of siamese_weight what is needed is added up, for `siamese_gradient`. Arguments as in `forward`.
        """
        net = self.network
        grad_fused, spare = self._work(2, len(target))
        self._backward_scenes(rows_per_scene, kept, grad_output, spare, grad_fused)
        _relu_backward_(grad_fused, kept.fused)
        grad_observed = grad_fused if history_of is None else sum_ascending(grad_fused, history_of, len(history))
        multiply(grad_observed.T, kept.seen, out=grad_of(net.fusion_weight)[0])
        goals = self.all_targets if len(self.known) <= FEW_TARGETS else target.unique()
        wanted = self.wanted[goals]  # (M, H) or fewer
        grad_term = self._sum_by_target(target, grad_fused)[goals].to(wanted.dtype)
        torch.sum(grad_term, 0, out=grad_of(net.fusion_bias))
        torch.mm(grad_term.T, wanted, out=grad_of(net.fusion_weight)[1])
        grad_wanted = torch.zeros_like(self.wanted)
        grad_wanted[goals] = _relu_backward_(grad_term @ net.fusion_weight[1], wanted)
        grad_seen = torch.mm(grad_observed, self.fusion_weight, out=spare[: len(history)])
        _relu_backward_(grad_seen, kept.seen)
        add_up(grad_seen, out=grad_of(net.siamese_bias)).add_(grad_wanted.sum(0))
        self.first_layer.add(history, grad_seen, grad_wanted, begin=not self.batches)
        self.batches += 1

    @torch.no_grad()
    def siamese_gradient(self) -> None:
        """Set siamese_weight's `.grad` to the mean over the backward passes since the last call."""
        gradient = grad_of(self.network.siamese_weight)
        self.first_layer.gradient(gradient)
        if self.batches > 1:
            gradient.div_(self.batches)
        self.batches = 0

    def _work(self, blocks: int, rows: int) -> list[Tensor]:
        """Memory for some (rows, H) blocks, kept between calls: fresh pages cost more than the arithmetic."""
        if len(self.workspace) < blocks * rows:
            self.workspace = self.workspace.new_empty(blocks * rows, self.width)
        return list(self.workspace[: blocks * rows].view(blocks, rows, self.width))

    def _backward_scenes(
        self,
        rows_per_scene: Sequence[int],
        kept: Activations,
        grad_output: Tensor,
        grad_special: Tensor,
        grad_fused: Tensor,
    ) -> None:
        """Gradients of the scenes' own layers; writes dL/d(special), dL/d(fused after ReLU), both (B, H)."""
        net = self.network
        for head, rows in self._rows_of_heads(rows_per_scene):
            add_up(grad_output[rows], out=grad_of(net.output_bias)[head])
            grad_out = grad_output[rows].to(self.dtype)
            multiply(grad_out.T, kept.special[rows], out=grad_of(net.output_weight)[head])
            torch.mm(grad_out, self.output_weight[head], out=grad_special[rows])
            _relu_backward_(grad_special[rows], kept.special[rows])
            multiply(grad_special[rows].T, kept.fused[rows], out=grad_of(net.scene_weight)[head])
            add_up(grad_special[rows], out=grad_of(net.scene_bias)[head])
            torch.mm(grad_special[rows], self.scene_weight[head], out=grad_fused[rows])

    def _rows_of_heads(self, rows_per_scene: Sequence[int]) -> list[tuple[int, slice]]:
        """Each head and its rows: those of its scene, or all of them."""
        counts = rows_per_scene if self.network.shape.head_count > 1 else (sum(rows_per_scene),)
        return [(head, slice(last - counts[head], last)) for head, last in enumerate(accumulate(counts))]

    def _target_terms(self, target: Tensor, out: Tensor) -> Tensor:
        """The target's part of the fusion layer, before its ReLU, for targets (B,), written to `out` (B, H)."""
        if len(self.known) > FEW_TARGETS:
            self._know(target[~self.known[target]].unique())
        return torch.index_select(self.target_term, 0, target, out=out)

    @torch.no_grad()
    def _know(self, targets: Tensor) -> None:
        """Compute the target branch of targets (U,) int64."""
        if not len(targets):
            return
        net = self.network
        wanted = self.first_layer.wanted(targets).to(self.wanted.dtype).add_(net.siamese_bias).relu_()
        self.wanted[targets] = wanted
        self.target_term[targets] = torch.addmm(net.fusion_bias, wanted, net.fusion_weight[1].T).to(self.dtype)
        self.known[targets] = True

    def _sum_by_target(self, target: Tensor, rows: Tensor) -> Tensor:
        """Rows (B, H) added up by target, (M, H)."""
        return sum_listed(rows, torch.argsort(target), counted(target, len(self.target_state)))
