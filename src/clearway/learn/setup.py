"""What a trainer is made from, checked and made ready."""

from __future__ import annotations

from torch import Tensor

from clearway.errors import RunError
from clearway.learn.learner import OnFeatures
from clearway.learn.on_policy import OnPolicy
from clearway.learn.optimiser import Adam, Optimiser, SharedRMSProp
from clearway.model.feature_map import FeatureMap, prepared_features
from clearway.model.network import SiameseActorCritic
from clearway.world.feature_store import all_finite, evenly_spaced
from clearway.world.tables import World

FITTED_STATES = 32_768  # states that a feature map is fitted to: evenly spaced ones, where there are more
SEED_LIMIT = 1 << 31  # seeds of environments are seed * 2**32 + number, in 64 bits


def check_seed(seed: int) -> None:
    """Refuse seeds that the streams of random numbers cannot be made from.

    Raises:
        RunError: the seed is out of range.
    """
    if not 0 <= seed < SEED_LIMIT:
        raise RunError(f"seed is {seed}, expected 0 to {SEED_LIMIT - 1}. Give a seed in that range")


def network_input(world: World, learner: OnFeatures) -> tuple[FeatureMap, Tensor]:
    """What prepares the world's features for the network, and all of them prepared, see `prepared_features`.

    Raises:
        RunError: there are none, or some are not finite.
    """
    if world.features is None:
        raise RunError("the scenes have no features. Encode them first, for example with clearway scenes import")
    if not all_finite(world.features):
        raise RunError("the scenes' features hold NaN or Inf. Encode the scenes again")
    feature_map = fitted_features(world.features, learner)
    return feature_map, prepared_features(world, feature_map)


def fitted_features(features: Tensor, learner: OnFeatures) -> FeatureMap:
    """The network's input for the features (S, F), as the settings have it; fitted to `FITTED_STATES` at most."""
    sample = evenly_spaced(features, FITTED_STATES)
    return FeatureMap.fitted(
        sample, centre=learner.centre_features, directions=learner.feature_basis, whiten=learner.whiten_features
    )


def optimisers(network: SiameseActorCritic, learner: OnPolicy) -> tuple[Optimiser, Optimiser]:
    """Of the first layer's weight, and of all other parameters."""
    kind = Adam if learner.optimiser == "adam" else SharedRMSProp
    named = dict(network.named_parameters())
    siamese = {"siamese_weight": named.pop("siamese_weight")}
    return kind(siamese), kind(named)
