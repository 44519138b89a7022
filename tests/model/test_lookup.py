"""`LookupNetwork` against plain autograd on `SiameseActorCritic`, which defines what it computes.

Everything holds in small worlds and in large ones, where the first layer is computed otherwise, see `first_layer`.
"""

from collections.abc import Iterator

import pytest
import torch
from torch import Tensor

from clearway.model import lookup as lookup_module
from clearway.model.lookup import LookupNetwork, projects_all
from clearway.model.network import NetworkShape, SiameseActorCritic

STATES, FEATURES, WIDTH, HISTORY = 30, 11, 14, 4
FIRST_STATE = (0, 10, 22, 30)  # three scenes
TARGET_STATE = (3, 9, 15, 25, 25)  # two targets are the same pose
TARGET_SCENE = (0, 0, 1, 2, 2)


@pytest.fixture(autouse=True, params=["few", "many"])
def world_size(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is computed of all states and targets while they are few is computed of those that occur in large worlds."""
    if request.param == "many":
        monkeypatch.setattr(lookup_module, "FEW_STATES", STATES - 1)
        monkeypatch.setattr(lookup_module, "FEW_TARGETS", len(TARGET_STATE) - 1)


@pytest.fixture
def float64() -> Iterator[None]:
    torch.set_default_dtype(torch.float64)
    yield
    torch.set_default_dtype(torch.float32)


def made_network(
    seed: int = 0, heads: int = 3, dtype: torch.dtype | None = None
) -> tuple[SiameseActorCritic, LookupNetwork]:
    network = SiameseActorCritic(NetworkShape(heads, FEATURES, WIDTH, HISTORY), seed)
    with torch.no_grad():  # larger weights, so that ReLUs cut and every path carries a gradient
        for parameter in network.parameters():
            parameter.mul_(2)
    features = torch.randn(STATES, FEATURES, generator=torch.Generator().manual_seed(seed + 100))
    return network, LookupNetwork(network, features, torch.tensor(TARGET_STATE), dtype)


def test_a_gpu_projects_all_states_unless_they_are_many() -> None:
    few, cpu, gpu = lookup_module.FEW_STATES, torch.device("cpu"), torch.device("cuda")
    cases = [(few, None, cpu), (few, few, cpu), (few, few - 1, cpu), (few, few - 1, gpu), (few + 1, few + 2, gpu)]
    assert [projects_all(*case) for case in cases] == [True, True, False, True, False]


def made_rows(rows_per_scene: tuple[int, ...], any_target: bool, seed: int = 0) -> tuple[Tensor, Tensor, Tensor]:
    """Histories (B, K), targets (B,), scenes (B,), ordered by scene; states and whole histories repeat."""
    rng = torch.Generator().manual_seed(seed)
    history, target, scene = [], [], []
    for number, count in enumerate(rows_per_scene):
        first, last = FIRST_STATE[number], FIRST_STATE[number + 1]
        rows = torch.randint(first, last, (count, HISTORY), generator=rng)
        rows[1::3] = rows[1::3, -1:]  # the agent stood still
        rows[2::4] = rows[:1]
        own = [m for m, s in enumerate(TARGET_SCENE) if any_target or s == number]
        history.append(rows)
        target.append(torch.tensor(own)[torch.randint(len(own), (count,), generator=rng)])
        scene.append(torch.full((count,), number))
    return torch.cat(history), torch.cat(target), torch.cat(scene)


CASES = [((17, 9, 23), False), ((17, 0, 9), False), ((0, 0, 1), False), ((12, 12, 12), True)]


def largest_difference_from_autograd(rows_per_scene: tuple[int, ...], any_target: bool, heads: int = 3) -> float:
    """Of scores, values and, as a share of their largest, every parameter's gradient."""
    network, lookup = made_network(heads=heads)
    history, target, scene = made_rows(rows_per_scene, any_target)
    kept = lookup.forward(history, target, rows_per_scene)
    grad_output = torch.randn(len(history), 5, generator=torch.Generator().manual_seed(5))
    for parameter in network.parameters():
        parameter.grad.fill_(torch.nan)  # whatever was there before must not stay
    lookup.backward(history, target, rows_per_scene, kept, grad_output)
    lookup.siamese_gradient()
    found = {name: parameter.grad.clone() for name, parameter in network.named_parameters()}

    features = lookup.first_layer.features
    scores, value = network(features[history], features[lookup.target_state][target], scene)
    differences = [(kept.scores - scores).abs().max(), (kept.value - value).abs().max()]
    network.zero_grad()
    (scores * grad_output[:, :4]).sum().add((value * grad_output[:, 4]).sum()).backward()
    for name, parameter in network.named_parameters():
        largest = parameter.grad.abs().max().clamp_min(1e-3)
        differences.append((found[name] - parameter.grad).abs().max() / largest)
    return torch.stack(differences).max().item()  # NaN if anything is NaN


@pytest.mark.parametrize(("rows_per_scene", "any_target"), CASES)
def test_outputs_and_every_gradient_equal_autograd_s(rows_per_scene: tuple[int, ...], any_target: bool) -> None:
    assert largest_difference_from_autograd(rows_per_scene, any_target) < 1e-5


@pytest.mark.parametrize(("rows_per_scene", "any_target"), CASES)
def test_so_they_do_where_all_scenes_share_a_head(rows_per_scene: tuple[int, ...], any_target: bool) -> None:
    assert largest_difference_from_autograd(rows_per_scene, any_target, heads=1) < 1e-5


@pytest.mark.usefixtures("float64")
@pytest.mark.parametrize(("rows_per_scene", "any_target"), CASES)
def test_in_float64_they_agree_to_rounding(rows_per_scene: tuple[int, ...], any_target: bool) -> None:
    assert largest_difference_from_autograd(rows_per_scene, any_target) < 1e-13


@pytest.mark.usefixtures("float64")
def test_rows_that_share_a_history_are_as_they_are_by_themselves() -> None:
    network, lookup = made_network()
    history, _, _ = made_rows((3, 0, 4), False)
    history_of = torch.tensor([0, 0, 1, 2, 2, 2, 3, 4, 4, 5, 6, 6])
    target, rows_per_scene = torch.tensor([0, 1, 1, 0, 1, 1, 3, 3, 4, 3, 3, 4]), (6, 0, 6)
    grad_output = torch.randn(len(target), 5, generator=torch.Generator().manual_seed(5))
    found = []
    for seen, shared in ((history, history_of), (history[history_of], None)):
        kept = lookup.forward(seen, target, rows_per_scene, history_of=shared)
        lookup.backward(seen, target, rows_per_scene, kept, grad_output, shared)
        lookup.siamese_gradient()
        found.append([kept.output.clone(), *(parameter.grad.clone() for parameter in network.parameters())])
    for shared, alone in zip(*found, strict=True):
        torch.testing.assert_close(shared, alone, rtol=1e-12, atol=1e-13)
    assert found[0][1].abs().max() > 0.1


def outputs_and_gradients(network: SiameseActorCritic, lookup: LookupNetwork, repeats: int) -> dict[str, Tensor]:
    """Of many rows, in two minibatches."""
    rows_per_scene = (17 * repeats, 9 * repeats, 23 * repeats)
    history, target, _ = made_rows(rows_per_scene, False)
    grad_output = torch.randn(len(history), 5, generator=torch.Generator().manual_seed(5)) + 0.5
    for _ in range(2):
        kept = lookup.forward(history, target, rows_per_scene)
        lookup.backward(history, target, rows_per_scene, kept, grad_output)
    lookup.siamese_gradient()
    return {"output": kept.output, **{name: parameter.grad for name, parameter in network.named_parameters()}}


def test_with_bfloat16_factors_outputs_and_gradients_are_rounded_and_no_more() -> None:
    """A thousand rows: sums of so many would be far off, were they added up in bfloat16 too."""
    exact = outputs_and_gradients(*made_network(), repeats=20)
    rounded = outputs_and_gradients(*made_network(dtype=torch.bfloat16), repeats=20)
    assert torch.equal(rounded.pop("output_bias"), exact.pop("output_bias"))  # a sum of what is given
    for name, expected in exact.items():
        assert rounded[name].dtype == torch.float32
        off = (rounded[name] - expected).norm() / expected.norm()
        assert 1e-5 < off < 0.02, name


def test_bfloat16_copies_of_weights_follow_the_parameters_after_refresh() -> None:
    network, lookup = made_network(dtype=torch.bfloat16)
    history, target, _ = made_rows((5, 5, 5), False)
    before = lookup.forward(history, target, (5, 5, 5)).output
    network.load_state_dict(made_network(seed=1)[0].state_dict())
    lookup.refresh()
    fresh = LookupNetwork(network, lookup.first_layer.features, torch.tensor(TARGET_STATE), torch.bfloat16)
    found, expected = (one.forward(history, target, (5, 5, 5)).output for one in (lookup, fresh))
    assert torch.equal(found, expected)
    assert not torch.equal(found, before)


@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16])
def test_rows_are_judged_as_in_a_forward_pass_whatever_their_number(dtype: torch.dtype) -> None:
    _, lookup = made_network(dtype=dtype)
    history, target, _ = made_rows((7, 0, 5), False)
    expected = lookup.forward(history, target, (7, 0, 5))
    scores, value = lookup.judged(history, target, (7, 0, 5))
    torch.testing.assert_close(scores, expected.scores, rtol=0.02, atol=0.02)
    torch.testing.assert_close(value, expected.value, rtol=0.02, atol=0.02)
    assert lookup.row_step == (1 if dtype == torch.float32 else 32)


def test_forward_follows_the_parameters_after_refresh() -> None:
    network, lookup = made_network()
    history, target, scene = made_rows((5, 5, 5), False)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.mul_(0.5)
        lookup.refresh()
        scores, value = network(
            lookup.first_layer.features[history], lookup.first_layer.features[lookup.target_state][target], scene
        )
    kept = lookup.forward(history, target, (5, 5, 5))
    torch.testing.assert_close(kept.scores, scores, rtol=1e-5, atol=1e-6)
    torch.testing.assert_close(kept.value, value, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("few_rows", [True, False])
def test_start_values_are_those_of_a_history_of_one_pose(few_rows: bool) -> None:
    _, lookup = made_network()
    lookup.refresh(few_rows=few_rows)
    state, target, rows_per_scene = torch.tensor([3, 7, 7, 15, 25]), torch.tensor([0, 1, 0, 2, 4]), (3, 1, 1)
    expected = lookup.forward(state[:, None].expand(-1, HISTORY), target, rows_per_scene).value
    torch.testing.assert_close(lookup.start_values(state, target, rows_per_scene), expected)
    assert expected.unique().numel() == 5
    _, rounded = made_network(dtype=torch.bfloat16)
    rounded.refresh(few_rows=few_rows)
    found = rounded.start_values(state, target, rows_per_scene)
    torch.testing.assert_close(found, expected, rtol=0.02, atol=0.02)


def test_backward_does_not_depend_on_what_was_computed_before() -> None:
    """Memory is kept between calls; a larger batch before must leave no trace."""
    network, lookup = made_network()
    small, large = (3, 2, 4), (40, 50, 60)
    gradients = []
    for batches in ([small], [large, small]):
        for rows_per_scene in batches:
            history, target, _ = made_rows(rows_per_scene, False)
            kept = lookup.forward(history, target, rows_per_scene)
            lookup.backward(history, target, rows_per_scene, kept, torch.ones(len(history), 5))
            lookup.siamese_gradient()
        gradients.append([parameter.grad.clone() for parameter in network.parameters()])
    assert all(torch.equal(a, b) for a, b in zip(*gradients, strict=True))


def test_the_siamese_gradient_is_the_mean_over_the_batches_since_the_last_one() -> None:
    network, lookup = made_network()
    batches = [(3, 2, 4), (7, 0, 9), (5, 5, 5)]

    def gradient(of: list[tuple[int, ...]]) -> Tensor:
        for rows_per_scene in of:
            history, target, _ = made_rows(rows_per_scene, False, seed=sum(rows_per_scene))
            kept = lookup.forward(history, target, rows_per_scene)
            lookup.backward(history, target, rows_per_scene, kept, torch.ones(len(history), 5))
        lookup.siamese_gradient()
        return network.siamese_weight.grad.clone()

    alone = [gradient([batch]) for batch in batches]
    torch.testing.assert_close(gradient(batches), torch.stack(alone).mean(0), rtol=1e-4, atol=1e-5)
    assert torch.equal(gradient(batches[:1]), alone[0])


def test_without_the_siamese_weight_refresh_follows_all_other_parameters() -> None:
    network, lookup = made_network()
    every = torch.arange(len(TARGET_STATE))

    def target_branch() -> tuple[Tensor, Tensor]:
        term = lookup._target_terms(every, out=torch.empty(len(every), lookup.width))
        return lookup.wanted.clone(), term

    before, stale = lookup.first_layer.projected.clone(), target_branch()
    with torch.no_grad():
        for name, parameter in network.named_parameters():
            parameter.mul_(1 if name == "siamese_weight" else 0.5)
    lookup.refresh(siamese_weight=False)
    partly = target_branch()
    lookup.refresh()
    fresh = target_branch()
    assert torch.equal(before, lookup.first_layer.projected)
    assert all(torch.equal(a, b) for a, b in zip(partly, fresh, strict=True))
    assert not any(torch.equal(a, b) for a, b in zip(stale, fresh, strict=True))


def test_features_of_another_size_are_refused() -> None:
    network, _ = made_network()
    with pytest.raises(AssertionError, match="features"):
        LookupNetwork(network, torch.zeros(STATES, FEATURES + 1), torch.tensor(TARGET_STATE))
