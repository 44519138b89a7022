"""Claims, judged by statistics over seeds."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from clearway.evaluation.across_seeds import (
    Estimate,
    difference,
    failed_targets,
    mean_estimate,
    permutation_p,
    probability_of_less,
)
from clearway.evaluation.metrics import by_scene
from clearway.experiments.section import Claim, Verdict

SAME = 0.02  # means within this share of each other count as equal
LOST = 0.01  # of episodes, a point: so many more failures of the favoured kind leave a claim undecided
LEAST_RUNS = 4
"""Fewer of either kind decide nothing. Of two kinds that are alike, 31 % of all sets of 2 runs and 11 % of 3 would be
told apart, 4 % of 4 and of 5 (simulated, normal scores)."""
TOO_FEW = f"Fewer than {LEAST_RUNS} seeds decide nothing."


def further(claims: Iterable[Claim]) -> tuple[Claim, ...]:
    """The claims as such that the paper does not make."""
    return tuple(replace(claim, further=True) for claim in claims)


def judged_less(text: str, what: str, first: np.ndarray, second: np.ndarray, target_scene: np.ndarray) -> Claim:
    """The claim that the first kind of agent has less of something than the second.

    It holds where the interval of the difference of means lies below 0, and does not where it lies above.

    Args:
        text: the claim.
        what: is compared, for example "collisions".
        first: (R, M) scores.
        second: (R', M) scores.
        target_scene: (M,) int.
    """
    return _judged(text, what, first, second, target_scene)


def judged_more(
    text: str, what: str, first: np.ndarray, second: np.ndarray, target_scene: np.ndarray, *, rewards: int = 1
) -> Claim:
    """The claim that the first kind of agent has more of something than the second.

    As in `judged_less`; `rewards`: so many whose runs stand together on either side, of the same seeds.
    """
    return _judged(text, what, first, second, target_scene, more=True, rewards=rewards)


def judged_no_more(
    text: str, what: str, first: np.ndarray, second: np.ndarray, target_scene: np.ndarray, *, rewards: int = 1
) -> Claim:
    """The claim that the first kind has no more of something: at most 2 % more than the second; as in `judged_more`."""
    allowed = SAME * mean_estimate(second, target_scene).value if len(second) else 0.0
    return _judged(text, what, first, second, target_scene, allowed=allowed, rewards=rewards)


def with_failures(
    claim: Claim, first: np.ndarray, second: np.ndarray, target_scene: np.ndarray, *, lost: float = LOST
) -> Claim:
    """The claim, its evidence saying on how many targets some episode failed, which may be all that a mean tells of.

    Undecided where those whom the verdict favours arrive less often: who stands still does not collide.

    Args:
        claim: of two kinds of agents.
        first: (R, M) success, 1 where every episode reached the target.
        second: (R', M) success.
        target_scene: (M,) int.
        lost: share of episodes by which one kind may arrive less often and still be told better.
    """
    if not first.size or not second.size:
        return claim
    told = f"Failed targets, over all seeds: {failed_targets(first)}, {failed_targets(second)}"
    arrived, other = (float(by_scene(each[..., None], target_scene).mean()) for each in (first, second))
    if min(arrived, other) < 1:
        told += f"; episodes that arrived: {arrived:.2%}, {other:.2%}"
    favours = {"holds": arrived - other, "does not hold": other - arrived}
    verdict = claim.verdict
    if favours.get(verdict, 0.0) < -lost:
        verdict = "undecided"
        told += ", so that the figures compare different episodes"
    return replace(claim, verdict=verdict, evidence=f"{claim.evidence} {told}.")


def _judged(
    text: str,
    what: str,
    first: np.ndarray,
    second: np.ndarray,
    target_scene: np.ndarray,
    *,
    more: bool = False,
    allowed: float = 0.0,
    rewards: int = 1,
) -> Claim:
    if not len(first) or not len(second):
        return Claim(text, "undecided", "No complete runs.")
    found = difference(first, second, target_scene)
    pair = (second, first) if more else (first, second)
    numbers = {
        "first": mean_estimate(first, target_scene),
        "second": mean_estimate(second, target_scene),
        "difference": found,
        "probability of improvement": probability_of_less(*pair, target_scene),
    }
    seeds = [len(each) // rewards for each in (first, second)]
    evidence = (
        f"{what}: {numbers['first']} against {numbers['second']}, difference {found}; probability of improvement, mean "
        f"over targets: {numbers['probability of improvement']}; {seeds[0]} and {seeds[1]} seeds"
        f"{'.' if rewards == 1 else f' of {rewards} rewards each.'}"
    )
    if min(seeds) < LEAST_RUNS:
        return Claim(text, "undecided", f"{evidence} {TOO_FEW}", numbers)
    p = permutation_p(first, second, target_scene, allowed)
    return Claim(text, side(-found if more else found, allowed), evidence, numbers, p=p)


def side(found: Estimate, allowed: float) -> Verdict:
    """What an estimate of a difference says of the claim that it lies below 0, or is no more than what is allowed."""
    assert found.interval is not None  # there are several runs
    low, high = found.interval
    if allowed == 0:
        return "holds" if high < 0 else "does not hold" if low > 0 else "undecided"
    return "holds" if high <= allowed else "does not hold" if low > allowed else "undecided"
