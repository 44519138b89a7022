"""The four actions and headings, in the order of the published dumps (axis A everywhere)."""

from __future__ import annotations

from enum import IntEnum


class Action(IntEnum):
    """Column of a scene's graph."""

    MOVE_FORWARD = 0
    TURN_RIGHT = 1
    TURN_LEFT = 2
    MOVE_BACKWARD = 3


ACTION_COUNT = len(Action)
ACTION_NAMES = ("move forward", "turn right", "turn left", "move backward")
BLOCKED = -1  # in a graph: the move is blocked and the agent stays where it is
MOVES = (Action.MOVE_FORWARD, Action.MOVE_BACKWARD)
TURNS = (Action.TURN_RIGHT, Action.TURN_LEFT)
STOP = ACTION_COUNT
"""A fifth action, of environments that are asked for it: it ends the episode. No graph has it."""
