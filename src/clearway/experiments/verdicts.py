"""The paper's claims, judged by statistics over seeds."""

from __future__ import annotations

import numpy as np

from clearway.evaluate.across_seeds import Estimate, difference, mean_estimate, probability_of_less
from clearway.experiments.section import Claim, Verdict

SAME = 0.02  # means within this share of each other count as equal


def judged_less(text: str, what: str, first: np.ndarray, second: np.ndarray, target_scene: np.ndarray) -> Claim:
    """The claim that the first kind of agent has less of something than the second.

    It holds where the interval of the difference of means lies below 0, and does not where it lies above.

    Args:
        text: the claim.
        what: is compared, for example "collisions".
        first, second: (R, M) scores.
        target_scene: (M,) int.
    """
    return _judged(text, what, first, second, target_scene)


def judged_more(text: str, what: str, first: np.ndarray, second: np.ndarray, target_scene: np.ndarray) -> Claim:
    """The claim that the first kind of agent has more of something than the second; as in `judged_less`."""
    return _judged(text, what, first, second, target_scene, more=True)


def judged_no_more(text: str, what: str, first: np.ndarray, second: np.ndarray, target_scene: np.ndarray) -> Claim:
    """The claim that the first kind has no more of something: at most 2 % more than the second."""
    allowed = SAME * mean_estimate(second, target_scene).value if len(second) else 0.0
    return _judged(text, what, first, second, target_scene, allowed=allowed)


def _judged(
    text: str,
    what: str,
    first: np.ndarray,
    second: np.ndarray,
    target_scene: np.ndarray,
    *,
    more: bool = False,
    allowed: float = 0.0,
) -> Claim:
    if not len(first) or not len(second):
        return Claim(text, "undecided", "No complete runs.")
    found = difference(first, second, target_scene)
    evidence = _evidence(what, first, second, target_scene, found, more)
    return Claim(text, _side(-found if more else found, allowed), evidence)


def _side(found: Estimate, allowed: float) -> Verdict:
    if found.interval is None:
        return "undecided"
    low, high = found.interval
    if allowed == 0:
        return "holds" if high < 0 else "does not hold" if low > 0 else "undecided"
    return "holds" if high <= allowed else "does not hold" if low > allowed else "undecided"


def _evidence(
    what: str,
    first: np.ndarray,
    second: np.ndarray,
    target_scene: np.ndarray,
    found: Estimate,
    more: bool,
) -> str:
    means = [mean_estimate(scores, target_scene) for scores in (first, second)]
    pair = (second, first) if more else (first, second)
    word, likely = "more" if more else "fewer", probability_of_less(*pair, target_scene)
    return (
        f"{what}: {means[0]} against {means[1]}, difference {found}; probability that a run has {word}: {likely}; "
        f"{len(first)} and {len(second)} seeds."
    )
