"""The time of day in a room: what comes in through its windows, and what is seen through them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.rooms.textures import Colour


@dataclass(frozen=True)
class Daytime:
    """The light outside, beside that of noon, which is 1.

    Attributes:
        name: what it is called.
        sky: of the sky, red, green, blue.
        sun: of the sun; 0 where it does not shine.
        height: of the sun over the horizon, as its rays' rise.
        view: what the view through a window is multiplied with.
        exposure: how bright pictures are.
        share: of the rooms that have it.
    """

    name: str
    sky: Colour = (1.0, 1.0, 1.0)
    sun: Colour = (1.0, 1.0, 1.0)
    height: float = 0.8
    view: Colour = (1.0, 1.0, 1.0)
    exposure: float = 1.0
    share: float = 0.0

    @property
    def brightness(self) -> float:
        """Of the sky, beside that of noon."""
        return float(np.mean(self.sky))

    def seen(self, picture: np.ndarray) -> np.ndarray:
        """A view through a window, (height, width, 3) in [0, 1], at this time."""
        return np.clip(picture * np.array(self.view), 0, 1)


NOON = Daytime("noon")
DAYTIMES = (
    Daytime("noon", sun=(0.7, 0.7, 0.7), share=0.3),
    Daytime("morning", (0.95, 0.98, 1.05), (0.72, 0.63, 0.46), 0.5, (1.0, 0.97, 0.9), share=0.2),
    Daytime("overcast", (1.15, 1.16, 1.2), (0.0, 0.0, 0.0), 0.8, (0.72, 0.74, 0.78), 0.94, share=0.2),
    Daytime("evening", (0.75, 0.6, 0.48), (0.75, 0.42, 0.2), 0.33, (0.95, 0.68, 0.48), 0.92, share=0.17),
    Daytime("night", (0.04, 0.05, 0.09), (0.0, 0.0, 0.0), 0.8, (0.07, 0.09, 0.16), 0.86, share=0.13),
)
"""Those that a room's seed chooses from."""


def draw_daytime(rng: np.random.Generator) -> Daytime:
    """One of `DAYTIMES`, by their shares."""
    return DAYTIMES[int(rng.choice(len(DAYTIMES), p=[daytime.share for daytime in DAYTIMES]))]
