"""The map from features to the network's input."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from clearway.choices import FeatureStore
from clearway.model import feature_map
from clearway.model.feature_map import (
    FeatureMap,
    all_finite,
    evenly_spaced,
    prepared_features,
    principal_directions,
)
from helpers.small_runs import small_world


def drawn(states: int, count: int, seed: int = 0) -> Tensor:
    """Features whose directions vary differently, off centre."""
    rows = torch.randn(states, count, generator=torch.Generator().manual_seed(seed))
    return rows * torch.linspace(3, 0.5, count) + torch.arange(count)


def inner_products(rows: Tensor) -> Tensor:
    return rows @ rows.T


def test_centred_features_have_mean_0_and_rms_1() -> None:
    features = drawn(50, 6)
    prepared = FeatureMap.fitted(features, centre=True)(features)
    assert prepared.mean(0).abs().max() < 1e-5
    assert prepared.square().mean().item() == pytest.approx(1, rel=1e-5)
    ratio = (features - features.mean(0)) / prepared
    assert torch.allclose(ratio, ratio[0, 0].expand_as(ratio), rtol=1e-4)  # one factor for all features


def test_constant_features_and_features_left_alone() -> None:
    constant = torch.full((4, 3), 2.5)
    assert torch.equal(FeatureMap.fitted(constant, centre=True)(constant), torch.zeros(4, 3))
    assert torch.equal(FeatureMap.fitted(constant, centre=False)(constant), constant)
    assert FeatureMap.fitted(constant, centre=True, directions=2).input_count == 1


@pytest.mark.parametrize("states", [20, 200])
def test_a_basis_of_all_directions_keeps_every_inner_product(states: int) -> None:
    features = drawn(states, 60)
    whole = FeatureMap.fitted(features, centre=True)
    basis = FeatureMap.fitted(features, centre=True, directions=500)
    assert basis.input_count == min(states - 1, 60)  # centred rows span one direction fewer
    prepared = basis(features)
    assert prepared.square().mean().item() == pytest.approx(1, rel=1e-5)
    expected = inner_products(whole(features)) * (basis.factor / whole.factor) ** 2
    assert torch.allclose(inner_products(prepared), expected, atol=1e-4 * expected.abs().max())


def test_uncentred_features_keep_their_inner_products_too() -> None:
    features = drawn(20, 60)
    prepared = FeatureMap.fitted(features, centre=False, directions=60)(features)
    assert prepared.shape == (20, 20)
    assert torch.allclose(inner_products(prepared), inner_products(features), rtol=1e-4)


def test_the_leading_directions_are_those_of_most_variance() -> None:
    features = torch.zeros(8, 5)
    features[:, 3] = torch.tensor([1.0, -1] * 4) * 10
    features[:, 1] = torch.tensor([1.0, 1, -1, -1] * 2)
    directions, squares = principal_directions(features, 1)
    assert squares.tolist() == pytest.approx([800])
    assert torch.allclose(directions[:, 0].abs().float(), torch.eye(5)[3])
    assert torch.allclose(principal_directions(features, 5)[0].abs().float(), torch.eye(5)[[3, 1]].T)


@pytest.mark.parametrize(("states", "count"), [(200, 12), (8, 12)])
def test_whitening_scales_each_direction_by_its_own_variance(states: int, count: int) -> None:
    features = drawn(states, count)
    centred = (features - features.mean(0)).double()
    variances, directions = torch.linalg.eigh(centred.T @ centred)
    gains = 1 / (variances.clamp_min(0) / (variances.sum() / count) + 1).sqrt()
    expected = centred @ directions @ torch.diag(gains) @ directions.T
    fitted = FeatureMap.fitted(features, centre=True, whiten=True)
    assert torch.allclose(fitted(features) / fitted.factor, expected.float(), atol=1e-3)
    assert fitted(features).square().mean().item() == pytest.approx(1, rel=1e-4)
    spread = torch.linalg.svdvals(fitted(features).double())
    before = torch.linalg.svdvals(centred)
    rank = min(states - 1, count)
    assert spread[0] / spread[rank - 1] < before[0] / before[rank - 1]


@pytest.mark.parametrize("states", [20, 200])
def test_a_whitened_basis_of_all_directions_keeps_every_whitened_inner_product(states: int) -> None:
    features = drawn(states, 60)
    whole = FeatureMap.fitted(features, centre=True, whiten=True)
    basis = FeatureMap.fitted(features, centre=True, directions=60, whiten=True)
    expected = inner_products(whole(features)) * (basis.factor / whole.factor) ** 2
    assert torch.allclose(inner_products(basis(features)), expected, atol=1e-4 * expected.abs().max())


def test_whitening_leaves_constant_features_alone() -> None:
    constant = torch.full((4, 3), 2.5)
    assert torch.equal(FeatureMap.fitted(constant, centre=True, whiten=True)(constant), torch.zeros(4, 3))


def test_the_map_survives_its_tensors() -> None:
    features = drawn(12, 9)
    for directions, whiten in ((0, False), (4, False), (0, True), (4, True)):
        fitted = FeatureMap.fitted(features, centre=True, directions=directions, whiten=whiten)
        again = FeatureMap.from_tensors(fitted.tensors())
        assert torch.equal(again(features), fitted(features))
        assert (again.feature_count, again.input_count) == (9, directions or 9)


@pytest.mark.parametrize("store", ["memory", "float16", "mapped"])
def test_features_of_many_states_are_prepared_block_by_block(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, store: FeatureStore
) -> None:
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path))
    world = replace(small_world(), feature_store=store)
    fitted = FeatureMap.fitted(world.features, centre=True, directions=5)
    whole = prepared_features(world, fitted)
    assert torch.equal(whole, fitted(world.features))
    monkeypatch.setattr(feature_map, "FEW_STATES", 3)
    monkeypatch.setattr(feature_map, "BLOCK_ROWS", 7)
    blocks = prepared_features(world, fitted)
    assert blocks.dtype == (torch.float16 if store == "float16" else torch.float32)
    tolerance = 2e-3 if store == "float16" else 1e-5
    assert torch.allclose(blocks.float(), whole, atol=tolerance, rtol=tolerance)


def test_evenly_spaced_rows() -> None:
    features = torch.arange(10.0)[:, None].half()
    assert evenly_spaced(features, 4)[:, 0].tolist() == [0, 3, 6, 9]
    assert evenly_spaced(features, 4).dtype == torch.float32
    assert torch.equal(evenly_spaced(features, 10), features.float())


def test_one_feature_that_is_not_finite_is_found() -> None:
    features = torch.zeros(20_000, 2)
    assert all_finite(features)
    features[19_999, 1] = np.inf
    assert not all_finite(features)
