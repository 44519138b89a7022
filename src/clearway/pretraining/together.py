"""One batch of pictures, learnt from by several workers: each has a part of it, and the update is that of the whole.

A worker's loss is its pictures' part of the whole batch's; gradients are added up. What depends on all pictures at once
is told to all: the statistics of batch normalisation, and descriptions, each of which is told from all others.

Axes: B pictures of a batch, C channels.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn

from clearway.errors import ArgumentError
from clearway.learn.peers import Peers, divided
from clearway.pretraining.settings import PretrainSettings


def own_pictures(settings: PretrainSettings, peers: Peers) -> slice:
    """Which pictures of every batch are this worker's: whole groups, which are compared among themselves."""
    group = 2 * settings.together
    check_groups(settings, peers.count)
    cuts = divided([1] * (settings.batch // group), peers.count)
    return slice(cuts[peers.rank] * group, cuts[peers.rank + 1] * group)


def check_groups(settings: PretrainSettings, workers: int) -> None:
    """Raises ArgumentError where a batch has no group of pictures for each worker."""
    groups = settings.batch // (2 * settings.together)
    if workers > groups:
        raise ArgumentError(f"workers={workers}: a batch has {groups} groups of pictures, one a worker. Give fewer")


def share_batch_norms(network: nn.Module, peers: Peers, pictures: int) -> None:
    """Have every batch normalisation of a network, while it trains, go by all workers' pictures, so many together."""
    for name, child in network.named_children():
        if isinstance(child, nn.BatchNorm2d):
            setattr(network, name, _SharedBatchNorm.of(child, peers, pictures))
        else:
            share_batch_norms(child, peers, pictures)


def all_rows(own: Tensor, part: slice, count: int, peers: Peers) -> Tensor:
    """The rows (count, ...) of all workers; gradients reach this one's own, which are `part` of them."""
    if peers.count == 1:
        return own
    whole = own.new_zeros(count, *own.shape[1:])
    whole[part] = own.detach()
    peers.add_up(whole)
    return torch.cat([whole[: part.start], own, whole[part.stop :]])


class _SharedBatchNorm(nn.BatchNorm2d):
    """Batch normalisation by the mean and variance of all workers' pictures (Ioffe and Szegedy, ICML 2015)."""

    peers: Peers
    pictures: int

    @classmethod
    def of(cls, own: nn.BatchNorm2d, peers: Peers, pictures: int) -> _SharedBatchNorm:
        """The same layer, with the same parameters and buffers."""
        layer = cls(own.num_features, own.eps, own.momentum)
        layer.weight, layer.bias = own.weight, own.bias
        for name, buffer in own.named_buffers():
            setattr(layer, name, buffer)
        layer.peers, layer.pictures = peers, pictures
        return layer.train(own.training)

    def forward(self, x: Tensor) -> Tensor:
        """(B, C, height, width) normalised."""
        if not self.training:
            return super().forward(x)
        assert self.running_mean is not None and self.running_var is not None and self.momentum is not None
        wide = x.to(torch.promote_types(x.dtype, self.weight.dtype))
        numbers = self.pictures * x.shape[2] * x.shape[3]
        mean = _AddedUp.apply(wide.sum((0, 2, 3)), self.peers) / numbers
        away = wide - mean[:, None, None]
        variance = _AddedUp.apply(away.square().sum((0, 2, 3)), self.peers) / numbers
        with torch.no_grad():
            self.running_mean.lerp_(mean, self.momentum)
            self.running_var.lerp_(variance * (numbers / (numbers - 1)), self.momentum)
            if self.num_batches_tracked is not None:
                self.num_batches_tracked += 1
        scale = self.weight * (variance + self.eps).rsqrt()
        return (away * scale[:, None, None] + self.bias[:, None, None]).to(x.dtype)


class _AddedUp(torch.autograd.Function):
    """The sum of a tensor over all workers; so are its gradients."""

    @staticmethod
    def forward(context: Any, own: Tensor, peers: Peers) -> Tensor:
        context.peers = peers
        return _added_up(own, peers)

    @staticmethod
    def backward(context: Any, *gradients: Tensor) -> tuple[Tensor, None]:
        return _added_up(gradients[0], context.peers), None


def _added_up(own: Tensor, peers: Peers) -> Tensor:
    whole = own.detach().clone(memory_format=torch.contiguous_format)
    peers.add_up(whole)
    return whole
