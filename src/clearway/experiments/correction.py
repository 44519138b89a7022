"""Verdicts corrected for the number of claims that a learner's table makes (Holm, Scand. J. Statistics 6(2), 1979).

Of twenty claims that say nothing one is told by chance at 5 %. Holm's rule holds that chance at 5 % for all claims of
a section about one learner together: of m claims the i-th smallest p, times m + 1 - i, is to be 5 % at most, and so
are all before it. The learner is what stands before a colon; who writes more there, as `off-grid` does, has families of
its own. Claims that name none are together, too. Claims whose runs are not there yet count, so that no verdict is taken
back when they come.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from decimal import Decimal

from clearway.experiments.section import Claim, Section

LEVEL = 0.05


def corrected(section: Section) -> Section:
    """The section; what was decided by a claim's own interval alone is undecided, and its evidence says so."""
    claims = list(section.claims)
    families: dict[str, list[int]] = {}
    for number, claim in enumerate(claims):
        families.setdefault(claim.learner, []).append(number)
    for numbers in families.values():
        told = [claims[number].p for number in numbers]
        for number, own, p in zip(numbers, told, holm([1.0 if p is None else p for p in told]), strict=True):
            if own is not None:
                claims[number] = _judged_again(claims[number], p, len(numbers))
    return replace(section, claims=tuple(claims))


def not_judged(section: Section, why: str, evidence: str) -> Section:
    """The section without verdicts.

    Args:
        section: with claims.
        why: as a section's `unjudged` says it.
        evidence: a sentence, behind each claim's own.
    """
    claims = (
        replace(claim, verdict="undecided", p=None, counted=False, evidence=f"{claim.evidence} {evidence}".strip())
        for claim in section.claims
    )
    return replace(section, claims=tuple(claims), unjudged=why)


def holm(p: Sequence[float]) -> list[float]:
    """Corrected p of each claim, 1 at most."""
    found, largest = [0.0] * len(p), 0.0
    for rank, number in enumerate(sorted(range(len(p)), key=p.__getitem__)):
        largest = max(largest, min(1.0, (len(p) - rank) * p[number]))
        found[number] = largest
    return found


def _judged_again(claim: Claim, p: float, claims: int) -> Claim:
    assert claim.p is not None, "what has no p is not corrected"
    told = f"{claim.evidence} Permutation test: p = {_text(claim.p)}, for {claims} claims {_text(p)} (Holm)."
    if claim.verdict == "undecided" or p <= LEVEL:
        return replace(claim, evidence=told)
    return replace(claim, verdict="undecided", evidence=f"{told} By itself: {claim.verdict}.")


def _text(p: float) -> str:
    """To two significant digits, without an exponent."""
    return f"{Decimal(f'{p:.2g}'):f}"
