"""`World`: the look-up tables of a scene set, and the targets that are walked to in it.

States of all scenes share one numbering. Tables are made once; `World.with_targets` gives them other targets and shares
everything else.

Axis letters: S states of all scenes, A actions, F features, M targets, C scenes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from clearway.choices import FeatureStore, ZoneLevel
from clearway.clearance import scene_clearance_m
from clearway.errors import SceneError
from clearway.reward import Moves
from clearway.scenes.actions import BLOCKED
from clearway.scenes.graph import UNREACHABLE, next_states
from clearway.scenes.scene import EncoderRecord, Scene
from clearway.scenes.targets import possible_targets
from clearway.world.feature_store import joined_features
from clearway.world.targets import NO_TARGETS, WalkedScene, target_tables
from clearway.zones import scene_zones


class Steps(NamedTuple):
    """How a scene is walked in.

    Attributes:
        name: of the scene.
        cell_size_m: length of a move.
        turn_deg: angle of a turn.
    """

    name: str
    cell_size_m: float
    turn_deg: float


@dataclass(frozen=True, eq=False)
class World:
    """Tables of a scene set; all tensors on one device.

    Attributes:
        scene_names: name of each scene.
        scene_offset: (C + 1,) int64, first state of each scene, and S at the end.
        next_state: (S, A) int64; a blocked move leads back to its own state.
        blocked: (S, A) bool.
        zone: (S,) int64 (`zones.Zone`).
        clearance_m: (S,) float64, distance to the nearest obstacle, see `clearance`.
        largest_part: (C,) int64, states of each scene's largest strongly connected component.
        features: (S, F) float32, or as `feature_store` says; None where the scenes have none.
        may_be_target: (S,) bool, whether a target may be drawn there: in its scene's largest component, not held out.
        target_state: (M,) int64, in the numbering of all scenes.
        target_scene: (M,) int64, ascending.
        start_state: (K,) int64, for target after target all states from which it can be reached, itself excluded.
        start_steps: (K,) int64, the shortest-path distance of each of those starts.
        start_offset, start_count: (M,) int64, where a target's starts lie in `start_state`.
        steps: how long the moves and turns of each scene are.
        feature_store: where features are kept, see there.
        encoder: the record of what made the features; None where the scenes have none, or do not say.
        sightings: pictures of a pose that features are kept of. Features are (S * sightings, F), a pose's one after the
            other, that of the scene's own picture first.
    """

    scene_names: tuple[str, ...]
    scene_offset: Tensor
    next_state: Tensor
    blocked: Tensor
    zone: Tensor
    clearance_m: Tensor
    largest_part: Tensor
    features: Tensor | None
    may_be_target: Tensor
    target_state: Tensor
    target_scene: Tensor
    start_state: Tensor
    start_steps: Tensor
    start_offset: Tensor
    start_count: Tensor
    steps: tuple[Steps, ...] = ()
    feature_store: FeatureStore = "memory"
    encoder: EncoderRecord | None = None
    sightings: int = 1

    @property
    def scene_count(self) -> int:
        """C."""
        return len(self.scene_names)

    @property
    def target_count(self) -> int:
        """M."""
        return len(self.target_state)

    @property
    def state_count(self) -> int:
        """S."""
        return len(self.next_state)

    @property
    def device(self) -> torch.device:
        """Where the tables lie."""
        return self.next_state.device

    def distance_table(self) -> DistanceTable:
        """Steps from states to targets, to be looked up."""
        return DistanceTable(self)

    def moves(self) -> Moves:
        """What a reward's terms look at, which they cannot write to."""
        tables = [table.cpu().numpy().view() for table in (self.next_state, self.blocked, self.zone, self.clearance_m)]
        for table in tables:
            table.flags.writeable = False
        return Moves(*tables)

    def graph(self, scene: int) -> np.ndarray:
        """Moves of one scene in its own numbering, (S of the scene, A) int64; -1 where one is blocked."""
        first, last = self.scene_offset[scene : scene + 2].tolist()
        onward = (self.next_state[first:last] - first).cpu().numpy()
        return np.where(self.blocked[first:last].cpu().numpy(), BLOCKED, onward)

    def with_targets(self, targets: Mapping[str, Sequence[int]]) -> World:
        """The same tables, shared, with other targets; scenes that are not named have none.

        Args:
            targets: state ids by scene name, in the scene's own numbering; at least one.

        Raises:
            SceneError: a scene is not there, or a target is no state id, out of range, repeated or out of reach.
        """
        _check_names(self.scene_names, targets)
        walked = [self._walked(index) for index, name in enumerate(self.scene_names) if name in targets]
        found = target_tables(walked, targets).items()
        tables: dict[str, Any] = {name: torch.from_numpy(table).to(self.device) for name, table in found}
        return replace(self, **tables)

    def with_takes(self, takes: Sequence[np.ndarray]) -> World:
        """The same tables, with features of takes of each scene's poses, (S, K, F) float32, beside its own."""
        assert self.features is not None and self.sightings == 1
        taken = torch.from_numpy(np.concatenate(takes)).to(self.features)
        rows = torch.cat([self.features[:, None], taken], 1).flatten(0, 1)
        return replace(self, features=rows, sightings=1 + taken.shape[1])

    def pose(self, sighting: Tensor) -> Tensor:
        """States (...) int64 of rows of features (...) int64."""
        return sighting if self.sightings == 1 else sighting // self.sightings

    def _walked(self, index: int) -> WalkedScene:
        first = int(self.scene_offset[index])
        return WalkedScene(index, self.scene_names[index], self.graph(index), first, int(self.largest_part[index]))

    def scene_state(self, target: int) -> int:
        """The target's state in its own scene's numbering."""
        return int(self.target_state[target] - self.scene_offset[self.target_scene[target]])

    def to(self, device: torch.device | str) -> World:
        """The same tables on another device."""
        moved = {f.name: getattr(self, f.name) for f in fields(self)}
        moved = {name: value.to(device) for name, value in moved.items() if isinstance(value, Tensor)}
        return replace(self, **moved)


class DistanceTable:
    """Steps from states to targets. Only a target's own scene is kept, not all S states for each of the M targets.

    Args:
        world: the tables.
    """

    def __init__(self, world: World) -> None:
        states = torch.diff(world.scene_offset)[world.target_scene]  # (M,) of the target's scene
        self._first, self._states = world.scene_offset[world.target_scene], states
        self._offset = states.cumsum(0) - states
        self._steps = torch.full((int(states.sum()),), UNREACHABLE, dtype=torch.int32, device=world.device)
        target = torch.repeat_interleave(torch.arange(world.target_count, device=world.device), world.start_count)
        self._steps[(self._offset - self._first)[target] + world.start_state] = world.start_steps.int()
        self._steps[self._offset + world.target_state - self._first] = 0

    def __getitem__(self, index: tuple[Tensor | int, Tensor | int]) -> Tensor:
        """Steps (...) int64 to targets (...) from states (...), int64 both: 0 at the target, -1 without a path."""
        target, state = index
        place = state - self._first[target]
        inside = (place >= 0) & (place < self._states[target])
        steps = self._steps[torch.where(inside, self._offset[target] + place, 0)]
        return torch.where(inside, steps, UNREACHABLE).long()


def make_world(
    scenes: Sequence[Scene],
    targets: Mapping[str, Sequence[int]] | None,
    zone_level: ZoneLevel = "pose",
    feature_store: FeatureStore = "memory",
) -> World:
    """The tables of some scenes, with targets in each of them.

    Args:
        scenes: scenes with distinct names.
        targets: state ids of each scene's targets by scene name, in the scene's own numbering; None: no targets.
        zone_level: whether zones are those of poses or of cells.
        feature_store: where to keep the features; features that lie in files are read scene by scene.

    Raises:
        SceneError: names repeat, a scene has no target, targets are given for a scene that is not there, a target is
            no state id, out of range, repeated or out of reach, or the scenes' features do not belong together or fit
            the store.
        RunError: there is no room for the features.
    """
    names = tuple(scene.name for scene in scenes)
    check_distinct(names)
    largest = [int(np.count_nonzero(scene.components == 0)) for scene in scenes]
    offset = np.concatenate([[0], np.cumsum([scene.state_count for scene in scenes])]).astype(np.int64)
    graph = np.concatenate([_shifted(scene.graph, first) for scene, first in zip(scenes, offset, strict=False)])
    if targets is None:
        found = NO_TARGETS
    else:
        _check_names(names, targets)
        walked = [
            WalkedScene(index, scene.name, scene.graph, int(offset[index]), largest[index])
            for index, scene in enumerate(scenes)
        ]
        found = target_tables(walked, targets)  # before features are read, which may take long
    tables: dict[str, Any] = {name: torch.from_numpy(table) for name, table in found.items()}
    return World(
        scene_names=names,
        scene_offset=torch.from_numpy(offset),
        next_state=torch.from_numpy(next_states(graph)),
        blocked=torch.from_numpy(graph == BLOCKED),
        largest_part=torch.tensor(largest),
        features=joined_features(scenes, feature_store),
        may_be_target=torch.from_numpy(np.concatenate([_may_be_target(scene) for scene in scenes])),
        steps=tuple(Steps(scene.name, scene.cell_size_m, scene.turn_deg) for scene in scenes),
        feature_store=feature_store,
        encoder=scenes[0].encoder if scenes else None,
        zone=torch.from_numpy(np.concatenate([scene_zones(s, zone_level) for s in scenes]).astype(np.int64)),
        clearance_m=torch.from_numpy(np.concatenate([scene_clearance_m(scene) for scene in scenes])),
        **tables,
    )


def scene_tables(
    scenes: Sequence[Scene], zone_level: ZoneLevel = "pose", feature_store: FeatureStore = "memory"
) -> World:
    """The tables of some scenes, without targets; arguments and errors as of `make_world`."""
    return make_world(scenes, None, zone_level, feature_store)


def _may_be_target(scene: Scene) -> np.ndarray:
    possible = np.zeros(scene.state_count, bool)
    possible[possible_targets(scene)] = True
    return possible


def _shifted(graph: np.ndarray, first: int) -> np.ndarray:
    return np.where(graph == BLOCKED, BLOCKED, graph.astype(np.int64) + first)


def check_distinct(names: Sequence[str]) -> None:
    """Raise SceneError where two scenes have one name."""
    for name, count in Counter(names).items():
        if count > 1:
            raise SceneError(name, "two scenes have this name", "Rename one of the files")


def _check_names(names: Sequence[str], targets: Mapping[str, Sequence[int]]) -> None:
    unknown = set(targets).difference(names)
    for name in targets:
        if name in unknown:
            problem = "targets are given for this scene, which is not among the scenes"
            raise SceneError(name, problem, f"Name targets of {', '.join(names)} alone, or add the scene")
