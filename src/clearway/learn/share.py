"""A worker's share of a training: some scenes, with their environments, targets and heads of the network.

Scenes stay whole and are divided in their order, so that whatever belongs to a scene, state, target or environment is
divided likewise, and a worker's rows, one's after the other's, are those of one worker alone.

Axis letters: C scenes, S states, N environments, M targets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import torch
from torch import Tensor
from torch.nn import Parameter

from clearway.errors import RunError
from clearway.learn.peers import ALONE, Peers, divided
from clearway.learn.teacher import UNKNOWN
from clearway.model.feature_map import (
    FITTED_STATES,
    FeatureMap,
    FeatureSettings,
    all_finite,
    network_input,
    prepared_features,
)
from clearway.model.network import SiameseActorCritic, grad_of
from clearway.world.world import World

OWN_GRADIENTS = 6  # of a head, see `SiameseActorCritic.layer_gradients`
HEADS = ("scene_weight", "scene_bias", "output_weight", "output_bias")  # of the network, a row a head
Rows = Literal["scenes", "states", "targets", "envs"]
PARTS: dict[str, Rows] = {"navigation": "envs", "actions": "envs", "observed": "states", "choice": "scenes"}


@dataclass(frozen=True)
class Share:
    """What a worker has of all scenes.

    Attributes:
        states: (C,) int64, of every scene, also of those that other workers have.
        targets: (C,) number of targets of every scene.
        first, last: own scenes, last excluded.
        peers: the workers.
    """

    states: Tensor
    targets: tuple[int, ...]
    first: int
    last: int
    peers: Peers = ALONE

    @classmethod
    def whole(cls, world: World) -> Share:
        """All of a world."""
        targets = torch.bincount(world.target_scene, minlength=world.scene_count).tolist()
        return cls(torch.diff(world.scene_offset).cpu(), tuple(targets), 0, world.scene_count)

    @classmethod
    def of(cls, states: Sequence[int], targets: Sequence[int], peers: Peers) -> Share:
        """This worker's part of scenes with so many states and targets, divided by states.

        Raises:
            RunError: there are more workers than scenes.
        """
        check_scenes(len(states), peers.count)
        cuts = divided(states, peers.count)
        return cls(torch.tensor(states), tuple(targets), cuts[peers.rank], cuts[peers.rank + 1], peers)

    @property
    def own(self) -> slice:
        """Own scenes."""
        return slice(self.first, self.last)

    def network_input(self, world: World, settings: FeatureSettings) -> tuple[FeatureMap, Tensor]:
        """As `feature_map.network_input`, with a map that is fitted to the features of all workers' states.

        Raises:
            RunError: there are none, or some are not finite.
        """
        if self.peers.count == 1:
            return network_input(world, settings)
        if world.features is None or not all_finite(world.features):
            network_input(world, settings)  # says what is wrong
        assert world.features is not None
        count, first = int(self.states.sum()), int(self.states[: self.first].sum())
        rows = torch.arange(count * world.sightings)
        if len(rows) > FITTED_STATES:
            rows = torch.linspace(0, len(rows) - 1, FITTED_STATES).round().long()
        rows = rows - first * world.sightings
        rows = rows[(rows >= 0) & (rows < len(world.features))].to(world.device)
        feature_map = self._fitted(self.peers.joined(world.features[rows].float()), settings)
        return feature_map, prepared_features(world, feature_map)

    def _fitted(self, features: Tensor, settings: FeatureSettings) -> FeatureMap:
        """The map that the leader fits to features (S, F), given to all."""
        peers, directions = self.peers, -1
        if peers.leads:
            fitted = FeatureMap.fitted(
                features,
                centre=settings.centre_features,
                directions=settings.feature_basis,
                whiten=settings.whiten_features,
            )
            directions = -1 if fitted.basis is None else fitted.basis.shape[1]
        else:
            fitted = FeatureMap(features.new_empty(features.shape[1]), features.new_empty(()))
        directions = int(peers.told(directions)[0][0])
        basis = fitted.basis
        if basis is None and directions >= 0:
            basis = features.new_empty(features.shape[1], directions)
        if basis is not None:
            basis = peers.from_leader(basis.contiguous())
        return FeatureMap(peers.from_leader(fitted.mean), peers.from_leader(fitted.factor), basis)

    def own_network(self, network: SiameseActorCritic, heads_by_scene: bool) -> SiameseActorCritic:
        """The network with the heads of own scenes alone, where every scene has one."""
        if self.peers.count > 1 and heads_by_scene:
            network.shape = replace(network.shape, head_count=self.last - self.first)
            for name in HEADS:
                setattr(network, name, Parameter(getattr(network, name).data[self.own].clone()))
        return network

    def add_up_gradients(
        self,
        network: SiameseActorCritic,
        heads_by_scene: bool,
        siamese_weight: bool,
        sent_as: torch.dtype | None = None,
    ) -> tuple[int, Tensor | None]:
        """Add up over workers the gradients of the parameters that all of them have.

        Args:
            network: with gradients of this worker's rows, divided by how many rows all have.
            heads_by_scene: the heads are this worker's alone.
            siamese_weight: it has a gradient too.
            sent_as: dtype in which they are sent and added up; None: their own.

        Returns:
            what `clip_gradients` takes: how many gradients are own, the squares of everybody's own added up.
        """
        shared = [
            grad_of(parameter)
            for name, parameter in network.named_parameters()
            if not (heads_by_scene and name in HEADS) and (siamese_weight or name != "siamese_weight")
        ]
        if not heads_by_scene:
            self.peers.add_up(*shared, sent_as=sent_as)
            return 0, None
        squares = torch.stack([grad_of(getattr(network, name)).square().sum() for name in HEADS]).sum()
        self.peers.add_up(*shared, squares, sent_as=sent_as)
        return OWN_GRADIENTS * (self.last - self.first), squares

    def joined(self, tensors: dict[str, Tensor], heads_by_scene: bool, sightings: int) -> dict[str, Tensor]:
        """A trainer's tensors as one worker alone would have them, at the leader; empty rows elsewhere.

        Args:
            tensors: of this worker's trainer.
            heads_by_scene: whether the heads are divided too.
            sightings: of its world.
        """
        if self.peers.count == 1:
            return tensors
        whole = {}
        for name, tensor in tensors.items():
            tensor = self._numbered(name, tensor, sightings, 1)
            if name == "choice.weights":
                tensor = torch.nn.functional.pad(tensor, (0, max(self.targets) - tensor.shape[1]))
            divided_by = _divided_by(name, heads_by_scene)
            whole[name] = tensor if divided_by is None else self.peers.joined(tensor)
        return whole

    def own_part(
        self, tensors: dict[str, Tensor], envs: Sequence[int], heads_by_scene: bool, sightings: int
    ) -> dict[str, Tensor]:
        """What `joined` was called of, from what it gave; `envs`: environments of every scene (C,)."""
        if self.peers.count == 1:
            return tensors
        sizes = {"scenes": [1] * len(envs), "states": self.states.tolist(), "targets": self.targets, "envs": envs}
        found = {}
        for name, tensor in tensors.items():
            divided_by = _divided_by(name, heads_by_scene)
            if divided_by is not None:
                counts = sizes[divided_by]
                tensor = tensor[sum(counts[: self.first]) : sum(counts[: self.last])]
            if name == "choice.weights":
                tensor = tensor[:, : max(self.targets[self.own])]
            found[name] = self._numbered(name, tensor, sightings, -1)
        return found

    def _numbered(self, name: str, tensor: Tensor, sightings: int, sign: int) -> Tensor:
        """States and targets in the numbering of all workers' scenes (sign 1), or of the own ones (-1)."""
        states, targets = int(self.states[: self.first].sum()), sum(self.targets[: self.first])
        if name == "navigation.history":
            return tensor + sign * states * sightings
        if name == "navigation.target":
            return tensor + sign * targets
        if name == "observed.next_state":
            return torch.where(tensor == UNKNOWN, UNKNOWN, tensor + sign * states)
        return tensor


def check_scenes(scenes: int, workers: int) -> None:
    """Raise RunError where there are more workers than scenes."""
    if scenes < workers:
        raise RunError(f"{workers} workers for {scenes} scenes, which stay whole. Give fewer --workers")


def _divided_by(name: str, heads_by_scene: bool) -> Rows | None:
    """What the rows of a trainer's tensor belong to; None where every worker has the same."""
    part, _, rest = name.partition(".")
    if part == "statistics":
        return "envs" if rest.startswith("open_") else "targets"
    if part in ("network", "optimiser"):
        own = heads_by_scene and not rest.startswith("step.") and rest.rpartition(".")[2] in HEADS
        return "scenes" if own else None
    return PARTS.get(part)
