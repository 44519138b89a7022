"""Names that a user chooses from, in a module without imports so that the command line reads them cheaply."""

from typing import Literal

RewardName = Literal["collision-aware", "shortest", "bump"]
"""See `clearway.reward.REWARDS`."""

ZoneLevel = Literal["pose", "cell"]
"""See `clearway.zones`."""

RoomName = Literal["bathroom", "bedroom", "living_room", "kitchen"]
"""See `clearway.scenes.rooms`."""
