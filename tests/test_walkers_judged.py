"""Claims about kinds of walkers are judged over rooms, by every seed, and corrected for their number."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
ROOMS = 40


@pytest.fixture
def judge(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    monkeypatch.syspath_prepend(BENCHMARKS)
    return runpy.run_path(str(BENCHMARKS / "walkers_judged.py"))


def record(**kinds: list[float]) -> dict[str, Any]:
    """Agents of kinds, whose seeds have these means of collisions, with some noise by room and agent."""
    rng, found = np.random.default_rng(0), {"asked": {"goals": 20}}
    for kind, means in kinds.items():
        for seed, mean in enumerate(means):
            noise = rng.normal(0, 0.2, ROOMS)
            scenes = [{"scene": f"room {room}", "collisions": float(mean + noise[room])} for room in range(ROOMS)]
            found[f"{kind}-{seed}"] = {"scenes": scenes}
    return found


def test_a_claim_holds_where_rooms_and_all_seeds_say_so(judge: dict[str, Any]) -> None:
    found = record(careful=[0.2, 0.3, 0.1], bumps=[1.0, 1.2, 0.9], mixed=[1.4, 1.3, 0.0], same=[0.2, 0.3, 0.1])
    claims = [("bumps", "careful"), ("mixed", "careful"), ("same", "careful"), ("careful", "bumps")]
    bumps, mixed, same, turned_round = judge["judged"](found, "collisions", claims)
    assert bumps.holds and bumps.by_seed.shape == (3, ROOMS)
    assert bumps.by_seed.mean() == pytest.approx(0.83, abs=0.1)
    assert mixed.p < 0.05 and not mixed.holds  # one seed says the contrary
    assert not same.holds and same.p > 0.05
    assert not turned_round.holds
    low, high = mixed.other_seeds
    assert low < 0 < high  # other seeds could have turned it round
    assert bumps.other_seeds[0] > 0


def test_p_is_corrected_for_the_claims_of_a_question(judge: dict[str, Any]) -> None:
    found = record(one=[0.0, 0.0], other=[0.09, 0.09], third=[0.0, 0.0])
    (alone,) = judge["judged"](found, "collisions", [("other", "one")])
    among, _, _ = judge["judged"](found, "collisions", [("other", "one"), ("third", "one"), ("one", "third")])
    assert 0 < alone.p < 1 and among.p == pytest.approx(min(1.0, 3 * alone.p))


def test_p_of_a_mean_is_twice_the_share_beyond_zero(judge: dict[str, Any]) -> None:
    assert judge["p_of_mean"](np.ones(10)) == pytest.approx(2 / 2001)
    assert judge["p_of_mean"](np.zeros(10)) == 1.0
    values = np.random.default_rng(1).normal(0.3, 1.0, 50)
    assert judge["p_of_mean"](values) == judge["p_of_mean"](-values)


def test_scenes_are_compared_by_name(judge: dict[str, Any]) -> None:
    found = record(one=[0.0], other=[0.2])
    before = judge["judged"](found, "collisions", [("other", "one")])[0].by_seed
    found["one-0"]["scenes"].reverse()
    after = judge["judged"](found, "collisions", [("other", "one")])[0].by_seed
    assert np.array_equal(np.sort(before), np.sort(after))


def test_what_cannot_be_compared_is_told(judge: dict[str, Any]) -> None:
    found = record(one=[0.0, 0.1], other=[0.2])
    with pytest.raises(SystemExit, match=r"one and other: seeds 0, 1 and 0\. Compare the same seeds"):
        judge["judged"](found, "collisions", [("one", "other")])
    found = record(one=[0.0, 0.1], other=[0.2, 0.3])
    found["other-2"] = found.pop("other-0")
    with pytest.raises(SystemExit, match="one and other: seeds 0, 1 and 1, 2"):
        judge["judged"](found, "collisions", [("one", "other")])
    found = record(one=[0.0], other=[0.2])
    found["other-0"]["scenes"][3]["scene"] = "elsewhere"
    with pytest.raises(SystemExit, match="they walked in other scenes"):
        judge["judged"](found, "collisions", [("one", "other")])
    with pytest.raises(SystemExit, match="gone: no run of this kind"):
        judge["judged"](found, "collisions", [("gone", "other")])
