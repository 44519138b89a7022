"""Light, colour and noise of pictures that are learnt from."""

import numpy as np
import pytest
import torch

from clearway.perception.eyes import MEAN, STD
from clearway.pretraining.augment import COLOUR, LIGHT, NOISE, chances, relit, standardised

CPU = torch.device("cpu")
GREY = torch.full((64, 24, 32, 3), 100, dtype=torch.uint8)


def test_each_picture_has_a_light_a_colour_and_noise_of_its_own() -> None:
    levels = relit(GREY, chances([3, 5], CPU))
    assert levels.dtype == torch.float32 and levels.shape == GREY.shape
    bright = levels.mean((1, 2)) / 100  # (64, 3)
    light = bright.mean(1)
    assert light.min() > 1 - LIGHT - 0.1 and light.max() < 1 + LIGHT + 0.1
    assert light.min() < 1 - LIGHT / 2 and light.max() > 1 + LIGHT / 2
    colour = bright / light[:, None]
    assert 0.02 < (colour - 1).abs().max() < 2 * COLOUR
    noise = levels.std((1, 2)).mean(1)
    assert noise.max() < NOISE + 2 and noise.max() > NOISE / 2 and noise.min() < NOISE / 4


def test_levels_stay_within_those_of_a_picture() -> None:
    for level in (0, 255):
        levels = relit(torch.full_like(GREY, level), chances([0], CPU))
        assert levels.min() >= 0 and levels.max() <= 255 and levels.std() > 1


def test_chances_follow_from_their_numbers() -> None:
    first, again, other = (relit(GREY, chances(numbers, CPU)) for numbers in ([1, 2], [1, 2], [2, 1]))
    assert torch.equal(first, again) and not torch.allclose(first, other, atol=1)


def test_the_network_gets_what_it_was_made_for() -> None:
    levels = torch.tensor([0.0, 255.0, 51.0]).expand(1, 2, 4, 3)
    wanted = [(value - mean) / std for value, mean, std in zip((0.0, 1.0, 0.2), MEAN, STD, strict=True)]
    found = standardised(levels)
    assert found.shape == (1, 3, 2, 4)
    assert found[0, :, 1, 3].numpy() == pytest.approx(np.array(wanted), abs=1e-5)
