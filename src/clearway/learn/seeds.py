"""Seeds of trainings, and which can be one."""

from __future__ import annotations

from clearway.errors import RunError

SEED_LIMIT = 1 << 31  # seeds of environments are seed * 2**32 + number, in 64 bits


def check_seed(seed: int) -> None:
    """Refuse seeds that the streams of random numbers cannot be made from.

    Raises:
        RunError: the seed is out of range.
    """
    if not 0 <= seed < SEED_LIMIT:
        raise RunError(f"seed is {seed}, expected 0 to {SEED_LIMIT - 1}. Give a seed in that range")
