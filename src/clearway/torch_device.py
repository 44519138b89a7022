"""The device that torch computes on, by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from clearway.errors import RunError

if TYPE_CHECKING:
    import torch


def usable_device(name: str) -> torch.device:
    """The torch device of that name, for example "cpu" or "cuda".

    Raises:
        RunError: there is none on this machine.
    """
    import torch

    try:
        device = torch.device(name)
        torch.zeros(1, device=device).item()
    except (RuntimeError, AssertionError) as error:  # torch without CUDA asserts
        reason = str(error).splitlines()[0]
        raise RunError(f"device {name}: cannot be used here ({reason}). Give another --device, such as cpu") from error
    return device
