"""`PairTable`: what is seen beside the target, of all poses and targets of a world, made once.

A comparison costs far more than the network that reads it, and there are fewer pairs than frames.

Axis letters: M targets, S states, K takes of a pose (its own picture first), D numbers that tell of a pair, B rows.
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
    """Rows for every take of every state of every target's scene, in half precision: 2 D bytes each.

    Args:
        world: with features that the eyes made, and takes of them or none.
        pairs: compares; standardised by pairs of this world's from now on.
        chance: draws those.
    """

    @torch.no_grad()
    def __init__(self, world: World, pairs: SeenPairs, chance: Streams) -> None:
        self._world, self.takes = world, 1 if world.takes is None else 1 + world.takes.shape[1]
        offset = world.scene_offset
        states = torch.diff(offset)[world.target_scene]
        self._first, self._offset = offset[world.target_scene], states.cumsum(0) - states
        self._fit(pairs, chance)
        shape = (int(states.sum()) * self.takes, pairs.count)
        self._pairs = torch.empty(shape, dtype=torch.float16, device=world.device)
        width = pairs.eyes.shape.description_width
        self._descriptions = torch.empty(world.state_count * self.takes, width, device=world.device)
        done = 0
        for scene in torch.unique(world.target_scene).tolist():
            first, last = offset[scene : scene + 2].tolist()
            seen = self._sighted(pairs, torch.arange(first * self.takes, last * self.takes, device=world.device))
            self._descriptions[first * self.takes : last * self.takes] = seen.description
            wanted = pairs.sight(self._features(world.target_state[world.target_scene == scene] * self.takes))
            for target in range(len(wanted.tokens)):
                for part in torch.arange(len(seen.tokens), device=world.device).split(BLOCK):
                    told = pairs.compared(seen.rows(part), wanted.rows(torch.full_like(part, target)))
                    self._pairs[done : done + len(part)] = told.half()
                    done += len(part)

    @property
    def bytes(self) -> int:
        """Of memory."""
        return sum(table.numel() * table.element_size() for table in (self._pairs, self._descriptions))

    def __call__(self, target: Tensor, state: Tensor, take: Tensor) -> Tensor:
        """(B, D) float32 of takes (B,) of states (B,) beside targets (B,), int64 all."""
        return self._pairs[(self._offset[target] + state - self._first[target]) * self.takes + take].float()

    def likeness(self, seen: tuple[Tensor, Tensor], before: tuple[Tensor, Tensor]) -> Tensor:
        """(B,) of takes of states and those before, (state, take) each, (B,) int64."""
        now, then = (self._descriptions[state * self.takes + take] for state, take in (seen, before))
        return likeness(now, then)

    def _sighted(self, pairs: SeenPairs, rows: Tensor) -> Sighted:
        parts = [pairs.sight(self._features(some)) for some in rows.split(BLOCK)]
        return Sighted(*(torch.cat(columns) for columns in zip(*parts, strict=True)))

    def _features(self, row: Tensor) -> Tensor:
        """(B, F) float32 of rows (B,), takes of states: state * K + take."""
        assert self._world.features is not None
        state, take = row // self.takes, row % self.takes
        own = self._world.features[state].float()
        if self._world.takes is None:
            return own
        return torch.where((take == 0)[:, None], own, self._world.takes[state, (take - 1).clamp_min(0)].float())

    def _fit(self, pairs: SeenPairs, chance: Streams) -> None:
        """Standardise what is seen by pairs of poses and targets drawn at random."""
        world = self._world
        target = (chance.uniform() * world.target_count).long()
        place = (chance.uniform() * world.start_count[target]).long()
        start = world.start_state[world.start_offset[target] + place]
        take = (chance.uniform() * self.takes).long()
        pairs.fit(self._features(start * self.takes + take), self._features(world.target_state[target] * self.takes))
