"""The chances of an episode: a generator for each kind, so that no perturbation changes what another draws."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from clearway.live.conditions import Perturbations

FURNITURE, OBSTACLE, MOVES, TURNS, HEIGHTS, PITCHES, LIGHT, PIXELS, ENDS = range(9)


@dataclass(frozen=True)
class Draws:
    """The chances of an episode.

    Attributes:
        seed: of the episode, any int64.
        perturbations: how strong they are.
    """

    seed: int
    perturbations: Perturbations

    def generator(self, kind: int) -> np.random.Generator:
        """A fresh generator for a kind of chance."""
        return np.random.default_rng([self.seed % 2**64, kind])

    @cached_property
    def _generators(self) -> dict[int, np.random.Generator]:
        return {kind: self.generator(kind) for kind in (MOVES, TURNS, HEIGHTS, PITCHES, PIXELS)}

    @cached_property
    def brightness(self) -> float:
        """Factor on the light, the same for the whole episode."""
        return 1 + self.perturbations.light * self.generator(LIGHT).uniform(-1, 1)

    def _normal(self, kind: int, deviation: float) -> float:
        return deviation * float(self._generators[kind].standard_normal()) if deviation else 0.0

    def distance_error_m(self) -> float:
        """What a move is too long by."""
        return self._normal(MOVES, self.perturbations.distance_noise)

    def angle_error_deg(self) -> float:
        """What a turn is too far by."""
        return self._normal(TURNS, self.perturbations.angle_noise)

    def height_error_m(self) -> float:
        """What the camera is too high by in the next picture."""
        return self._normal(HEIGHTS, self.perturbations.camera_height_jitter)

    def pitch_error_deg(self) -> float:
        """What the camera looks too far up by in the next picture."""
        return self._normal(PITCHES, self.perturbations.camera_pitch_jitter)

    def seen(self, picture: np.ndarray) -> np.ndarray:
        """A picture (height, width, 3) uint8 under the episode's light, with the noise of the sensor."""
        noise = self.perturbations.pixel_noise
        if self.brightness == 1 and not noise:
            return picture
        levels = picture * np.float32(self.brightness)
        if noise:
            levels += np.float32(noise) * self._generators[PIXELS].standard_normal(picture.shape, np.float32)
        return np.clip(np.rint(levels), 0, 255).astype(np.uint8)
