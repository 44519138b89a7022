"""What a GPU learns, beside what the processor does: run with -m gpu where there is one."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from clearway.errors import RunError
from clearway.evaluation.runs import evaluate_run
from clearway.learn import trainer as trainer_module
from clearway.learn.a2c import A2C
from clearway.learn.bc import BC
from clearway.learn.learner import Learner
from clearway.learn.load import load_agent
from clearway.learn.peers import Peers
from clearway.learn.presets import DEFAULT, PAPER_A2C, PAPER_A3C
from clearway.learn.q_learning import QLearning
from clearway.learn.recurrent import Recurrent
from clearway.learn.train import train
from helpers.made import corridor_scene, grid_scene
from helpers.small_eyes import seen_by_eyes
from helpers.small_runs import goes_on_to_the_same_bits, small_learner, small_request, small_scenes

pytestmark = [
    pytest.mark.gpu,
    pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU that torch can use"),
]
UPDATES = 10
LEARNERS: dict[str, Learner] = {
    "a2c": small_learner(A2C()),
    "paper": small_learner(PAPER_A2C),
    "bc": small_learner(BC()),
    "q-learning": small_learner(QLearning()),
    "ppo": small_learner(DEFAULT, minibatches=1, epochs=1, hindsight=False, lookahead=0.0),
}


@pytest.fixture
def doubles(monkeypatch: pytest.MonkeyPatch):
    """Parameters, features and rewards in float64."""
    torch.set_default_dtype(torch.float64)
    monkeypatch.setattr(trainer_module, "factor_dtype", lambda precision, device: torch.float64)
    yield
    torch.set_default_dtype(torch.float32)


@pytest.mark.usefixtures("doubles")
@pytest.mark.parametrize("name", LEARNERS)
def test_it_learns_what_the_processor_learns(name: str) -> None:
    told, ends = [], []
    for device in ("cpu", "cuda"):
        trainer = small_request(learner=LEARNERS[name], device=device).trainer()
        told.append([trainer.update() for _ in range(UPDATES)])
        ends.append({key: tensor.cpu() for key, tensor in trainer.tensors().items()})
    for here, there in zip(*told, strict=True):
        assert here == pytest.approx(there, abs=1e-6, rel=1e-6)  # some are summed in float32
    assert ends[0].keys() == ends[1].keys()
    for key, tensor in ends[0].items():
        torch.testing.assert_close(tensor, ends[1][key], rtol=1e-5, atol=1e-6, msg=lambda m, k=key: f"{k}: {m}")


def test_the_default_recipe_learns(tmp_path: Path) -> None:
    request = small_request(learner=small_learner(DEFAULT, envs=32, frames=32 * 8 * 300), device="cuda")
    folder = train(request, tmp_path / "run")
    hardware = folder.read_record().hardware
    assert hardware["device"] == "cuda" and hardware["gpu"] == torch.cuda.get_device_name()
    assert folder.metrics()[-1]["frames"] == request.learner.frames
    sampled = evaluate_run(load_agent(folder.path), small_scenes(), episodes_per_target=20, step_limit=1000)[0]
    assert sampled.to_json()["average"]["success"] > 0.95  # walked by the processor


@pytest.mark.parametrize("name", [*LEARNERS, "default"])
def test_a_run_goes_on_bit_for_bit(name: str, tmp_path: Path) -> None:
    learner = LEARNERS.get(name, small_learner(DEFAULT))
    request = small_request(learner=learner, device="cuda")
    whole = train(request, tmp_path / "whole")
    assert learner.frames == 800
    assert goes_on_to_the_same_bits(request, whole, updates=4)


def test_what_a_gpu_began_the_processor_goes_on_with(tmp_path: Path) -> None:
    request = small_request(learner=LEARNERS["a2c"], device="cuda")
    trainer = request.trainer()
    for _ in range(4):
        trainer.update()
    kept = {key: tensor.cpu() for key, tensor in trainer.tensors().items()}
    other = replace(request, device="cpu").trainer()
    other.load_tensors(kept, trainer.frames, trainer.updates)
    while not other.finished:
        assert all(torch.isfinite(torch.tensor(value)) for value in other.update().values())


def test_one_agent_for_many_rooms_is_taught_and_learns(tmp_path: Path) -> None:
    scenes = seen_by_eyes(tmp_path / "eyes", corridor_scene(5), grid_scene(1, width=4, depth=3))
    learner = Recurrent(frames=16 * 8 * 6, envs=16, rollout_steps=8, step_limit=20, width=16, minibatches=2)
    request = small_request(scenes=scenes, learner=learner, device="cuda")
    rows = train(request, tmp_path / "run").metrics()
    assert rows[-1]["frames"] == learner.frames and "agreement" in rows[0]


def test_sums_over_workers_stay_on_the_gpu(tmp_path: Path) -> None:
    """One worker alone, told that it has a peer: NCCL wants a GPU for each."""
    store = torch.distributed.FileStore(str(tmp_path / "store"), 1)
    torch.distributed.init_process_group("nccl", store=store, rank=0, world_size=1)
    try:
        peers = Peers(torch.distributed.group.WORLD, "cuda")
        peers.count = 2
        values = [torch.arange(3.0, device="cuda") / 3, torch.ones(2, 2, device="cuda") / 3]
        for sent_as in (torch.float32, torch.bfloat16):
            wanted = [value.to(sent_as).float() for value in values]
            peers.add_up(*values, sent_as=sent_as)
            assert all(torch.equal(value, one) and value.is_cuda for value, one in zip(values, wanted, strict=True))
        assert not torch.equal(values[0], torch.arange(3.0, device="cuda") / 3)  # rounded on the way
        assert torch.equal(peers.from_leader(values[0].clone()), values[0])
        assert peers.messages == 3
    finally:
        torch.distributed.destroy_process_group()


def test_a3c_says_that_it_needs_the_processor(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"a3c on the device cuda:0, expected cpu"):
        train(small_request(learner=small_learner(PAPER_A3C), device="cuda"), tmp_path / "run")
