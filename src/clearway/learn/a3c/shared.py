"""Tensors in memory that several processes share, without names that could be left behind.

The memory is an anonymous file that every process maps: it vanishes with the last process that holds it, however that
one ends, and it does not count against the size of /dev/shm, which containers keep small.
"""

from __future__ import annotations

import math
import mmap
import os
import tempfile
import weakref
from collections.abc import Iterator, Mapping
from multiprocessing.reduction import DupFd
from typing import Any

import torch
from torch import Tensor

from clearway.errors import RunError

ALIGNMENT = 64  # bytes, a cache line
Layout = dict[str, tuple[tuple[int, ...], torch.dtype]]


class SharedTensors(Mapping[str, Tensor]):
    """Named tensors in shared memory; given to a new process, they are the same memory there.

    Args:
        layout: shape and dtype of each tensor.
        handle: file descriptor of the memory, owned from here on.
    """

    def __init__(self, layout: Layout, handle: int) -> None:
        self._layout, self._handle = layout, handle
        weakref.finalize(self, os.close, handle)
        memory = mmap.mmap(handle, _total_bytes(layout))
        self._tensors: dict[str, Tensor] = {}
        first = 0
        for name, (shape, dtype) in layout.items():
            flat = torch.frombuffer(memory, dtype=dtype, count=math.prod(shape), offset=first)
            self._tensors[name] = flat.view(shape)
            first += _aligned_bytes(shape, dtype)

    @classmethod
    def holding(cls, tensors: Mapping[str, Tensor]) -> SharedTensors:
        """New shared memory with copies of some tensors, none of them empty.

        Raises:
            RunError: there is not enough memory.
        """
        layout = {name: (tuple(tensor.shape), tensor.dtype) for name, tensor in tensors.items()}
        shared = cls(layout, _anonymous_file(_total_bytes(layout)))
        for name, tensor in tensors.items():
            shared[name].copy_(tensor)
        return shared

    def __getitem__(self, name: str) -> Tensor:
        """The tensor of that name; what is written to it is seen by all processes."""
        return self._tensors[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._tensors)

    def __len__(self) -> int:
        return len(self._tensors)

    def __reduce__(self) -> tuple[Any, ...]:
        return _attached, (self._layout, DupFd(self._handle))


def _attached(layout: Layout, handle: Any) -> SharedTensors:
    return SharedTensors(layout, handle.detach())


def _anonymous_file(size_bytes: int) -> int:
    """File descriptor of a new file without a name, in memory where the system can, its space set aside."""
    handle = -1
    try:
        if hasattr(os, "memfd_create"):
            handle = os.memfd_create("clearway-a3c")
        else:
            with tempfile.TemporaryFile() as file:
                handle = os.dup(file.fileno())
        if hasattr(os, "posix_fallocate"):  # a full file system is an error here, not a bus error later
            os.posix_fallocate(handle, 0, size_bytes)
        else:
            os.ftruncate(handle, size_bytes)
    except OSError as error:
        if handle >= 0:
            os.close(handle)
        size = f"{size_bytes / 1e6:,.0f} MB"
        raise RunError(f"no {size} of memory for a3c's processes to share ({error}). Free some memory") from error
    return handle


def _aligned_bytes(shape: tuple[int, ...], dtype: torch.dtype) -> int:
    return -(-math.prod(shape) * dtype.itemsize // ALIGNMENT) * ALIGNMENT


def _total_bytes(layout: Layout) -> int:
    return sum(_aligned_bytes(shape, dtype) for shape, dtype in layout.values())
