"""What a walk tells of a room: where a body can stand, where the agent is, where the target's picture was taken.

`lattice` (poses a step apart), `sight` (what eyes tell of pictures, as evidence; `eyes_sight` by PyTorch), `room_map`
(what is known of a room; `map_files`), `beliefs` (where the agent and the target may be), `routes` (the cheapest ways).
"""
