"""Light, colour and noise of pictures, drawn anew each time that a picture is learnt from."""

from __future__ import annotations

import numpy as np

from clearway.perception.eyes import MEAN, STD

LIGHT, COLOUR, NOISE = 0.35, 0.06, 14.0
"""Brightness and each colour by up to so many shares, noise of up to so many grey levels' standard deviation: a little
more than `live.conditions.REFERENCE`, which agents are tried under."""


def relit(pictures: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Pictures (B, height, width, 3) uint8 under another light each, with noise, float32 grey levels from 0 to 255."""
    count = len(pictures)
    light = 1 + LIGHT * rng.uniform(-1, 1, (count, 1, 1, 1)).astype(np.float32)
    colour = 1 + COLOUR * rng.uniform(-1, 1, (count, 1, 1, 3)).astype(np.float32)
    noise = NOISE * rng.random((count, 1, 1, 1), np.float32)
    levels = pictures * (light * colour)
    levels += noise * rng.standard_normal(pictures.shape, np.float32)
    return np.clip(levels, 0, 255, out=levels)


def standardised(levels: np.ndarray) -> np.ndarray:
    """The network's input (B, 3, height, width) float32, in memory as the pictures are, of levels (B, h, w, 3)."""
    mean, std = np.array(MEAN, np.float32), np.array(STD, np.float32)
    return ((levels / np.float32(255) - mean) / std).transpose(0, 3, 1, 2)
