"""What a step earns: named terms, the reward that they make up, and rewards by name.

The folder is light, so that the command line can read names and parameters from it.
"""

from clearway.reward.named import reward_named
from clearway.reward.reward import BUMP, CLEARANCE, COLLISION_AWARE, REWARDS, SHORTEST, Reward
from clearway.reward.terms import (
    TERM_OF,
    TERMS,
    Arrival,
    Bump,
    Clearance,
    Moves,
    RewardError,
    Term,
    Time,
    UnknownTerm,
    Zones,
    in_order,
    parameter,
)

__all__ = [
    "BUMP",
    "CLEARANCE",
    "COLLISION_AWARE",
    "REWARDS",
    "SHORTEST",
    "TERMS",
    "TERM_OF",
    "Arrival",
    "Bump",
    "Clearance",
    "Moves",
    "Reward",
    "RewardError",
    "Term",
    "Time",
    "UnknownTerm",
    "Zones",
    "in_order",
    "parameter",
    "reward_named",
]
