"""What a user asks to be perturbed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from clearway.errors import ArgumentError
from clearway.live.conditions import Perturbations

Perturbed: TypeAlias = str | Sequence[str] | Perturbations
"""What is perturbed: words, "geometry light=0.2" or ("geometry", "light=0.2"), or strengths."""


def perturbations_asked(perturb: Perturbed) -> Perturbations:
    """The perturbations asked for. Raises ArgumentError where there are none of that name, or of that strength."""
    from clearway.errors import EnvError
    from clearway.live.words import perturbations_named
    from clearway.live_envs.arguments import checked_perturbations

    if isinstance(perturb, Perturbations):
        try:
            return checked_perturbations(perturb)
        except EnvError as fault:
            raise ArgumentError(f"perturb: {fault}") from fault
    return perturbations_named(perturb.split() if isinstance(perturb, str) else perturb)
