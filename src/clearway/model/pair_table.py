"""`PairTable`: what is seen beside the target, of all poses and targets of a world, made once.

A comparison costs far more than the network that reads it, and there are fewer pairs than frames.

Axis letters: M targets, S states, D numbers that tell of a pair, B rows.
"""

from __future__ import annotations

import torch
from torch import Tensor

from clearway.model.recurrent import SeenPairs, Sighted, likeness
from clearway.world.streams import Streams
from clearway.world.world import World

FIT_PAIRS = 4096  # by which what is seen is standardised
BLOCK = 2048  # pairs that are compared at a time


class PairTable:
    """Rows for every sighting (row of features) in every target's scene, in half precision: 2 D bytes each.

    Args:
        world: with features that the eyes made.
        pairs: compares; standardised by pairs of this world's from now on.
        chance: draws those.
    """

    @torch.no_grad()
    def __init__(self, world: World, pairs: SeenPairs, chance: Streams) -> None:
        self._world = world
        offset = world.scene_offset * world.sightings
        sightings = torch.diff(offset)[world.target_scene]
        self._first, self._offset = offset[world.target_scene], sightings.cumsum(0) - sightings
        self._fit(pairs, chance)
        shape = (int(sightings.sum()), pairs.count)
        self._pairs = torch.empty(shape, dtype=torch.float16, device=world.device)
        width = pairs.eyes.shape.description_width
        self._descriptions = torch.empty(int(offset[-1]), width, device=world.device)
        done = 0
        for scene in torch.unique(world.target_scene).tolist():
            first, last = offset[scene : scene + 2].tolist()
            seen = self._sighted(pairs, torch.arange(first, last, device=world.device))
            self._descriptions[first:last] = seen.description
            wanted = pairs.sight(self._wanted(world.target_scene == scene))
            for target in range(len(wanted.tokens)):
                for part in torch.arange(len(seen.tokens), device=world.device).split(BLOCK):
                    told = pairs.compared(seen.rows(part), wanted.rows(torch.full_like(part, target)))
                    self._pairs[done : done + len(part)] = told.half()
                    done += len(part)

    @property
    def bytes(self) -> int:
        """Of memory."""
        return sum(table.numel() * table.element_size() for table in (self._pairs, self._descriptions))

    def __call__(self, target: Tensor, sighting: Tensor) -> Tensor:
        """(B, D) float32 of sightings (B,) beside targets (B,), int64 both."""
        return self._pairs[self._offset[target] + sighting - self._first[target]].float()

    def likeness(self, sighting: Tensor, before: Tensor) -> Tensor:
        """(B,) of sightings and those before, (B,) int64."""
        return likeness(self._descriptions[sighting], self._descriptions[before])

    def _sighted(self, pairs: SeenPairs, rows: Tensor) -> Sighted:
        parts = [pairs.sight(self._features(some)) for some in rows.split(BLOCK)]
        return Sighted(*(torch.cat(columns) for columns in zip(*parts, strict=True)))

    def _features(self, sighting: Tensor) -> Tensor:
        """(B, F) float32 of sightings (B,)."""
        assert self._world.features is not None
        return self._world.features[sighting].float()

    def _wanted(self, target: Tensor) -> Tensor:
        """(B, F) float32 of targets (B,) int64, or (M,) bool; they are seen in the scenes' own pictures."""
        return self._features(self._world.target_state[target] * self._world.sightings)

    def _fit(self, pairs: SeenPairs, chance: Streams) -> None:
        """Standardise what is seen by pairs of poses and targets drawn at random."""
        world = self._world
        target = (chance.uniform() * world.target_count).long()
        place = (chance.uniform() * world.start_count[target]).long()
        start = world.start_state[world.start_offset[target] + place]
        take = (chance.uniform() * world.sightings).long()
        pairs.fit(self._features(start * world.sightings + take), self._wanted(target))
