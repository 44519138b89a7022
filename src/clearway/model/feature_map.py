"""The fixed affine map from a scene's features to the network's input.

Axis letters: S states, F features, R directions of a basis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor

from clearway.errors import RunError
from clearway.world.feature_store import BLOCK_ROWS, FEW_STATES, empty_store, mapped_store
from clearway.world.world import World

FITTED_STATES = 32_768  # states that a feature map is fitted to: evenly spaced ones, where there are more
SPANNED = 1e-5  # a direction counts where its singular value is at least this share of the largest


@dataclass(frozen=True, eq=False)
class FeatureMap:
    """x -> (x - mean) * factor, or ((x - mean) @ basis) * factor.

    Attributes:
        mean: (F,) float32.
        factor: scalar float32 tensor.
        basis: (F, R) float32; None for all features as they are.
    """

    mean: Tensor
    factor: Tensor
    basis: Tensor | None = None

    @classmethod
    def fitted(cls, features: Tensor, *, centre: bool, directions: int = 0, whiten: bool = False) -> FeatureMap:
        """The map for the features (S, F) of all states that will be learnt from.

        Args:
            features: float32.
            centre: move the mean to 0 and give the network's input a root mean square of 1, by one factor for all.
            directions: express features in their leading principal directions, at most so many, and drop the rest; 0
                keeps the features. S states span at most S directions: from there on nothing is lost, since a first
                layer's weight only ever grows along them.
            whiten: scale every principal direction down by the square root of 1 + its variance as a multiple of the
                features' average variance (damped zero-phase whitening; Bell & Sejnowski, 1997). What all pictures
                share no longer drowns what tells them apart, and nothing is blown up.
        """
        mean = features.mean(0) if centre else torch.zeros_like(features[0])
        basis = _basis(features - mean, directions, whiten)
        plain = cls(mean, features.new_ones(()), basis)
        if not centre:
            return plain
        spread = plain(features).square().mean().sqrt()
        return cls(mean, torch.where(spread > 0, 1 / spread.clamp_min(1e-12), torch.ones_like(spread)), basis)

    @property
    def feature_count(self) -> int:
        """F, features of a picture."""
        return len(self.mean)

    @property
    def input_count(self) -> int:
        """Numbers that the network sees of a picture: F, or R with a basis."""
        return self.feature_count if self.basis is None else self.basis.shape[1]

    def __call__(self, features: Tensor) -> Tensor:
        """The network's input (..., F), or (..., R) with a basis, for features (..., F)."""
        centred = features - self.mean
        return (centred if self.basis is None else centred @ self.basis) * self.factor

    def tensors(self) -> dict[str, Tensor]:
        """All that `from_tensors` needs."""
        found = {"mean": self.mean, "factor": self.factor, "basis": self.basis}
        return {name: tensor for name, tensor in found.items() if tensor is not None}

    @classmethod
    def from_tensors(cls, tensors: Mapping[str, Tensor]) -> FeatureMap:
        """The map that `tensors` was called of. Raises KeyError or ValueError where they are none's."""
        mean, factor, basis = tensors["mean"], tensors["factor"], tensors.get("basis")
        parts = (mean, factor) if basis is None else (mean, factor, basis)
        fits = mean.ndim == 1 and factor.ndim == 0 and (basis is None or (basis.ndim == 2 and len(basis) == len(mean)))
        if not fits or any(part.dtype != torch.float32 for part in parts):
            raise ValueError(f"no map: {', '.join(f'{part.dtype} of shape {tuple(part.shape)}' for part in parts)}")
        return cls(mean, factor, basis)


class FeatureSettings(Protocol):
    """What an algorithm's settings say about features, see `learn.learner.OnFeatures`."""

    @property
    def centre_features(self) -> bool:
        """See `FeatureMap.fitted`, as the others."""

    @property
    def whiten_features(self) -> bool:
        """As there."""

    @property
    def feature_basis(self) -> int:
        """Directions."""


def network_input(world: World, settings: FeatureSettings) -> tuple[FeatureMap, Tensor]:
    """What prepares the world's features for the network, and all of them prepared, see `prepared_features`.

    Raises:
        RunError: there are none, or some are not finite.
    """
    if world.features is None:
        raise RunError("the scenes have no features. Encode them first, for example with clearway scenes import")
    if not all_finite(world.features):
        raise RunError("the scenes' features hold NaN or Inf. Encode the scenes again")
    feature_map = fitted_features(world.features, settings)
    return feature_map, prepared_features(world, feature_map)


def fitted_features(features: Tensor, settings: FeatureSettings) -> FeatureMap:
    """The network's input for the features (S, F), as the settings have it; fitted to `FITTED_STATES` at most."""
    sample = evenly_spaced(features, FITTED_STATES)
    return FeatureMap.fitted(
        sample, centre=settings.centre_features, directions=settings.feature_basis, whiten=settings.whiten_features
    )


def prepared_features(world: World, feature_map: FeatureMap) -> Tensor:
    """The network's input for all states of a world with features, (S, F) or (S, R).

    Float32 for few states; with more than `FEW_STATES` in the world's own kind of store, block by block.
    """
    features = world.features
    assert features is not None
    if len(features) <= FEW_STATES:
        return feature_map(features.float())
    blocks = (feature_map(block.float()) for block in features.split(BLOCK_ROWS))
    size = len(features), feature_map.input_count
    if world.feature_store == "mapped" and world.device.type == "cpu":
        return mapped_store((block.numpy() for block in blocks), *size)
    prepared = empty_store(*size, world.feature_store, world.device)
    for rows, block in zip(prepared.split(BLOCK_ROWS), blocks, strict=True):
        rows.copy_(block)
    return prepared


def _basis(features: Tensor, directions: int, whiten: bool) -> Tensor | None:
    """The matrix (F, R) that centred features (S, F) are multiplied with; None for the identity."""
    if not whiten:
        return principal_directions(features, directions)[0].float() if directions else None
    found, squares = principal_directions(features, directions or features.shape[1])
    average = features.double().square().sum() / features.shape[1]
    gain = (squares / average.clamp_min(1e-300) + 1).rsqrt()
    if directions:
        return (found * gain).float()
    unscaled = torch.eye(features.shape[1], dtype=found.dtype, device=found.device)
    return (unscaled + (found * (gain - 1)) @ found.T).float()


def principal_directions(features: Tensor, most: int) -> tuple[Tensor, Tensor]:
    """The orthonormal directions in which features vary most, the largest first, and how much they vary.

    Directions that the features do not span are left out; one stays in any case.

    Args:
        features: (S, F) float32.
        most: how many are wanted.

    Returns:
        (F, R) float64, R <= most, and the features' squares added up along each, (R,) float64.
    """
    rows = features.double()
    states, count = rows.shape
    by_state = states < count  # the smaller of the two symmetric matrices has the same eigenvalues
    squares, vectors = torch.linalg.eigh(rows @ rows.T if by_state else rows.T @ rows)
    squares, vectors = squares.flip(0)[:most], vectors.flip(1)[:, :most]
    spanned = max(int((squares > SPANNED**2 * squares[0]).sum()), 1)
    vectors = vectors[:, :spanned]
    if by_state:
        vectors = rows.T @ vectors / squares[:spanned].clamp_min(1e-30).sqrt()
    return vectors.contiguous(), squares[:spanned].clamp_min(0)


def evenly_spaced(features: Tensor, most: int) -> Tensor:
    """At most so many rows of features (S, F), evenly spaced, float32; all of them where there are no more."""
    if len(features) <= most:
        return features.float()
    return features[torch.linspace(0, len(features) - 1, most, device=features.device).round().long()].float()


def all_finite(features: Tensor) -> bool:
    """No feature (S, F) is NaN or Inf."""
    blocks = features.split(BLOCK_ROWS) if features.numel() else ()
    return all(bool(torch.isfinite(torch.stack(torch.aminmax(block))).all()) for block in blocks)  # NaN is both
