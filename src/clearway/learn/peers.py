"""The workers that train one agent together, and what they tell each other, by `torch.distributed`.

Every worker calls the same methods in the same order; each call waits for the others. A worker alone is told what it
told, and nothing is sent.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor


class LostPeer(Exception):
    """Another worker has ended, or does not answer."""


class Peers:
    """The workers, seen from one of them.

    Args:
        group: the process group; None: this worker is alone.
        device: where tensors lie that the group's backend can send.
        name: where this worker is found, for people.
        patient: the same workers' group that waits longer, used until all are `ready`; None: there is no other.

    Attributes:
        rank: number of this worker, from 0.
        count: number of workers.
        messages: how many so far.
        sent_bytes: what was given to be sent so far, once a message, however the backend sends it.
        waited_s: seconds spent on it so far, those of waiting for the others among them.
    """

    def __init__(
        self,
        group: Any | None = None,
        device: torch.device | str = "cpu",
        name: str = "here",
        patient: Any | None = None,
    ) -> None:
        self.group, self.device, self.name = group, torch.device(device), name
        self._used = patient or group
        self.rank: int = 0 if group is None else group.rank()
        self.count: int = 1 if group is None else group.size()
        self.messages, self.sent_bytes, self.waited_s = 0, 0, 0.0

    @property
    def leads(self) -> bool:
        """This worker writes files and tells the user."""
        return self.rank == 0

    def ready(self) -> None:
        """Wait until all have read what they learn from; who does not answer from now on is soon lost."""
        self.told(0.0)
        self._used = self.group

    def add_up(self, *tensors: Tensor, sent_as: torch.dtype | None = None) -> None:
        """Replace tensors of one dtype, in place, by their sums over all workers, as one message.

        Args:
            tensors: of the same shapes at every worker.
            sent_as: dtype in which they are sent and added up; None: their own.
        """
        if self.count == 1:
            return
        flat = tensors[0] if len(tensors) == 1 else torch.cat([tensor.flatten() for tensor in tensors])
        flat = flat.to(sent_as or flat.dtype)
        self._exchange(flat, lambda: self._group.allreduce([flat]))
        if flat is not tensors[0]:
            for tensor, summed in zip(tensors, flat.split([tensor.numel() for tensor in tensors]), strict=True):
                tensor.copy_(summed.view_as(tensor))

    def told(self, *numbers: float) -> list[list[float]]:
        """Some numbers of every worker, in their order."""
        if self.count == 1:
            return [list(numbers)]
        own = torch.tensor(numbers, dtype=torch.float64, device=self.device)
        all_numbers = [torch.empty_like(own) for _ in range(self.count)]
        self._exchange(own, lambda: self._group.allgather([all_numbers], [own]))
        return [theirs.tolist() for theirs in all_numbers]

    def any(self, *flags: bool) -> list[bool]:
        """For each flag, whether it is set at any worker."""
        return [any(theirs) for theirs in zip(*self.told(*flags), strict=True)]

    def variances(self, *values: Tensor) -> list[Tensor]:
        """The variance of each kind of values, all workers' together, scalars; without Bessel's correction."""
        if self.count == 1:
            return [each.var(correction=0) for each in values]
        counts = torch.tensor([each.numel() for each in values], dtype=torch.float64, device=self.device)
        sums = torch.stack([each.double().sum() for each in values])
        self.add_up(counts, sums)
        means = (sums / counts).unbind()
        squares = torch.stack([(each.double() - mean).square().sum() for each, mean in zip(values, means, strict=True)])
        self.add_up(squares)
        return list((squares / counts).to(values[0].dtype).unbind())

    def from_leader(self, tensor: Tensor) -> Tensor:
        """The leader's tensor, written to those of the others, of the same shape and dtype."""
        if self.count > 1:
            self._exchange(tensor, lambda: self._group.broadcast(tensor, 0))
        return tensor

    def joined(self, rows: Tensor) -> Tensor:
        """The rows (B, ...) of all workers, one's after the other's, at the leader; none elsewhere."""
        if self.count == 1:
            return rows
        own = rows.contiguous()
        counts = [int(count) for [count] in self.told(len(own))]
        if not self.leads:
            if len(own):
                self._exchange(own, lambda: self._group.send([own], 0, 0))
            return own[:0]
        whole = own.new_empty(sum(counts), *own.shape[1:])
        parts = whole.split(counts)
        parts[0].copy_(own)
        for rank, part in enumerate(parts[1:], start=1):
            if len(part):
                self._exchange(part, lambda part=part, rank=rank: self._group.recv([part], rank, 0))  # type: ignore[misc]
        return whole

    @property
    def _group(self) -> Any:
        assert self._used is not None
        return self._used

    def _exchange(self, message: Tensor, begin: Callable[[], Any]) -> None:
        """Wait for a message.

        Raises:
            LostPeer: a worker has ended, or has not answered in time.
        """
        started = time.monotonic()
        try:
            begin().wait()
        except RuntimeError as error:  # of whatever backend
            raise LostPeer(f"worker {self.rank}: {str(error).splitlines()[0]}") from error
        self.messages += 1
        self.sent_bytes += message.numel() * message.element_size()
        self.waited_s += time.monotonic() - started


ALONE = Peers()


def divided(sizes: Sequence[int], parts: int) -> list[int]:
    """Where things in a row are cut into parts of nearly equal size, none of them empty.

    Args:
        sizes: of the things, as many as there are parts at least.
        parts: how many.

    Returns:
        The number of the first thing of every part, and at the end that of things.
    """
    total, cuts, before, upto = sum(sizes), [0], 0, 0
    for part in range(1, parts):
        least, most = cuts[-1] + 1, len(sizes) - (parts - part)
        while upto < most and (upto < least or before + sizes[upto] / 2 <= total * part / parts):
            before += sizes[upto]
            upto += 1
        cuts.append(upto)
    return [*cuts, len(sizes)]
