"""`clearway evaluate --live` from a trained run to its tables."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from clearway.importers.mjcf import read_mjcf
from clearway.learn.checkpoint import newest_checkpoint
from clearway.learn.run_folder import RunFolder
from clearway.learn.train import train
from clearway.live.walks import walk_setting
from clearway.perception.preprocess import Preprocessing
from clearway.perception.random_resnet import fit_record, from_record
from clearway.reward import COLLISION_AWARE, SHORTEST
from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.small_live import TINY, walkable_room, walkable_scene
from helpers.small_model import AGENT, CHOICE, PLANE, written
from helpers.small_runs import small_request


@dataclass(frozen=True)
class Runs:
    """Two runs in the small room."""

    wary: Path
    bold: Path


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Runs]:
    folder = tmp_path_factory.mktemp("live")
    path = folder / "walkable.h5"
    write_scene(walkable_scene(walkable_room()), path)
    scene = read_scene(path)
    found = {}
    for name, reward in (("wary", COLLISION_AWARE), ("bold", SHORTEST)):
        request = small_request(
            scenes=[scene],
            targets={scene.name: (8, 41)},
            paths={scene.name: path},
            reward=reward,
        )
        found[name] = train(request, folder / name).path
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("clearway.rooms.build_room", lambda *room, **options: walkable_room())
        yield Runs(**found)


SHORT = ("--live", "--episodes", 2, "--step-limit", 4)


def test_two_runs_are_compared_and_the_run_folder_keeps_the_tables(clearway, runs, tmp_path):
    answer = clearway("evaluate", runs.bold, *SHORT, "--against", runs.wary, "--new-obstacle", "--json",
                      "--pictures", tmp_path / "pictures")  # fmt: skip
    assert answer.code == 0, answer
    (result,) = answer.json["results"]
    assert answer.json["episodes_per_target"] == 2 and answer.json["step_limit"] == 4
    assert result["setting"] == "new obstacle"
    assert set(result["agents"]) == {"shortest", "collision-aware"} == set(answer.json["grid"]["agents"])
    assert result["comparison"]["first"] == "shortest"
    assert result["agents"]["shortest"]["rearranged"] > 0
    assert json.loads((runs.bold / "live.json").read_text()) == answer.json
    assert "| new obstacle | shortest |" in (runs.bold / "live.md").read_text()
    for name in ("live.png", "live-walkable.png"):
        assert (tmp_path / "pictures" / name).read_bytes()[:4] == b"\x89PNG"


@pytest.mark.slow
def test_one_run_alone_is_a_table(clearway, runs):
    answer = clearway("evaluate", runs.bold, *SHORT, "--selection", "argmax")
    assert answer.code == 0, answer
    assert "none" in answer.out and "Actions argmax" in answer.out and "less" not in answer.out
    assert "on the grid" in answer.out


@pytest.mark.slow
def test_the_grid_beside_it_is_the_evaluation_on_the_grid(clearway, runs):
    live = clearway("evaluate", runs.bold, *SHORT, "--json").json["grid"]["agents"]["shortest"]
    grid = clearway("evaluate", runs.bold, *SHORT[1:], "--json").json["average"]
    for name, own in (("success", "success"), ("steps", "steps"), ("contacts", "collisions")):
        assert live[name] == grid[own] and live["intervals"][name] == grid["intervals"][own]


@pytest.mark.slow
def test_a_sweep_has_a_row_a_setting(clearway, runs):
    answer = clearway(
        "evaluate", runs.bold, "--live", "--episodes", 1, "--step-limit", 1, "--sweep", "--strengths", 1, "--json"
    )
    assert answer.code == 0, answer
    labels = [result["setting"] for result in answer.json["results"]]
    assert len(labels) == 10 and labels[0] == "none" and labels[-1] == "all, strength 1"


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("--light", "0.3"), ("--live",)),
        (("--live", "--light", "-0.1"), ("--light is below 0",)),
        (("--live", "--pixel-noise", "nan"), ("--pixel-noise is nan",)),
        (("--live", "--light", "1.01"), ("--light is 1.01, expected at most 1",)),
        (("--live", "--light", "1e308"), ("--light is 1e+308",)),
        (("--live", "--pixel-noise", "1e39"), ("--pixel-noise is 1e+39, expected at most 255",)),
        (("--live", "--distance-noise", "1e300"), ("--distance-noise is 1e+300, expected at most 1",)),
        (("--live", "--angle-noise", "181"), ("--angle-noise is 181, expected at most 180",)),
        (("--live", "--camera-height-jitter", "1.1"), ("--camera-height-jitter is 1.1",)),
        (("--live", "--camera-pitch-jitter", "91"), ("--camera-pitch-jitter is 91",)),
        (("--live", "--move-furniture", "11"), ("--move-furniture is 11",)),
        ((*map(str, SHORT), "--sweep", "--strengths", "4"), ("--strengths is 4", "light would be 1.2, more than 1")),
        (("--live", "--sweep", "--light", "0.1"), ("--sweep sets the perturbations itself",)),
        (("--live", "--sweep", "--strengths", "0"), ("--strengths is 0",)),
        (("--live", "--episodes", "0"), ("--episodes is 0",)),
        (("--live", "--selection", "argmax-untried"), ("argmax-untried",)),
    ],
    ids=" ".join,
)
def test_flags_that_cannot_be_used(clearway, runs, words, parts):
    assert clearway("evaluate", runs.bold, *words).refusal(*parts)


@pytest.mark.parametrize("words", [("--live",), ("--checkpoint", "x"), ("--pictures", "x")], ids=" ".join)
def test_what_needs_a_run_folder_is_refused_beside_an_exported_file(clearway, tmp_path, words):
    assert clearway("evaluate", tmp_path / "agent.onnx", *words).refusal(words[0], "needs a run folder", "is a file")


@pytest.mark.slow
def test_a_sweep_that_is_interrupted_leaves_what_is_complete_and_the_results_before_it(clearway, runs, monkeypatch):
    def names() -> set[str]:
        return {path.name for path in runs.wary.iterdir() if path.name.startswith("live")}

    short = ("evaluate", runs.wary, "--live", "--episodes", 1, "--step-limit", 1)
    assert clearway(*short, "--light", 0.2).code == 0
    assert names() == {"live.json", "live.md"}
    before = (runs.wary / "live.json").read_text(), (runs.wary / "live.md").read_text()
    walked = []

    def walk_twice(*given):
        if len(walked) == 2:
            raise KeyboardInterrupt
        walked.append(walk_setting(*given))
        return walked[-1]

    with monkeypatch.context() as patch:
        patch.setattr("clearway.live.walks.walk_setting", walk_twice)
        assert clearway(*short, "--sweep").code == 130
    assert ((runs.wary / "live.json").read_text(), (runs.wary / "live.md").read_text()) == before
    part = json.loads((runs.wary / "live.part.json").read_text())
    assert [result["setting"] for result in part["results"]] == ["none", "move ± 0.025 m"]
    assert "| move ± 0.025 m |" in (runs.wary / "live.part.md").read_text()
    assert clearway(*short).code == 0
    assert names() == {"live.json", "live.md"}
    assert [result["setting"] for result in json.loads((runs.wary / "live.json").read_text())["results"]] == ["none"]


@pytest.mark.slow
def test_a_checkpoint_is_the_first_run_s_own(clearway, runs):
    """That of --against is its newest."""
    own, other = (newest_checkpoint(RunFolder(run).checkpoints) for run in (runs.bold, runs.wary))
    words = ("evaluate", runs.bold, "--live", "--episodes", 1, "--step-limit", 1, "--checkpoint")
    assert clearway(*words, other).refusal(str(other), "not a checkpoint of")
    assert clearway(*words, own, "--against", runs.wary).code == 0


def test_the_same_run_twice_is_refused(clearway, runs):
    assert clearway("evaluate", runs.bold, *SHORT, "--against", runs.bold).refusal("--against", "the same run")


def test_a_run_on_an_imported_scene_is_refused(clearway, trained):
    assert clearway("evaluate", trained.run, "--live").refusal("bathroom_02", "thor_v1", "scenes build")


@pytest.fixture(scope="module")
def run_in_model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run in a MuJoCo model of somebody's."""
    folder = tmp_path_factory.mktemp("model")
    seen = read_mjcf(written(folder, PLANE), CHOICE, AGENT, height_px=18, width_px=24, workers=1)
    record = fit_record([seen.observations], shape=TINY, preprocessing=Preprocessing(16, 16), sample_pictures=32)
    path = folder / "hall.h5"
    write_scene(replace(seen, features=from_record(record).encode(seen.observations), encoder=record), path)
    scene = read_scene(path)
    request = small_request(scenes=[scene], targets={"hall": (8, 41)}, paths={"hall": path}, reward=SHORTEST)
    return train(request, folder / "run").path


@pytest.mark.slow
def test_a_run_in_a_mujoco_model_walks_there(clearway, run_in_model, tmp_path):
    short = ("evaluate", run_in_model, "--live", "--episodes", 1, "--step-limit", 2)
    answer = clearway(*short, "--distance-noise", 0.05, "--camera-height-jitter", 0.1, "--light", 0.3, "--json",
                      "--pictures", tmp_path)  # fmt: skip
    assert answer.code == 0, answer
    (result,) = answer.json["results"]
    assert result["agents"]["shortest"]["rearranged"] == 0
    assert 0 <= result["agents"]["shortest"]["min_clearance_m"] < 1
    assert (tmp_path / "live-hall.png").read_bytes()[:4] == b"\x89PNG"
    assert clearway(*short, "--new-obstacle").refusal("hall: nothing can be moved in a MuJoCo model", "Leave out")
    sweep = clearway(*short, "--sweep", "--strengths", 1, "--json")
    assert "the sweep leaves out move_furniture and new_obstacle" in sweep.err
    labels = [found["setting"] for found in sweep.json["results"]]
    assert len(labels) == 8 and not any("furniture" in label or "obstacle" in label for label in labels)


def test_a_model_that_is_gone_is_one_line(clearway, run_in_model, tmp_path):
    model = run_in_model.parent / "hall.xml"
    model.rename(tmp_path / "hall.xml")
    assert clearway("evaluate", run_in_model, "--live").refusal(
        "hall: its MuJoCo model", "hall.xml is missing", "Put it back"
    )
    (tmp_path / "hall.xml").rename(model)
