"""Several workers train one agent: the same losses and parameters as one worker's, up to rounding."""

from collections.abc import Iterator
from dataclasses import replace

import pytest
import torch
from torch import Tensor

from clearway.learn import trainer as trainer_module
from clearway.learn.a2c import A2C
from clearway.learn.bc import BC
from clearway.learn.learner import Learner
from clearway.learn.peers import LostPeer, Peers, divided
from clearway.learn.presets import DEFAULT, PAPER_A2C
from clearway.learn.train import RunRequest
from clearway.reward import COLLISION_AWARE
from helpers.by_workers import by_workers
from helpers.made import corridor_scene, grid_scene
from helpers.small_runs import CORRIDOR_TARGETS, FEATURES, GRID_TARGETS, small_learner

UPDATES = 20
Told = list[dict[str, float]]


def four_scenes(learner: Learner) -> RunRequest:
    """Two corridors and two grids."""
    scenes = [corridor_scene(5, feature_count=FEATURES), grid_scene(1, width=4, depth=3, feature_count=FEATURES)]
    scenes += [replace(scene, name=f"other {scene.name}") for scene in scenes]
    scenes = sorted(scenes, key=lambda scene: len(scene.name))
    targets = {s.name: CORRIDOR_TARGETS if "corridor" in s.name else GRID_TARGETS for s in scenes}
    return RunRequest(scenes, targets, learner, COLLISION_AWARE, seed=3)


@pytest.fixture
def doubles(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Parameters, features and rewards in float64."""
    torch.set_default_dtype(torch.float64)
    monkeypatch.setattr(trainer_module, "factor_dtype", lambda precision, device: torch.float64)
    yield
    torch.set_default_dtype(torch.float32)


def trained(request: RunRequest, peers: Peers, updates: int = UPDATES) -> tuple[Told, dict[str, Tensor]]:
    trainer = request.trainer(peers)
    figures = [trainer.update() | {"solved": trainer.statistics.solved} for _ in range(updates)]
    return figures, {name: tensor.clone() for name, tensor in trainer.tensors().items()}


def assert_same(one: tuple[Told, dict[str, Tensor]], several: tuple[Told, dict[str, Tensor]]) -> None:
    for alone, together in zip(one[0], several[0], strict=True):
        assert alone == pytest.approx(together, abs=1e-9, rel=1e-9)
    assert one[1].keys() == several[1].keys()
    for name, tensor in one[1].items():
        torch.testing.assert_close(tensor, several[1][name], rtol=1e-9, atol=1e-9, msg=lambda m, n=name: f"{n}: {m}")


LEARNERS = {
    "ppo": small_learner(DEFAULT, envs=16, frames=2_560, siamese_step="minibatch"),
    "ppo, shared head": small_learner(DEFAULT, envs=16, frames=2_560, heads="shared", balance=2.0, feature_basis=6),
    "a2c": small_learner(A2C(), envs=16, frames=2_560),
    "paper": small_learner(PAPER_A2C, envs=16, frames=2_560),
    "bc": small_learner(BC(), envs=16, frames=2_560),
}


@pytest.mark.usefixtures("doubles")
@pytest.mark.parametrize(
    ("name", "workers"),
    [("ppo", 2), ("a2c", 2), ("bc", 2)]
    + [pytest.param(name, n, marks=pytest.mark.slow) for name, n in [("paper", 2), *((one, 4) for one in LEARNERS)]],
)
def test_workers_together_learn_what_one_learns_alone(name: str, workers: int) -> None:
    request = four_scenes(LEARNERS[name])
    start, one = trained(request, Peers(), 0)[1], trained(request, Peers())
    assert not torch.allclose(start["network.fusion_weight"], one[1]["network.fusion_weight"], atol=1e-3)
    assert_same(one, by_workers(workers, lambda peers: trained(request, peers))[0])


@pytest.mark.usefixtures("doubles")
def test_what_some_workers_began_others_go_on_with() -> None:
    request = four_scenes(LEARNERS["a2c"])
    whole, half = trained(request, Peers(), 8), by_workers(2, lambda peers: trained(request, peers, 4)[1])[0]

    def went_on(peers: Peers) -> tuple[Told, dict[str, Tensor]]:
        trainer = request.trainer(peers)
        trainer.load_tensors(half, 4 * 16 * 8, 4)
        figures = [trainer.update() | {"solved": trainer.statistics.solved} for _ in range(4)]
        return figures, trainer.tensors()

    for workers in (1, 3):
        later = by_workers(workers, went_on)[0] if workers > 1 else went_on(Peers())
        assert_same((whole[0][4:], whole[1]), later)


def test_scenes_are_divided_by_size_in_their_order() -> None:
    assert divided([10, 10, 10, 10], 2) == [0, 2, 4]
    assert divided([30, 10, 10, 10], 2) == [0, 1, 4]
    assert divided([1, 1, 100], 3) == [0, 1, 2, 3]
    assert divided([100, 1, 1], 3) == [0, 1, 2, 3]
    assert divided([5, 5, 5], 1) == [0, 3]


def test_a_lost_worker_is_noticed() -> None:
    def leaves(peers: Peers) -> str:
        if peers.rank:
            return "left"
        with pytest.raises(LostPeer):
            peers.told(1.0)
        return "noticed"

    assert by_workers(2, leaves) == ["noticed", "left"]


def test_gradients_in_bfloat16_are_half_the_bytes_and_nearly_the_same() -> None:
    def summed(peers: Peers) -> tuple[Tensor, int]:
        parts = torch.full((3, 2), 1 + peers.rank / 1000), torch.ones(2)
        peers.add_up(*parts, sent_as=torch.bfloat16)
        return parts[0], peers.sent_bytes

    (one, sent_bytes), (other, _) = by_workers(2, summed)
    assert sent_bytes == 2 * 8
    assert one.dtype == torch.float32 and torch.equal(one, other) and (one == 2).all()

    def learnt(sent_gradients: str, workers: int) -> Tensor:
        request = four_scenes(small_learner(A2C(), envs=16, frames=2_560, sent_gradients=sent_gradients))
        done = (
            by_workers(workers, lambda peers: trained(request, peers, 2))
            if workers > 1
            else [trained(request, Peers(), 2)]
        )
        return done[0][1]["network.fusion_weight"]

    exact, rounded, alone = learnt("float32", 2), learnt("bfloat16", 2), learnt("bfloat16", 1)
    assert not torch.allclose(rounded, exact, rtol=0, atol=1e-6)
    torch.testing.assert_close(rounded, exact, rtol=0, atol=1e-3)
    torch.testing.assert_close(alone, exact)  # one worker sends nothing
