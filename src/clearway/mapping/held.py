"""`Held`: what an agent with a map holds to be so, on the map of the scene that it walks in, for those who watch it.

The agent itself knows a lattice alone; where the lattice lies in the scene, the one who watches has to say.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from clearway.mapping.beliefs import IMPOSSIBLE, likeliest
from clearway.mapping.lattice import HEADINGS
from clearway.mapping.search import probabilities
from clearway.scenes.scene import Scene

LEAST, MOST = 0.01, 40  # probability of a pose that is worth showing, and number of poses
TOLD = 1e-3  # a change of log-odds that says something
DIGITS = 3
ABOUT = ("here", "room", "been", "goal")  # what of an agent's state is looked at


@dataclass(frozen=True, eq=False)
class Held:
    """What is held, N cells, M and K poses.

    Attributes:
        cells: (N, 3) x and z in metres, probability that a body can stand there; cells that it was told of.
        target: (M, 4) x and z in metres, heading in degrees, probability that the target was taken there; likeliest
            first.
        here: (K, 4) likewise, that it stands there itself.
    """

    cells: np.ndarray
    target: np.ndarray
    here: np.ndarray

    def to_json(self) -> dict[str, Any]:
        """Lists of rows."""
        return {name: np.round(values.astype(float), DIGITS).tolist() for name, values in vars(self).items()}


@dataclass(frozen=True)
class Laid:
    """Where a lattice lies in a scene: around a pose.

    Attributes:
        x_m, z_m: of the lattice's middle.
        heading_deg: of its heading 0.
        cell_m: a step.
    """

    x_m: float
    z_m: float
    heading_deg: float
    cell_m: float

    @classmethod
    def around(cls, scene: Scene, state: int) -> Laid:
        """That of a walk which began in a state of a scene."""
        x_m, z_m = scene.locations_m[state].tolist()
        return cls(x_m, z_m, float(scene.headings_deg[state]), scene.cell_size_m)

    def metres(self, cells: np.ndarray) -> np.ndarray:
        """(N, 2) x and z of rows and columns (N, 2), counted from the middle."""
        turn = np.radians(self.heading_deg)
        ahead, right = np.array([np.sin(turn), np.cos(turn)]), np.array([np.cos(turn), -np.sin(turn)])
        return np.array([self.x_m, self.z_m]) + self.cell_m * (cells[:, :1] * ahead + cells[:, 1:] * right)


def held_by(state: Mapping[str, np.ndarray], laid: Laid, usual_room: float, row: int = 0) -> Held:
    """What a `MappingAgent` holds in one of the episodes of a state.

    Args:
        state: the agent's, see `Follower.begin`, and `goal` (B, 4, G, G).
        laid: where its lattice lies.
        usual_room: log-odds of cells of which it was told nothing.
        row: of the episode.
    """
    here, room, been, goal = (state[name][row] for name in ABOUT)
    middle = len(room) // 2
    told = np.argwhere(np.abs(room - usual_room) > TOLD)
    stands = 1 / (1 + np.exp(-room[tuple(told.T)]))
    missed = been.copy()
    missed[likeliest(here).index] = False  # whether it is here is for it to say
    target = probabilities(np.where(missed, IMPOSSIBLE, goal)[None], room[None])[0]
    own = np.exp(here - here.max())
    return Held(
        cells=np.column_stack([laid.metres(told - middle), stands]),
        target=_poses(target, laid, middle),
        here=_poses(own / own.sum(), laid, middle),
    )


def _poses(likely: np.ndarray, laid: Laid, middle: int) -> np.ndarray:
    """(M, 4) x, z, heading and probability of the likeliest poses of (4, G, G)."""
    best = np.argsort(-likely, axis=None, kind="stable")[:MOST]
    best = best[likely.ravel()[best] >= LEAST]
    heading, *cells = np.unravel_index(best, likely.shape)
    turned = (laid.heading_deg + heading * (360 / HEADINGS)) % 360
    return np.column_stack([laid.metres(np.column_stack(cells) - middle), turned, likely.ravel()[best]])
