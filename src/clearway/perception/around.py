"""The places around a body of which eyes are taught whether it could stand there."""

from __future__ import annotations

PLACE_M = 0.5  # between neighbouring places
AHEAD_M = tuple(PLACE_M * step for step in range(7))
RIGHT_M = tuple(PLACE_M * step for step in range(-4, 5))
PLACES_M = tuple((ahead_m, right_m) for ahead_m in AHEAD_M for right_m in RIGHT_M)
"""Metres ahead of the body, and to its right."""
