"""What the groups of a room's geoms mean (MuJoCo shows and hides geoms by group)."""

CEILING_GROUP = 1  # the ceiling and what hangs from it: in the agent's pictures, not in the view from above
SEEN_GROUP = 2  # everything else that one sees
OBSTACLE_GROUP = 3  # the shapes that the agent collides with, never seen

SHELL_NAME = "shell"  # the names of obstacles that belong to the building begin with this
PIECE_NAME = "piece"  # what belongs to one piece of furniture is called so, with its number
