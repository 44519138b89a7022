"""The reward: a list of named terms (paper, equation 1, and more).

    f(s_t) = 10 at the target, alpha on an ordinary step, beta in the collision zone, gamma in the precollision zone,

by the pose the agent arrives in; a blocked move arrives in the pose it left. `Reward.table` is the only place where a
step's earnings are computed: environments, hindsight, look-ahead and the exact oracles look them up there.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, fields, is_dataclass, replace
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, ClassVar

from clearway.errors import kind_and_reason
from clearway.own_code import not_importable
from clearway.reward.terms import (
    TERM_OF,
    TERMS,
    Arrival,
    Bump,
    Clearance,
    Moves,
    RewardError,
    Term,
    Time,
    UnknownTerm,
    Zones,
    in_order,
)
from clearway.spelling import did_you_mean

if TYPE_CHECKING:
    import numpy as np

CLIP = 1.0


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
            RewardError: the name, the switch or the terms are of the wrong kind; a term is none, keeps what is no
                field, or has a parameter that is not finite or may change; a kind of term occurs twice, they stand in
                another order, or there is not one `Arrival`.
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
            for own in () if isinstance(term, UnknownTerm) else fields(term):
                try:
                    hash(value := getattr(term, own.name))
                except TypeError as fault:
                    problem = f"{own.name} of the term {type(term).__name__} is {value!r:.40}, which may change"
                    raise RewardError(f"reward {self.name}: {problem}. Give a number, a text or a tuple") from fault
        kinds = [type(term) for term in self.terms if not isinstance(term, UnknownTerm)]
        paths = [_path(term) for term in self._others()]
        if len(set(kinds)) < len(kinds) or len(set(paths)) < len(paths):
            raise RewardError(f"reward {self.name}: a term occurs twice. Give every kind of term once")
        ours = list(TERMS.values())
        places = [ours.index(kind) if kind in ours else len(ours) for kind in map(type, self.terms) if kind != Arrival]
        if places != sorted(places):
            order = ", ".join(kind.__name__ for kind in ours if kind is not Arrival)
            raise RewardError(f"reward {self.name}: terms stand in another order. Give {order}, then those of your own")
        if [type(term) for term in self.terms if isinstance(term, Arrival)] != [Arrival]:
            raise RewardError(f"reward {self.name}: expected one term Arrival itself, for the target. Give one")
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
        import numpy as np

        try:
            earned = np.asarray(term(before, moves))
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
        ours = {type(term): term for term in self.terms if type(term) in TERMS.values()}
        for name, value in changes.items():
            if name not in TERM_OF:
                raise RewardError(
                    f"reward: no parameter {name}.{did_you_mean(name, TERM_OF)} Choose among {', '.join(TERM_OF)}"
                )
            if not _is_number(value):
                raise RewardError(f"--{name.replace('_', '-')} is {value!r}, expected a finite number. Correct it")
            kind = TERM_OF[name]
            ours[kind] = replace(ours.get(kind, kind()), **{name: float(value)})
        changed = Reward(self.name, in_order(ours, self._others()), self.clip if clip is None else clip)
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


COLLISION_AWARE = Reward("collision-aware", (Time(-0.01), Zones(beta=-0.02, gamma=-0.011), Arrival(10.0)))
"""The paper's reward."""
SHORTEST = Reward("shortest", (Time(-0.01), Arrival(10.0)))
"""What Zhu et al. train with: every step costs the same."""
BUMP = Reward("bump", (Time(-0.01), Bump(-0.1), Arrival(10.0)))
"""Zhu's environment class: a blocked move costs 0.1. Their training loop overwrites it; public ports keep it."""
CLEARANCE = Reward("clearance", (Time(-0.01), Clearance(0.02, 0.5), Arrival(10.0)))
"""The closer to an obstacle a step ends, the more it costs."""

REWARDS: dict[str, Reward] = {reward.name: reward for reward in (COLLISION_AWARE, SHORTEST, BUMP, CLEARANCE)}
