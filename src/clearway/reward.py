"""The reward: a list of named terms, each a small function of tables (paper, equation 1, and more).

    f(s_t) = 10 at the target, alpha on an ordinary step, beta in the collision zone, gamma in the precollision zone,

by the pose the agent arrives in; a blocked move arrives in the pose it left. A term takes what the terms before it let
every action of every pose earn, (S, A), and gives back what it earns now; `Arrival` says what reaching the target earns
in place of all that. `Reward.table` is the only place where a step's earnings are computed: environments, hindsight,
look-ahead and the exact oracles look them up there.

The module is light, so that the command line can read names and parameters from it. Axis letters: S states, A actions.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, ClassVar

from clearway.errors import ClearwayError, PluginError, kind_and_reason
from clearway.own_code import code_of, not_importable
from clearway.plugins import find_plugin, imported, load_plugin, offered
from clearway.spelling import did_you_mean

if TYPE_CHECKING:
    import numpy as np

CLIP = 1.0


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


@dataclass(frozen=True)
class Reward:
    """What the agent earns.

    Attributes:
        name: in tables.
        terms: in the order in which they apply: ours as in `TERMS`, then others; `Arrival` applies last, at the target
            alone, wherever it stands.
        clip: clip to [-1, 1] as Zhu's training loop does, so that the target is worth 1. In a training the algorithm's
            setting `clip_rewards` says so, see `learn.learner.Learner.paid`.
    """

    name: str
    terms: tuple[Term, ...] = (Time(), Arrival())
    clip: bool = False

    CLIPPED: ClassVar[str] = "clip"
    CODES: ClassVar[str] = "code"

    def __post_init__(self) -> None:
        """Refuse what is no term.

        Raises:
            RewardError: a term is none, a kind of term occurs twice, they stand in another order, or there is no
                `Arrival`.
        """
        if not isinstance(self.name, str) or not isinstance(self.clip, bool):
            raise RewardError(f"reward: name={self.name!r:.40}, clip={self.clip!r:.40}: expected a text, True or False")
        if not isinstance(self.terms, tuple):
            raise RewardError(f"reward {self.name}: terms={self.terms!r:.60}: expected a tuple of terms. Give one")
        for term in self.terms:
            if not isinstance(term, Term) or not is_dataclass(term):
                raise RewardError(f"reward {self.name}: {term!r:.60} is no term. Give dataclasses derived from Term")
            if "__dataclass_params__" not in vars(type(term)) and set(vars(term)) - {own.name for own in fields(term)}:
                problem = f"the term {type(term).__name__} keeps what is no field of it, so that no record holds it"
                raise RewardError(f"reward {self.name}: {problem}. Decorate it with @dataclass(frozen=True)")
        kinds = [type(term) for term in self.terms if not isinstance(term, UnknownTerm)]
        paths = [_path(term) for term in self._others()]
        if len(set(kinds)) < len(kinds) or len(set(paths)) < len(paths):
            raise RewardError(f"reward {self.name}: a term occurs twice. Give every kind of term once")
        ours = list(TERMS.values())
        places = [ours.index(kind) if kind in ours else len(ours) for kind in map(type, self.terms) if kind != Arrival]
        if places != sorted(places):
            order = ", ".join(kind.__name__ for kind in ours if kind is not Arrival)
            raise RewardError(f"reward {self.name}: terms stand in another order. Give {order}, then those of your own")
        if sum(isinstance(term, Arrival) for term in self.terms) != 1:
            raise RewardError(f"reward {self.name}: expected one term Arrival, for the target. Give one")
        for name, value in self.parameters.items():
            if not _is_number(value):
                raise RewardError(f"reward {self.name}: {name} is {value!r:.40}, expected a finite number. Correct it")

    @property
    def parameters(self) -> dict[str, float]:
        """The parameters of our own terms by name; those that are None are left out, which `Zones` alone may have."""
        ours = [term for term in self.terms if type(term) in TERMS.values()]
        found = [(own, getattr(term, own.name)) for term in ours for own in fields(term)]
        return {own.name: value for own, value in found if value is not None or own.default is not None}

    @property
    def is_known(self) -> bool:
        """All terms can be computed here."""
        return not any(isinstance(term, UnknownTerm) for term in self.terms)

    def as_known(self) -> Reward:
        """The same without the terms whose code is not loaded, under a name that says so."""
        if self.is_known:
            return self
        left = ", ".join(term.called for term in self.terms if isinstance(term, UnknownTerm))
        known = tuple(term for term in self.terms if not isinstance(term, UnknownTerm))
        return replace(self, name=f"{self.name} without {left}", terms=known)

    def table(self, moves: Moves) -> np.ndarray:
        """What every action earns, (2, S, A) float64: [the target is reached, state, action].

        Raises:
            RewardError: a term gives something else than (S, A) finite numbers, or is not loaded.
        """
        import numpy as np

        step = np.zeros(moves.next_state.shape)
        for term in self.terms:
            if not isinstance(term, Arrival):
                step = self._earned(term, step, moves)
        (arrival,) = (term for term in self.terms if isinstance(term, Arrival))
        table = np.stack([step, self._earned(arrival, step, moves)])
        return np.clip(table, -CLIP, CLIP) if self.clip else table

    def _earned(self, term: Term, before: np.ndarray, moves: Moves) -> np.ndarray:
        """What a term gives, checked; one that is not ours may raise anything."""
        if type(term) in TERMS.values() or isinstance(term, UnknownTerm):
            return self._checked(term, term(before, moves), before.shape)
        try:
            earned = term(before, moves)
        except (Exception, SystemExit) as fault:
            reason = kind_and_reason(fault)
            kind = type(term).__name__
            raise RewardError(f"reward {self.name}: the term {kind} failed ({reason}). Correct the term") from fault
        return self._checked(term, earned, before.shape)

    def _checked(self, term: Term, earned: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
        import numpy as np

        found = np.asarray(earned)
        kind = type(term).__name__
        if found.shape != shape or found.dtype.kind != "f":
            problem = f"the term {kind} gives {found.dtype} {found.shape}"
            raise RewardError(f"reward {self.name}: {problem}, expected (S, A) float64, {shape}. Correct the term")
        if not np.isfinite(found).all():
            raise RewardError(f"reward={self.name} holds NaN or Inf in its term {kind}. Give finite values")
        return found

    def with_changes(self, *, clip: bool | None = None, **parameters: float | None) -> Reward:
        """The same reward with parameters of our terms changed, under a name that says so; None changes nothing.

        A term that the reward lacks is added.

        Raises:
            RewardError: there is no such parameter, or it is no finite number.
        """
        changes = {name: value for name, value in parameters.items() if value is not None}
        terms: dict[type[Term], Term] = {type(term): term for term in self.terms}
        for name, value in changes.items():
            if name not in TERM_OF:
                raise RewardError(
                    f"reward: no parameter {name}.{did_you_mean(name, TERM_OF)} Choose among {', '.join(TERM_OF)}"
                )
            if not _is_number(value):
                raise RewardError(f"--{name.replace('_', '-')} is {value!r}, expected a finite number. Correct it")
            kind = TERM_OF[name]
            terms[kind] = replace(terms.get(kind, kind()), **{name: float(value)})
        changed = Reward(self.name, in_order(terms), self.clip if clip is None else clip)
        base, before = self._told_by_name()
        known, now = REWARDS.get(base, self).parameters, changed.parameters
        told = {} if base in REWARDS else before
        told |= {name: f"{value:.10g}" for name, value in now.items() if known.get(name) != value}
        return replace(changed, name=", ".join([base, *(f"{name} {told[name]}" for name in now if name in told)]))

    def _told_by_name(self) -> tuple[str, dict[str, str]]:
        """The name without what `with_changes` has put behind it, and that: parameters as texts."""
        parts, told = self.name.split(", "), dict[str, str]()
        while len(parts) > 1 and (last := parts[-1].split(" "))[0] in self.parameters and len(last) == 2:
            told[last[0]] = last[1]
            parts.pop()
        return ", ".join(parts), told

    @property
    def codes(self) -> dict[str, str]:
        """What the code is of terms that are not ours, by where their class stands: `code_of`, where it can be had."""
        told = {
            _path(term): term.code if isinstance(term, UnknownTerm) else vars(type(term)).get("_digest_of_code")
            for term in self._others()
        }
        return {path: code for path, code in told.items() if code is not None}

    def check_sent(self, main_too: bool = False) -> None:
        """Refuse a reward with a term that other processes cannot import; `main_too`: they import our program, too.

        Raises:
            RewardError: there is one.
        """
        for kind in map(type, self._others()):
            if where := not_importable(kind, main_too):
                problem = f"its term {kind.__name__} stands {where}, which worker processes cannot import"
                remedy = f"Put it into a module of its own, such as {kind.__name__.lower()}.py, and import it"
                raise RewardError(f"reward {self.name}: {problem}. {remedy}")

    def _others(self) -> list[Term]:
        return [term for term in self.terms if type(term) not in TERMS.values()]

    def to_json(self) -> dict[str, object]:
        """As JSON values: name, parameters, clipping; terms that are not ours by where their class is, and their code.

        Raises:
            RewardError: a parameter of such a term is no JSON value, nor a number of NumPy's.
        """
        others = {
            _path(term): dict(term.parameters)
            if isinstance(term, UnknownTerm)
            else {own.name: getattr(term, own.name) for own in fields(term)}
            for term in self._others()
        }
        further = {name: told for name, told in (("terms", others), (self.CODES, self.codes)) if told}
        told = {"name": self.name, **self.parameters, self.CLIPPED: self.clip, **further}
        try:
            return dict(json.loads(json.dumps(told, default=_as_plain)))  # as it comes back from a file
        except TypeError as fault:
            problem = f"reward {self.name}: a parameter is no JSON value ({fault})"
            raise RewardError(f"{problem}. Use plain numbers") from fault

    def __str__(self) -> str:
        """Its parameters, as tables print them."""
        told = [f"{name} {value:g}" for name, value in self.parameters.items()]
        told += [term.called if isinstance(term, UnknownTerm) else type(term).__name__ for term in self._others()]
        return ", ".join(told) + (", clipped to [-1, 1]" if self.clip else "")


def _path(term: Term) -> str:
    """Where the class of a term that is not ours stands."""
    return term.path if isinstance(term, UnknownTerm) else f"{type(term).__module__}:{type(term).__qualname__}"


def _is_number(value: object) -> bool:
    """A finite number, Python's or NumPy's."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return False
    size: Any = abs(value)
    return bool(size < math.inf)


def _as_plain(value: object) -> int | float:
    """A number that JSON does not know, such as NumPy's, as one of Python's. Raises TypeError where it is none."""
    if isinstance(value, Integral):
        return int(value)
    if isinstance(value, Real):
        return float(value)
    raise TypeError(f"a {type(value).__name__}")


def in_order(terms: Mapping[type[Term], Term]) -> tuple[Term, ...]:
    """Ours as in `TERMS`, others before `Arrival`."""
    ours = [terms[kind] for kind in TERMS.values() if kind in terms and kind is not Arrival]
    others = [term for kind, term in terms.items() if kind not in TERMS.values()]
    return (*ours, *others, *(term for kind, term in terms.items() if kind is Arrival))


COLLISION_AWARE = Reward("collision-aware", (Time(-0.01), Zones(beta=-0.02, gamma=-0.011), Arrival(10.0)))
"""The paper's reward."""
SHORTEST = Reward("shortest", (Time(-0.01), Arrival(10.0)))
"""What Zhu et al. train with: every step costs the same."""
BUMP = Reward("bump", (Time(-0.01), Bump(-0.1), Arrival(10.0)))
"""Zhu's environment class: a blocked move costs 0.1. Their training loop overwrites it; public ports keep it."""
CLEARANCE = Reward("clearance", (Time(-0.01), Clearance(0.02, 0.5), Arrival(10.0)))
"""The closer to an obstacle a step ends, the more it costs."""

REWARDS: dict[str, Reward] = {reward.name: reward for reward in (COLLISION_AWARE, SHORTEST, BUMP, CLEARANCE)}


def reward_named(name: str | Reward) -> Reward:
    """The reward of a name: one of `REWARDS`, another package's (`plugins`), or a user's own as `package.module:name`.

    What is named is a `Reward`, or a function without arguments that gives one.

    Raises:
        RewardError: there is none.
        PluginError: two packages offer one of this name, or it cannot be imported.
    """
    if isinstance(name, Reward):
        return name
    if isinstance(name, str) and name in REWARDS:
        return REWARDS[name]
    if isinstance(name, str) and (plugin := find_plugin("rewards", name)):
        return _made(str(plugin), load_plugin(plugin))
    if not isinstance(name, str) or ":" not in name:
        names = (*REWARDS, *offered("rewards"))
        told = f"reward={name!r:.80} is unknown.{did_you_mean(name, names)}"
        raise RewardError(f"{told} Use one of {', '.join(map(repr, names))}, a Reward, or package.module:name")
    try:
        found = imported(name)
    except PluginError as fault:
        raise RewardError(f"reward={fault}") from fault
    return _made(f"reward={name!r}", found)


def _made(source: str, found: object) -> Reward:
    """What was found under a name, or what it gives when it is called."""
    try:
        made = found() if callable(found) else found
    except (Exception, SystemExit) as fault:  # likewise
        reason = kind_and_reason(fault)
        raise RewardError(f"{source}: cannot be made ({reason}). Correct it") from fault
    if not isinstance(made, Reward):
        raise RewardError(f"{source}: gives {made!r:.60}, expected a clearway.Reward. Correct it")
    return made
