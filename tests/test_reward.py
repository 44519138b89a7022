import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clearway.learn.reward_record import reward_from_json
from clearway.reward import (
    BUMP,
    CLEARANCE,
    COLLISION_AWARE,
    REWARDS,
    SHORTEST,
    Arrival,
    Bump,
    Clearance,
    Moves,
    Reward,
    RewardError,
    Term,
    Time,
    UnknownTerm,
    Zones,
    reward_named,
)
from clearway.world.world import make_world
from helpers import own_terms
from helpers.made import corridor_scene

NOT_REACHED, REACHED = 0, 1
MOVED, BLOCKED = 0, 1  # actions of the poses below
FREE, PRECOLLISION, COLLISION = 0, 1, 2  # poses below, by their zones

MOVES = Moves(
    next_state=np.array([[FREE, FREE], [PRECOLLISION, PRECOLLISION], [COLLISION, COLLISION]]),
    blocked=np.array([[False, True]] * 3),
    zone=np.array([0, 1, 2]),
    clearance_m=np.array([np.inf, 0.4, 0.1]),
)


def steps(reward: Reward, action: int = MOVED) -> list[float]:
    """What steps into the three poses earn."""
    return reward.table(MOVES)[NOT_REACHED, :, action].tolist()


@dataclass(frozen=True)
class OwnArrival(Arrival):
    """A term of one's own that would stand in for ours."""


@dataclass(frozen=True)
class Doubled(Term):
    """A term of one's own: all costs times a factor."""

    factor: float = 2.0

    def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
        return self.factor * earned


MINE = Reward("mine", (Time(-0.02), Doubled(3.0), Arrival(5.0)))


def test_collision_aware_pays_by_the_zone_of_arrival() -> None:
    assert COLLISION_AWARE.table(MOVES).shape == (2, 3, 2)
    assert steps(COLLISION_AWARE) == steps(COLLISION_AWARE, BLOCKED) == [-0.01, -0.011, -0.02]


def test_what_counts_is_where_a_step_ends_not_where_it_begins() -> None:
    onward = replace(MOVES, next_state=np.array([[1, 0], [2, 1], [0, 2]]))
    assert COLLISION_AWARE.table(onward)[NOT_REACHED, :, MOVED].tolist() == [-0.011, -0.02, -0.01]
    assert CLEARANCE.table(onward)[NOT_REACHED, :, MOVED].tolist() == pytest.approx([-0.014, -0.026, -0.01])


def test_shortest_charges_every_step_alike() -> None:
    assert steps(SHORTEST) == steps(SHORTEST, BLOCKED) == [-0.01] * 3


def test_bump_charges_a_blocked_move_whatever_the_zone() -> None:
    assert (steps(BUMP), steps(BUMP, BLOCKED)) == ([-0.01] * 3, [-0.1] * 3)


def test_clearance_charges_more_the_nearer_an_obstacle_is() -> None:
    assert steps(CLEARANCE) == pytest.approx([-0.01, -0.01 - 0.02 * 0.2, -0.01 - 0.02 * 0.8])
    touching = replace(MOVES, clearance_m=np.array([0.0, 0.5, 0.6]))
    assert CLEARANCE.table(touching)[NOT_REACHED, :, MOVED].tolist() == pytest.approx([-0.03, -0.01, -0.01])


@pytest.mark.parametrize("reward", REWARDS.values(), ids=REWARDS)
def test_the_target_comes_before_all_zones(reward: Reward) -> None:
    assert (reward.table(MOVES)[REACHED] == 10.0).all()


@pytest.mark.parametrize("reward", REWARDS.values(), ids=REWARDS)
def test_clipping_changes_the_target_alone(reward: Reward) -> None:
    clipped = reward.with_changes(clip=True)
    assert (clipped.table(MOVES)[REACHED] == 1.0).all()
    assert steps(clipped) == steps(reward)


def test_clipping_works_downwards_too() -> None:
    assert steps(COLLISION_AWARE.with_changes(beta=-3.0, clip=True)) == [-0.01, -0.011, -1.0]


def test_changes_leave_what_is_none_and_change_the_name() -> None:
    changed = COLLISION_AWARE.with_changes(beta=-0.5, gamma=None)
    assert changed.parameters == {"alpha": -0.01, "beta": -0.5, "gamma": -0.011, "terminal": 10.0}
    assert (changed.name, COLLISION_AWARE.name) == ("collision-aware, beta -0.5", "collision-aware")
    assert COLLISION_AWARE.parameters["beta"] == -0.02
    assert COLLISION_AWARE.with_changes(beta=-0.02) == COLLISION_AWARE  # nothing is another


def test_a_parameter_of_a_term_that_a_reward_lacks_adds_the_term() -> None:
    changed = SHORTEST.with_changes(beta=-0.5, clearance=0.04)
    assert changed.terms == (Time(-0.01), Zones(beta=-0.5), Clearance(0.04, 0.5), Arrival(10.0))
    assert changed.name == "shortest, beta -0.5, clearance 0.04, clearance_m 0.5"


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"delta": 1.0}, "no parameter delta. Choose among alpha, beta"),
        ({"alpha": float("nan")}, "--alpha is nan, expected a finite number"),
        ({"clearance_m": 0.0}, "--clearance-m is 0.0, expected more than 0"),
    ],
)
def test_changes_that_cannot_be(parameters: dict, message: str) -> None:
    with pytest.raises(RewardError, match=message):
        SHORTEST.with_changes(**parameters)


@pytest.mark.parametrize(
    ("terms", "message"),
    [
        ((Time(),), "expected one term Arrival"),
        ((Time(), OwnArrival()), "expected one term Arrival itself"),
        ((Time(), OwnArrival(), Arrival()), "expected one term Arrival itself"),
        ((Doubled([2.0]), Arrival()), r"factor of the term Doubled is \[2.0\], which may change. Give a number"),
        ((Doubled(([2.0],)), Arrival()), "which may change"),
        ((Time(), Time(), Arrival()), "a term occurs twice"),
        ((abs, Arrival()), "is no term"),
        (
            (Bump(), Time(), Arrival()),
            "another order. Give Time, Zones, Bump, Clearance, then those of your own",
        ),
        ((Doubled(2.0), Time(), Arrival()), "stand in another order"),
        ((Time(None), Arrival()), "alpha is None, expected a finite number"),
        ((Time(), Bump(None), Arrival()), "blocked is None, expected a finite number"),
        ((Time(), Clearance(None, 0.5), Arrival()), "clearance is None, expected a finite number"),
        ((Time(), Arrival(None)), "terminal is None, expected a finite number"),
    ],
)
def test_terms_that_make_no_reward(terms: tuple, message: str) -> None:
    with pytest.raises(RewardError, match=message):
        Reward("wrong", terms)


def test_terms_that_earn_nonsense() -> None:
    with pytest.raises(RewardError, match="alpha is nan, expected a finite number"):
        Reward("wrong", (Time(float("nan")), Arrival()))
    with pytest.raises(RewardError, match="NaN or Inf in its term Doubled"):
        Reward("wrong", (Time(), Doubled(float("nan")), Arrival())).table(MOVES)

    @dataclass(frozen=True)
    class Flat(Term):
        def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
            return earned[0]

    @dataclass(frozen=True)
    class Ragged(Term):
        def __call__(self, earned: np.ndarray, moves: Moves) -> Any:
            return [[1.0, 2.0], [3.0]]

    with pytest.raises(RewardError, match=r"the term Ragged failed \(ValueError: .* Correct the term"):
        Reward("wrong", (Ragged(), Arrival())).table(MOVES)
    with pytest.raises(RewardError, match=r"Flat gives float64 \(2,\), expected \(S, A\) float64, \(3, 2\)"):
        Reward("wrong", (Flat(), Arrival())).table(MOVES)


def test_a_reward_changed_twice_says_how_it_differs_from_the_one_of_its_name() -> None:
    twice = COLLISION_AWARE.with_changes(beta=-0.5).with_changes(beta=-0.6, alpha=-0.02)
    assert twice.name == "collision-aware, alpha -0.02, beta -0.6"
    assert twice.with_changes(beta=-0.02, alpha=-0.01) == COLLISION_AWARE
    assert COLLISION_AWARE.with_changes(beta=-0.02000001).name == "collision-aware, beta -0.02000001"


def test_the_name_of_a_reward_of_one_s_own_says_its_last_changes() -> None:
    mine = Reward("mine, for short", (Time(), Arrival()))
    twice = mine.with_changes(alpha=-0.02, beta=-0.5).with_changes(alpha=-0.03)
    assert twice.name == "mine, for short, alpha -0.03, beta -0.5"
    assert twice.with_changes(alpha=None).name == twice.name


def test_terms_cannot_write_to_the_tables() -> None:
    @dataclass(frozen=True)
    class Opening(Term):
        def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
            moves.blocked[:] = False
            return earned

    scene = corridor_scene()
    world = make_world([scene], {scene.name: [0]})
    with pytest.raises(RewardError, match=r"the term Opening failed .*read-only"):
        Reward("wrong", (Opening(), Arrival())).table(world.moves())
    assert world.blocked.any()


def test_a_parameter_comes_back_from_a_file_as_it_was_written() -> None:
    @dataclass(frozen=True)
    class Listed(Term):
        values: tuple[float, ...] = (1.0, 2.0)

        def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
            return earned

    kept = Reward("listed", (Listed(), Arrival())).to_json()
    assert json.loads(json.dumps(kept)) == kept
    with pytest.raises(RewardError, match="no JSON value"):
        Reward("odd", (Listed((1j,)), Arrival())).to_json()
    numbers = Reward("numbers", (Time(np.float32(-0.5)), Listed((np.float32(0.5), np.int64(2))), Arrival()))
    assert numbers.to_json() == Reward("numbers", (Time(-0.5), Listed((0.5, 2)), Arrival())).to_json()


def test_a_term_whose_parameters_would_not_be_told_is_refused() -> None:
    class Dear(Term):
        def __init__(self, cost: float) -> None:
            self.cost = cost

        def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
            return earned - self.cost

    class Bare(Term):
        def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
            return earned - 1

    with pytest.raises(RewardError, match=r"the term Dear keeps .* Decorate it with @dataclass.frozen=True.") as caught:
        Reward("dear", (Time(), Dear(0.5), Arrival()))
    assert "\n" not in str(caught.value)
    own = Reward("bare", (Bare(), Arrival())).to_json()["terms"]
    assert list(own.values()) == [{}]


def test_a_term_of_one_s_own() -> None:
    assert steps(MINE) == pytest.approx([-0.06] * 3)
    assert (MINE.table(MOVES)[REACHED] == 5.0).all()
    assert str(MINE) == "alpha -0.02, terminal 5, Doubled"


@pytest.mark.parametrize("reward", [*REWARDS.values(), BUMP.with_changes(terminal=3.0, clip=True)])
def test_a_reward_comes_back_from_json(reward: Reward) -> None:
    assert reward_from_json(reward.to_json()) == reward


def test_a_term_of_one_s_own_is_told_in_json_and_not_loaded_from_it() -> None:
    kept = MINE.to_json()
    assert kept["terms"] == {f"{__name__}:Doubled": {"factor": 3.0}}
    read = reward_from_json(kept)
    assert (read.to_json(), read.is_known, MINE.is_known) == (kept, False, True)
    assert str(read) == str(MINE)
    assert (read.as_known().name, MINE.as_known()) == ("mine without Doubled", MINE)
    assert read.as_known().table(MOVES).max() == 5.0
    with pytest.raises(RewardError, match="Doubled, which is not loaded"):
        read.table(MOVES)


def test_several_terms_that_are_not_loaded_stay_through_changes() -> None:
    others = (UnknownTerm("own:First", ()), UnknownTerm("own:Second", (("cost", 2),)))
    read = Reward("read", (Time(), *others, Arrival()))
    assert reward_from_json(read.to_json()) == read
    assert read.with_changes(alpha=-0.5).terms == (Time(-0.5), *others, Arrival())


def test_the_code_of_a_term_is_told_as_it_was_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = own_terms.imported(tmp_path / "turning.py", monkeypatch)
    kept, path = module.REWARD.to_json(), f"{own_terms.NAME}:Turning"
    assert kept["terms"] == {path: {"cost": 0.005}} and list(kept["code"]) == [path]
    dearer = own_terms.imported(tmp_path / "turning.py", monkeypatch, own_terms.DEARER).REWARD.to_json()
    assert module.REWARD.to_json() == kept  # of what this program runs, though its file has changed
    assert dearer == {**kept, "code": dearer["code"]} != kept
    assert (reward_from_json(kept).to_json(), reward_from_json(dearer).to_json()) == (kept, dearer)
    del kept["code"]  # as earlier versions wrote it
    assert reward_from_json(kept).to_json() == kept
    for wrong in ({"code": 3}, {"code": {path: 3}}):
        with pytest.raises(TypeError, match="code is"):
            reward_from_json({**kept, **wrong})
    assert not any("code" in reward.to_json() for reward in REWARDS.values())


def test_a_parameter_may_be_called_as_the_key_of_the_code_is(monkeypatch: pytest.MonkeyPatch) -> None:
    @dataclass(frozen=True)
    class Coded(Term):
        code: float = 0.5

    kept = Reward("coded", (Time(), Coded(), Arrival())).to_json()
    assert list(kept["terms"].values()) == [{"code": 0.5}]
    assert reward_from_json(kept).to_json() == kept


def test_a_term_s_code_is_its_own_where_a_base_keeps_it_from_being_noted() -> None:
    class Silent:
        def __init_subclass__(cls) -> None:
            """Tell nobody."""

    @dataclass(frozen=True)
    class Quiet(Silent, Doubled):
        pass

    assert Reward("quiet", (Time(), Quiet(2.0), Arrival())).codes == {}
    assert MINE.codes


def test_rewards_as_runs_of_format_1_hold_them() -> None:
    old = {"alpha": -0.01, "beta": -0.01, "gamma": -0.01, "terminal": 10.0, "blocked": None, "clip": False}
    assert reward_from_json({"name": "shortest", **old}) == SHORTEST
    assert reward_from_json({"name": "bump", **old, "blocked": -0.1}) == BUMP
    aware = {**old, "beta": -0.02, "gamma": -0.011}
    assert reward_from_json({"name": "collision-aware", **aware}) == COLLISION_AWARE
    changed = reward_from_json({"name": "collision-aware", **aware, "beta": -0.5})
    assert changed == COLLISION_AWARE.with_changes(beta=-0.5)
    assert steps(reward_from_json({"name": "other", **aware, "blocked": -0.3}), BLOCKED) == [-0.3] * 3
    dearer = reward_from_json({"name": "shortest", **old, "alpha": -0.02})
    assert (steps(dearer), dearer.name) == ([-0.02, -0.01, -0.01], "shortest, alpha -0.02, beta -0.01, gamma -0.01")
    plain = reward_from_json({"name": "collision-aware", **old})
    assert (steps(plain), plain.name) == ([-0.01] * 3, "collision-aware, beta -0.01, gamma -0.01")
    other = reward_from_json({"name": "other", **aware})
    assert (steps(other), other.name) == (steps(COLLISION_AWARE), "other")


@pytest.mark.parametrize("wrong", [{"alpha": "low"}, {"delta": 1.0}, {"clip": 1}, {"name": 3}, {"terminal": None}])
def test_json_that_is_no_reward(wrong: dict) -> None:
    with pytest.raises((KeyError, TypeError)):
        reward_from_json({**SHORTEST.to_json(), **wrong})


def test_rewards_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "their_rewards.py").write_text(
        "from clearway.reward import Arrival, Reward, Time\n"
        "slow = Reward('slow', (Time(-0.5), Arrival()))\n"
        "def made():\n    return slow\n"
        "nothing = 3\n"
        "def broken():\n    raise KeyError('spoon')\n"
    )
    (tmp_path / "their_fault.py").write_text("spoon\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert reward_named("bump") is BUMP
    assert reward_named("their_rewards:slow").name == "slow"
    assert reward_named("their_rewards:made").name == "slow"
    for name, message in (
        ("bumps", "'bumps' is unknown. Did you mean bump\\? Use one of 'collision-aware'"),
        ("their_rewards:fast", "cannot be loaded"),
        ("no_such_module:fast", "cannot be loaded"),
        ("their_fault:slow", "cannot be loaded .NameError"),
        ("their_rewards:broken", "cannot be made .KeyError: 'spoon'"),
        ("their_rewards:nothing", "gives 3, expected a clearway.Reward"),
    ):
        with pytest.raises(RewardError, match=message):
            reward_named(name)


@pytest.mark.parametrize("distance_m", [0.0, -0.5, float("nan"), None, "0.5"])
def test_a_clearance_that_grows_with_distance_or_has_none_is_refused(distance_m: Any) -> None:
    with pytest.raises(RewardError, match="expected more than 0"):
        Clearance(0.02, distance_m)


def test_two_terms_that_a_record_could_not_tell_apart_are_refused() -> None:
    made = [dataclass(frozen=True)(type("Same", (Term,), {"__module__": "mine"})) for _ in range(2)]
    with pytest.raises(RewardError, match="a term occurs twice"):
        Reward("both", (made[0](), made[1](), Arrival()))
