"""The colours of every map and figure, in one place; chosen to stay apart for colour-blind readers.

Collision is dark and precollision light, so the two also differ in print and without hue; maps hatch collision as well.
"""

from __future__ import annotations

ZONE_COLOURS = {"free": "#f4f4f1", "precollision": "#f6b73c", "collision": "#c1272d"}
"""Fill of each zone (`zones.ZONE_NAMES`)."""

INK = "#22272e"
"""Text and outlines."""
FAINT_INK = "#6b7480"
"""Captions and secondary lines."""
PAPER = "#ffffff"
"""Background of figures."""
WALL = "#3f4650"
"""What is no cell, on maps without a picture from above."""
AGENT = "#0b3d91"
"""The agent."""
PATH = "#2f7de1"
"""The path so far."""
TARGET = "#00876c"
"""The target."""
BUMP = "#22272e"
"""A blocked move."""
