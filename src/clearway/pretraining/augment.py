"""Light, colour and noise of pictures, drawn anew each time that a picture is learnt from.

Where the pictures are, on a GPU or not, all is drawn and computed.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import torch
from torch import Tensor

from clearway.perception.eyes import MEAN, STD

LIGHT, COLOUR, NOISE = 0.35, 0.06, 14.0
"""Brightness and each colour by up to so many shares, noise of up to so many grey levels' standard deviation: a little
more than `live.conditions.REFERENCE`, which agents are tried under."""
WHITE = 255.0


def chances(numbers: Sequence[int], device: torch.device) -> torch.Generator:
    """Random numbers on a device that follow from whole numbers, of one kind of device always the same."""
    return torch.Generator(device).manual_seed(int(np.random.default_rng(list(numbers)).integers(2**63)))


def relit(pictures: Tensor, drawn: torch.Generator) -> Tensor:
    """Pictures (B, height, width, 3) uint8 under another light each, with noise, float32 grey levels from 0 to 255."""
    count = len(pictures)
    uniform, normal = (
        partial(draw, generator=drawn, device=pictures.device, dtype=torch.float32)
        for draw in (torch.rand, torch.randn)
    )
    light = 1 + LIGHT * (2 * uniform((count, 1, 1, 1)) - 1)
    colour = 1 + COLOUR * (2 * uniform((count, 1, 1, 3)) - 1)
    noise = NOISE * uniform((count, 1, 1, 1))
    each = normal(pictures.shape)
    return (pictures * (light * colour)).addcmul_(each, noise).clamp_(0, WHITE)


def standardised(levels: Tensor) -> Tensor:
    """The network's input (B, 3, height, width) float32, in memory as the pictures are, of levels (B, h, w, 3)."""
    mean, std = (torch.tensor(numbers, dtype=torch.float32, device=levels.device) for numbers in (MEAN, STD))
    return levels.sub(mean * WHITE).div_(std * WHITE).permute(0, 3, 1, 2)
