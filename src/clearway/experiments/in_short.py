"""What a report answers, in ten lines at most."""

from __future__ import annotations

from collections.abc import Sequence
from typing import get_args

from clearway.experiments.section import Claim, Section, Verdict
from clearway.experiments.verdicts import LEAST_RUNS

MOST_LINES = 10
TOO_FEW = f"fewer than {LEAST_RUNS} complete runs of a kind decide nothing"
NAMED = 3  # claims of one verdict that a line names
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)


def is_judged(sections: Sequence[Section]) -> bool:
    """Whether any claim rests on enough runs to be judged at all."""
    return any(claim.judged for section in sections for claim in section.claims)


def in_short(sections: Sequence[Section]) -> tuple[str, ...]:
    """A line for each learner on the paper's claims, then one for each on further questions."""
    claims = [claim for section in sections for claim in section.claims]
    if not claims:
        return ()
    if not is_judged(sections):
        why = dict.fromkeys(section.unjudged or TOO_FEW for section in sections if section.claims)
        return (f"No claim is judged ({len(claims)} asked): {'; '.join(why)}. The tables hold what was measured.",)
    lines = []
    for further, whose in ((False, "the paper's claims"), (True, "further claims")):
        by_learner: dict[str, list[Claim]] = {}
        for claim in claims:
            if claim.further == further:
                by_learner.setdefault(claim.learner, []).append(claim)
        for learner, own in by_learner.items():
            about = f"{learner}, {whose}" if learner else whose.capitalize()
            lines.append(f"{about}. {_told(own)}")
    more = len(lines) - MOST_LINES
    return tuple(lines) if more <= 0 else (*lines[: MOST_LINES - 1], f"And {more + 1} more lines, below.")


def _told(claims: Sequence[Claim]) -> str:
    parts = []
    for verdict in VERDICTS:
        texts = [claim.told.removesuffix(".") for claim in claims if claim.verdict == verdict]
        if texts:
            more = f"; and {len(texts) - NAMED} more" if len(texts) > NAMED else ""
            parts.append(f"{verdict.capitalize()} ({len(texts)}): {'; '.join(texts[:NAMED])}{more}.")
    return " ".join(parts)
