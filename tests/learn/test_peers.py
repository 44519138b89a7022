"""Several workers train one agent: the same losses and parameters as one worker's, up to rounding."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import pytest
import torch
import torch.distributed as dist
from torch import Tensor

from clearway.learn import trainer as trainer_module
from clearway.learn.a2c import A2C
from clearway.learn.bc import BC
from clearway.learn.learner import Learner
from clearway.learn.peers import Peers
from clearway.learn.presets import DEFAULT, PAPER_A2C
from clearway.learn.train import RunRequest
from clearway.reward import COLLISION_AWARE
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


def by_workers(count: int, work: Callable[[Peers], Any]) -> list[Any]:
    """What `work` gives at each of so many workers, threads here."""
    store, results, errors = dist.HashStore(), [None] * count, []

    def run(rank: int) -> None:
        try:
            results[rank] = work(Peers(dist.ProcessGroupGloo(store, rank, count)))
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=run, args=(rank,), daemon=True) for rank in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    if errors:
        raise errors[0]
    assert not any(thread.is_alive() for thread in threads)
    return results


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
@pytest.mark.parametrize("name", LEARNERS)
@pytest.mark.parametrize("workers", [2, pytest.param(4, marks=pytest.mark.slow)])
def test_workers_together_learn_what_one_learns_alone(name: str, workers: int) -> None:
    request = four_scenes(LEARNERS[name])
    one = trained(request, Peers())
    assert_same(one, by_workers(workers, lambda peers: trained(request, peers))[0])
