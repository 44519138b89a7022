"""`MappingSettings`: how an agent with a map weighs what it is told."""

from __future__ import annotations

from dataclasses import dataclass

from clearway.mapping.lattice import Lattice, lattice_of


@dataclass(frozen=True)
class MappingSettings:
    """How an agent with a map weighs what it is told.

    Attributes:
        step_m: how long a move is: between neighbouring cells of its lattice.
        side_m: of the lattice, which is as wide to all sides of where a walk begins.
        collision_cost: steps that a blocked move costs.
        usual_room: log-odds that a body can stand in a cell of which nothing was seen.
        standing_weight, target_weight, place_weight: of what eyes tell of cells, of the target, of the own pose. What
            they tell in neighbouring poses is not independent; of the target that is what `surest` is for.
        least_evidence: that the target is in a pose, nats, however often the eyes do not see it there.
        surest: so many times the evidence of one look is the most that many make of it: weak looks, however many, are
            not a strong one.
        nearby: steps that are added to every way, so that what is near is not everything.
        compared: pictures of a tour that a picture is compared with.
        arrived: probability of being at the target at which the agent says so.
    """

    step_m: float = 0.5
    side_m: float = 24.0
    collision_cost: float = 16.0
    usual_room: float = -1.0
    standing_weight: float = 0.4
    target_weight: float = 1.0
    place_weight: float = 0.6
    least_evidence: float = -5.0
    surest: float = 2.0
    nearby: float = 4.0
    compared: int = 8
    arrived: float = 0.5

    @property
    def lattice(self) -> Lattice:
        """Of its steps."""
        return lattice_of(self.step_m)

    @property
    def side(self) -> int:
        """G, cells along a side of its lattice."""
        return 2 * round(self.side_m / 2 / self.step_m) + 1
