"""The whole demo: quickly on a made-up room, and slowly on the real one."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import pytest
from PIL import Image

from clearway.cli.main import main
from clearway.errors import ClearwayError
from clearway.experiments.demo import DemoRequest, run_demo
from clearway.learn.checkpoint import checkpoints
from clearway.learn.run_folder import RunFolder
from clearway.scenes.thor_v1 import read_scene
from helpers.small_demo import shrink_demo

AGENTS = {"collision-aware", "shortest", "random", "shortest path"}


@dataclass(frozen=True)
class Answer:
    """What the command left behind."""

    code: int
    out: str
    err: str


def demo(folder: Path, *words: str, frames: int = 800) -> Answer:
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err), pytest.raises(SystemExit) as leaving:
        main(["demo", "--out", str(folder), "--frames", str(frames), *words])
    return Answer(leaving.value.code, out.getvalue(), err.getvalue())


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    shrink_demo(monkeypatch)


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Answer]:
    """A small demo's folder and what it printed."""
    out = tmp_path_factory.mktemp("first") / "demo"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", "200")
        shrink_demo(patch)
        return out, demo(out)


def linked_files(page: Path) -> set[str]:
    """What the page shows or leads to; all of it is beside the page."""
    return set(re.findall(r'(?:src|href)="([^"]*)"', page.read_text(encoding="utf-8")))


def check_demo(out: Path) -> None:
    """What every demo leaves behind."""
    links = linked_files(out / "index.html")
    assert {"pictures/contrast-shortest.webp", "pictures/map.png", "pictures/curves.png"} <= links
    assert {f"pictures/episode-{agent}.png" for agent in ("collision-aware", "shortest")} <= links
    assert len([link for link in links if link.startswith("pictures/view-")]) == 6
    for link in links:
        with Image.open(out / link) as picture:
            picture.verify()
    assert {f"pictures/{path.name}" for path in (out / "pictures").iterdir()} == links
    evaluations = json.loads((out / "evaluation.json").read_text())
    assert {evaluation["agent"] for evaluation in evaluations} >= AGENTS
    table = (out / "evaluation.md").read_text()
    assert all(agent in table for agent in AGENTS) and "Encoder: " in table
    ideal = next(evaluation for evaluation in evaluations if evaluation["agent"] == "shortest path")
    assert ideal["average"]["steps"] == ideal["average"]["shortest_path_steps"]
    assert len(ideal["targets"]) == 5
    scene = read_scene(out / "bathroom.h5")
    for reward in ("collision-aware", "shortest"):
        run = RunFolder(out / "runs" / reward)
        record = run.read_record()
        assert record.reward.name == reward
        assert len(checkpoints(run.checkpoints)) == 1
        assert Path(record.scenes[0].path) == (out / "bathroom.h5").resolve()
        assert all(0 <= target < scene.state_count for target in record.targets["bathroom"])


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_the_demo_leaves_a_page_with_its_pictures(first):
    out, answer = first
    assert answer.code == 0
    check_demo(out)
    for agent in AGENTS:
        assert agent in answer.out
    assert "argmax" not in answer.out and f"--all, or {out / 'evaluation.md'}." in answer.out
    assert answer.err.splitlines()[-1] == f"open {out / 'index.html'}"


@pytest.mark.slow
def test_a_second_demo_replaces_the_first_and_may_be_made_from_within(small, first, tmp_path, monkeypatch):
    out = Path(shutil.copytree(first[0], tmp_path / "demo"))
    for old in ("old.txt", "pictures/old.png", "runs/shortest/old.txt"):
        (out / old).touch()
    monkeypatch.chdir(out)
    answer = demo(Path(), "--seed", "5", "--json", frames=400)
    assert answer.code == 0
    assert os.path.samefile(Path(), out)
    check_demo(out)
    assert not list(out.rglob("old.*"))
    record = RunFolder(out / "runs" / "shortest").read_record()
    assert (record.seed, record.learner.frames) == (5, 400)
    assert json.loads(answer.out) == json.loads((out / "evaluation.json").read_text())


@pytest.mark.slow
def test_the_same_seed_gives_the_same_figures(small, first, tmp_path):
    result = run_demo(DemoRequest(tmp_path / "again", seed=0, frames=800, encoder="auto"))
    again = json.loads(json.dumps([evaluation.to_json() for evaluation in result.evaluations]))
    assert again == json.loads((first[0] / "evaluation.json").read_text())
    assert result.showcase.walks.keys() == {"collision-aware", "shortest"}


def test_a_folder_of_other_things_is_refused(small, tmp_path):
    thesis = tmp_path / "thesis.tex"
    thesis.write_text("years of work")
    for path in (tmp_path, thesis):
        answer = demo(path)
        assert (answer.code, answer.out) == (2, "")
        assert answer.err == f"error: {path}: exists and is not a demo's folder. Give another one with --out\n"
    assert contents(tmp_path) == {"thesis.tex": b"years of work"}


@pytest.mark.parametrize(("frames", "seed"), [(0, "0"), (800, "-1")])
def test_bad_numbers_are_refused_before_anything_is_touched(small, tmp_path, frames, seed):
    answer = demo(tmp_path / "demo", "--seed", seed, frames=frames)
    assert answer.code == 2
    assert len(answer.err.splitlines()) == 1
    assert not (tmp_path / "demo").exists()


@pytest.mark.slow
def test_an_earlier_demo_stays_until_its_successor_has_a_room(small, first, monkeypatch):
    def fail(*_: object, **__: object) -> None:
        raise ClearwayError("no encoder today. Try tomorrow")

    monkeypatch.setattr("clearway.experiments.demo.encode_scenes", fail)
    before = contents(first[0])
    assert demo(first[0]).code == 2
    assert contents(first[0]) == before


@pytest.mark.slow
def test_the_real_demo(tmp_path, monkeypatch):
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    out = tmp_path / "demo"
    assert demo(out, "--encoder", "random-resnet50", frames=60_000).code == 0
    check_demo(out)
    scene = read_scene(out / "bathroom.h5")
    assert (scene.state_count, scene.cell_count) == (180, 45)
    assert scene.observations.shape == (180, 300, 400, 3)
    assert scene.features.shape == (180, 2048)
    assert "random-resnet50" in (out / "index.html").read_text(encoding="utf-8")
