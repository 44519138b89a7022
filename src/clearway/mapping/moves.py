"""Whether moves went through or were blocked, by the pictures before and after them, as evidence.

Axis letters: T pictures of a walk.
"""

from __future__ import annotations

import numpy as np

from clearway.mapping.again import ALWAYS, NEVER, UNKNOWN
from clearway.mapping.lattice import nearest_bins
from clearway.mapping.settings import MappingSettings
from clearway.mapping.sight import Sight
from clearway.mapping.walk import STEPS, Walk
from clearway.scenes.actions import Action

SURE_OF_MOVES = 1.5  # log-odds of a move, at most, before its outcome is seen
SAME, IF_SAME = 0.985, -7.0
"""Cosine of descriptions above which two pictures are the same, and evidence for a move where they are."""
IF_NOT_SAME = {NEVER: -1.0, UNKNOWN: 4.0, ALWAYS: 16.0}
"""Evidence for a move where they are not: where pictures repeat, a blocked move shows the same one again."""
EACH_AGAIN = 4.0
"""Further evidence likewise for every picture that came again, before it is held that all do."""
EYES_WEIGHT = 1.8
"""Of what eyes tell of a move. This, and what is evidence at `NEVER`, fits moves in perturbed rooms of `validation`."""
LEAST_OF_EYES = -3.0
"""Evidence for a move, at least, of eyes: of 15 moves in flats of `validation` they hold one for blocked."""


def _bins_ahead(ahead_m: float) -> np.ndarray:
    return nearest_bins(np.array(ahead_m), np.zeros(()), np.zeros(()))


(STAYED,) = _bins_ahead(0.0).tolist()


def moved_bins(settings: MappingSettings) -> dict[Action, np.ndarray]:
    """Of each move, bins in which the pose after it is, seen from the one before, where it went through."""
    return {action: _bins_ahead(steps * settings.step_m) for action, steps in STEPS.items()}


def evidence_for_move(evidence: np.ndarray, bins: np.ndarray, stayed: bool, repeats: int) -> float:
    """That a move went through.

    Args:
        evidence: (ELSEWHERE,), of eyes, for the pose after it.
        bins: of `moved_bins`.
        stayed: whether the picture after it is the same one.
        repeats: whether pictures do, see `again`.
    """
    told = EYES_WEIGHT * float(evidence[bins].mean() - evidence[STAYED])
    return max(told, LEAST_OF_EYES) + (IF_SAME if stayed else _if_not_same(repeats))


def evidence_for_moves(walk: Walk, sight: Sight, settings: MappingSettings) -> np.ndarray:
    """(T,) that the move before each picture went through, where pictures do not repeat; 0 where there was none."""
    told = np.zeros(len(walk.features))
    moving = np.flatnonzero(walk.step.any(axis=1))
    if len(moving):
        before, now = (walk.features[numbers].astype(np.float32) for numbers in (moving - 1, moving))
        same = (sight.description(before) * sight.description(now)).sum(axis=1) > SAME
        bins = moved_bins(settings)
        for number, evidence, stayed in zip(moving.tolist(), sight.whereabouts(before, now), same, strict=True):
            action = Action(int(walk.action[number - 1]))
            told[number] = SURE_OF_MOVES + evidence_for_move(evidence, bins[action], bool(stayed), NEVER)
    return told


def _if_not_same(repeats: int) -> float:
    """Evidence for a move after which the picture is another one."""
    if repeats < UNKNOWN:
        return IF_NOT_SAME[NEVER]
    return IF_NOT_SAME[ALWAYS] if repeats == ALWAYS else IF_NOT_SAME[UNKNOWN] + EACH_AGAIN * repeats
