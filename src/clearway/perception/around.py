"""The places around a body of which eyes are taught whether it could stand there."""

from __future__ import annotations

AHEAD_M = tuple(0.5 * step for step in range(7))
RIGHT_M = tuple(0.5 * step for step in range(-4, 5))
PLACES_M = tuple((ahead_m, right_m) for ahead_m in AHEAD_M for right_m in RIGHT_M)
"""Metres ahead of the body, and to its right."""
