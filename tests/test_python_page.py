"""Every block of docs/python.md, and of docs/reproduction.md in Python, from top to bottom in one namespace."""

import sys
import warnings
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import torch

from clearway.errors import RunError
from clearway.experiments import catalogue, reproduce
from clearway.experiments.budget import BUDGETS
from clearway.perception import encode
from clearway.perception.random_resnet import ResNetShape
from clearway.reward import COLLISION_AWARE
from clearway.rooms import library
from clearway.scenes.thor_v1 import write_scene
from clearway.world.world import make_world
from helpers.documents import ROOT, Block, code_blocks, shortened
from helpers.made import grid_scene
from helpers.plugin_package import write_package
from helpers.small_setting import do_here

PAGE, EXPERIMENTS = ROOT / "docs/python.md", ROOT / "docs/reproduction.md"
FEWER = {
    "frames=600_000": "frames=4_000",
    "frames: int = 200_000": "frames: int = 4_000",
    "frames=200_000": "frames=4_000",
    "episodes=100": "episodes=2",
}
SMALLER = {**FEWER, "episodes=100": "episodes=1", "episodes=20": "episodes=1, step_limit=100"}
OFFERS = "[clearway.algorithms]\nreinforce = page:Reinforce\n"
TWICE = {"step_limit=100, step_limit=500": "step_limit=100"}


def run_package(changes: dict[str, str], site: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, object]:
    """Run the blocks of docs/python.md, as a module that a package offers an algorithm of; what they leave."""
    module = ModuleType("page")
    monkeypatch.setitem(sys.modules, "page", module)
    monkeypatch.syspath_prepend(str(write_package(site, package="my-package", entry_points=OFFERS)))
    return run_page(changes, PAGE, vars(module))


def run_page(changes: dict[str, str], page: Path, found: dict[str, object]) -> dict[str, object]:
    """Run the blocks of a page in a namespace; what they leave in it."""
    for block in python_blocks(page):
        here = {old: new for old, new in changes.items() if old in block.text}
        text = shortened(block.text, here)
        for old, new in TWICE.items():
            text = text.replace(old, new)
        exec(compile(text, str(page), "exec"), found)
    return found


def python_blocks(page: Path = PAGE) -> list[Block]:
    blocks = code_blocks(page)
    assert {block.language for block in blocks} <= {"python", "toml", "sh"}
    return [block for block in blocks if block.language == "python"]


def test_what_is_to_be_shortened_stands_there() -> None:
    whole = "\n".join(block.text for block in python_blocks())
    assert all(old in whole for old in SMALLER)


@pytest.mark.slow
def test_the_blocks_run_on_a_small_room(tmp_path: Path, monkeypatch, capsys) -> None:
    def stand_in(name, seed, **_):
        return grid_scene(3, width=6, depth=5, obstacle_share=0.1, picture_size=(32, 32), name=name)

    small = ResNetShape(8, (8, 16), (1, 1))
    monkeypatch.setattr(library, "cached_room_scene", stand_in)
    monkeypatch.setattr(encode, "find_record", partial(encode.find_record, shape=small))
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    left = run_package(SMALLER, tmp_path / "site", monkeypatch)
    said = capsys.readouterr().out
    assert "learning_rate: no such setting" in said
    assert "quarters" in said and "beta -0.05" in said and "few-turns" in said
    assert np.array_equal(left["office"].graph, left["scene"].graph)
    assert left["run"].folder is None
    assert {path.name for path in (tmp_path / "runs/bathroom").glob("evaluation.*")} == {
        "evaluation.json",
        "evaluation.md",
    }
    graph_steps = left["scene"].distances_to([left["target"]])[0]
    assert max(left["lengths"]) <= graph_steps.max()  # the page's Q-learning has found the shortest paths
    assert [left["run"].record.reward.name, left["short"].record.learner.algorithm] == ["collision-aware", "a2c"]
    check_reinforce(left["Reinforce"])


def check_reinforce(kind) -> None:
    """It learns the shortest paths of a small room, and goes on where it was stopped as if it had not been."""
    scene = grid_scene(3, width=4, depth=3)
    world, learner = make_world([scene], {scene.name: [5]}), kind(frames=60_000)
    trainer = learner.trainer(world, COLLISION_AWARE, 1)
    trainer.update()
    kept = {name: tensor.clone() for name, tensor in trainer.tensors().items()}
    trainer.update()
    other = learner.trainer(world, COLLISION_AWARE, 1)
    other.load_tensors(kept, 2_000, 1)
    other.update()
    assert torch.equal(other.scores, trainer.scores) and other.frames == trainer.frames == 4_000
    while not trainer.finished:
        trainer.update()
    assert trainer.statistics.all_solved


@pytest.mark.slow
def test_the_blocks_run_on_the_room_itself(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        left = run_package(FEWER, tmp_path / "site", monkeypatch)
    assert left["room"].cell_count == 45


@pytest.mark.slow
def test_runs_and_experiments_of_one_s_own(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(reproduce, "run_jobs", do_here)
    monkeypatch.setattr(catalogue, "EXPERIMENTS", dict(catalogue.EXPERIMENTS))
    monkeypatch.setitem(BUDGETS, "smoke", replace(BUDGETS["smoke"], mark=""))  # or 400 frames were not judged
    scene = grid_scene(3, width=6, depth=5, obstacle_share=0.1, feature_count=12, name="bathroom")
    write_scene(scene, Path("scenes/bathroom.h5"))
    fewer = {"frames=600_000": "frames=2_000, envs=10, width=16", "episodes=100": "episodes=1"}
    left = run_page({**fewer, '"paper", dumps': '"smoke", dumps, frames=400'}, EXPERIMENTS, {"__name__": "__main__"})
    assert "probability of improvement" in capsys.readouterr().out
    (claim,) = left["found"].sections[0].claims
    assert claim.p is not None and not left["found"].sections[0].missing
    report = Path("mine/report.md").read_text()
    assert claim.text in report and f"bathroom ({scene.state_count} poses)" in report and "0, 1, 2, 3" in report
    assert len(list(Path("mine/runs").iterdir())) == 8
    monkeypatch.undo()
    with pytest.raises(RunError, match=r"asks for experiment 'mine', which nothing .* run the program that made this"):
        reproduce.gather(tmp_path / "mine")
