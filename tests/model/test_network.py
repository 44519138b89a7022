import math

import pytest
import torch

from clearway.model.network import NetworkShape, SiameseActorCritic


def test_the_paper_s_size_has_5_780_500_parameters() -> None:
    network = SiameseActorCritic(NetworkShape(head_count=4, feature_count=2048))
    count = {name: parameter.numel() for name, parameter in network.named_parameters()}
    assert count["siamese_weight"] + count["siamese_bias"] == 4_194_816  # 8192 -> 512
    assert count["fusion_weight"] + count["fusion_bias"] == 524_800  # 1024 -> 512
    assert count["scene_weight"] + count["scene_bias"] == 4 * 262_656  # 512 -> 512
    assert count["output_weight"] + count["output_bias"] == 4 * (2_052 + 513)  # 512 -> 4 and 512 -> 1
    assert sum(count.values()) == 5_780_500


def test_parameters_fill_the_range_of_their_fan_in() -> None:
    network = SiameseActorCritic(NetworkShape(head_count=2, feature_count=30, width=64, history_length=3))
    fan_in = {"siamese": 90, "fusion": 128, "scene": 64, "output": 64}
    for name, parameter in network.named_parameters():
        bound = 1 / math.sqrt(fan_in[name.split("_")[0]])
        assert parameter.abs().max() <= bound
        if parameter.numel() >= 64:
            assert parameter.abs().max() > 0.9 * bound
        if parameter.numel() >= 1000:
            assert parameter.std().item() == pytest.approx(bound / math.sqrt(3), rel=0.05)


def test_a_seed_repeats_and_another_differs() -> None:
    shape = NetworkShape(head_count=1, feature_count=5, width=8)
    first, again, other = (SiameseActorCritic(shape, seed).siamese_weight for seed in (7, 7, 8))
    assert torch.equal(first, again)
    assert not torch.equal(first, other)


def test_forward_by_hand() -> None:
    """Width 1, one feature, history of 2: every layer is a number."""
    network = SiameseActorCritic(NetworkShape(head_count=2, feature_count=1, width=1, history_length=2))
    with torch.no_grad():
        network.siamese_weight.copy_(torch.tensor([[[2.0]], [[3.0]]]))  # oldest, newest
        network.siamese_bias.fill_(1.0)
        network.fusion_weight.copy_(torch.tensor([[[1.0]], [[-1.0]]]))  # observation, target
        network.fusion_bias.fill_(0.5)
        network.scene_weight.copy_(torch.tensor([[[2.0]], [[-2.0]]]))
        network.scene_bias.copy_(torch.tensor([[0.0], [1.0]]))
        network.output_weight.copy_(torch.arange(10.0).view(2, 5, 1))
        network.output_bias.zero_()
        history, target = torch.tensor([[[1.0], [2.0]]] * 2), torch.tensor([[1.0], [-1.0]])
        scores, value = network(history, target, torch.tensor([0, 1]))
    # seen = 2 * 1 + 3 * 2 + 1 = 9; wanted = relu(5 * target + 1) = 6 and 0; fused = 3.5 and 9.5;
    # scene layer: 2 * 3.5 = 7 in scene 0, relu(-2 * 9.5 + 1) = 0 in scene 1
    assert scores.tolist() == [[0.0, 7.0, 14.0, 21.0], [0.0] * 4]
    assert value.tolist() == [28.0, 0.0]


def test_layer_gradients_are_the_published_network_s_tensors() -> None:
    """Zhu's code has a weight and a bias for every layer, and a scene layer, a policy and a value for every scene."""
    network = SiameseActorCritic(NetworkShape(head_count=3, feature_count=5, width=8))
    for parameter in network.parameters():
        parameter.grad = torch.zeros_like(parameter)
    views = network.layer_gradients()
    assert len(views) == 2 + 2 + 3 * (2 + 2 + 2)
    for view in views:
        view += 1
    assert all((parameter.grad == 1).all() for parameter in network.parameters())  # each number lies in one of them
    sizes = sorted(view.numel() for view in views)
    assert sizes == sorted([160, 8, 128, 8] + 3 * [64, 8, 32, 4, 8, 1])


def test_a_single_head_serves_all_scenes() -> None:
    network = SiameseActorCritic(NetworkShape(head_count=1, feature_count=5, width=8))
    history, target = torch.randn(4, 4, 5), torch.randn(4, 5)
    shared, value = network(history, target, torch.tensor([0, 3, 2, 900]))
    alone, value_alone = network(history, target, torch.zeros(4, dtype=torch.int64))
    assert torch.equal(shared, alone)
    assert torch.equal(value, value_alone)
