"""Terms of a reward: small functions of tables, each with its parameters.

A term takes what the terms before it let every action of every pose earn, (S, A), and gives back what it earns now;
`Arrival` says what reaching the target earns in place of all that. Axis letters: S states, A actions.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from numbers import Real
from typing import TYPE_CHECKING, Any, ClassVar

from clearway.errors import ClearwayError
from clearway.own_code import code_of

if TYPE_CHECKING:
    import numpy as np


class RewardError(ClearwayError, ValueError):
    """A reward that does not exist or cannot be used."""


@dataclass(frozen=True)
class Moves:
    """Tables of a world that terms look at.

    Attributes:
        next_state: (S, A) int64, where each action leads; a blocked move leads back to its own state.
        blocked: (S, A) bool.
        zone: (S,) int, see `zones.Zone`.
        clearance_m: (S,) float64, distance to the nearest obstacle, see `clearance`.
    """

    next_state: np.ndarray
    blocked: np.ndarray
    zone: np.ndarray
    clearance_m: np.ndarray


def parameter(default: float | None, meaning: str) -> Any:
    """A parameter of a term: a dataclass field that says what it means, for the command line's help."""
    return field(default=default, metadata={"help": meaning})


@dataclass(frozen=True)
class Term:
    """A part of a reward. One of your own is a frozen dataclass whose fields, numbers or texts, are its parameters."""

    _digest_of_code: ClassVar[str | None] = None

    def __init_subclass__(cls, **given: Any) -> None:
        """Keep what the code of one of your own is as it is made: its file may change while it is in use."""
        super().__init_subclass__(**given)
        cls._digest_of_code = code_of(cls)

    def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
        """What every action earns with this term, (S, A) float64, from what it earned before it."""
        raise NotImplementedError(f"{type(self).__name__} does not say what it earns")


@dataclass(frozen=True)
class Time(Term):
    """What every step costs."""

    alpha: float = parameter(-0.01, "Reward of an ordinary step.")

    def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
        """Added everywhere."""
        return earned + self.alpha


@dataclass(frozen=True)
class Zones(Term):
    """What a step near an obstacle earns instead, by the zone of the pose that it ends in; None: as elsewhere."""

    beta: float | None = parameter(None, "Reward of a step into the collision zone.")
    gamma: float | None = parameter(None, "Reward of a step into the precollision zone.")

    def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
        """In place of what was earned."""
        import numpy as np

        from clearway.zones import Zone

        zone = moves.zone[moves.next_state]
        for value, where in ((self.beta, Zone.COLLISION), (self.gamma, Zone.PRECOLLISION)):
            earned = earned if value is None else np.where(zone == where, value, earned)
        return earned


@dataclass(frozen=True)
class Bump(Term):
    """What a blocked move earns instead, whatever the zone."""

    blocked: float = parameter(-0.1, "Reward of a blocked move.")

    def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
        """In place of what was earned."""
        import numpy as np

        return np.where(moves.blocked, self.blocked, earned)


@dataclass(frozen=True)
class Clearance(Term):
    """What a step costs that ends close to an obstacle: all of it at the obstacle, linearly less up to a distance.

    earned - clearance * max(0, 1 - distance / clearance_m)
    """

    clearance: float = parameter(0.02, "Cost of a step that ends at an obstacle, falling to nothing at clearance_m.")
    clearance_m: float = parameter(0.5, "Distance from which an obstacle costs nothing, metres.")

    def __post_init__(self) -> None:
        """Raise RewardError where there is no such distance."""
        if not isinstance(self.clearance_m, Real) or not self.clearance_m > 0:
            raise RewardError(f"--clearance-m is {self.clearance_m!r:.40}, expected more than 0. Give a distance")

    def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
        """Subtracted near obstacles."""
        import numpy as np

        near = np.maximum(0.0, 1.0 - moves.clearance_m / self.clearance_m)
        return earned - self.clearance * near[moves.next_state]


@dataclass(frozen=True)
class Arrival(Term):
    """What reaching the target earns, in place of all that a step earns else."""

    terminal: float = parameter(10.0, "Reward of reaching the target.")

    def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
        """The same wherever the target is."""
        import numpy as np

        return np.full_like(earned, self.terminal)


TERMS: dict[str, type[Term]] = {"time": Time, "zones": Zones, "bump": Bump, "clearance": Clearance, "arrival": Arrival}
"""Terms of ours by name, in the order in which they apply; terms of your own come before `arrival`."""
TERM_OF = {own.name: kind for kind in TERMS.values() for own in fields(kind)}
"""The term that each parameter belongs to; no two terms share a name."""


@dataclass(frozen=True)
class UnknownTerm(Term):
    """A term of somebody's own, as a run's record tells of it: its code is not loaded because a file names it."""

    path: str
    parameters: tuple[tuple[str, Any], ...]
    code: str | None = None

    @property
    def called(self) -> str:
        """The name of its class."""
        return self.path.rpartition(":")[2]

    def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
        """Raises RewardError."""
        raise RewardError(f"the reward has the term {self.path}, which is not loaded. Name the reward itself")


def in_order(ours: Mapping[type[Term], Term], others: Iterable[Term]) -> tuple[Term, ...]:
    """Ours as in `TERMS`, others before `Arrival`."""
    before = [ours[kind] for kind in TERMS.values() if kind in ours and kind is not Arrival]
    return (*before, *others, *(term for kind, term in ours.items() if kind is Arrival))
