import numpy as np
import pytest

import clearway as door
from clearway.generation import files
from clearway.generation.files import notes_of, scene_path
from clearway.generation.plans import generated_plan
from clearway.generation.request import Request
from clearway.scenes.floor_plans import GENERATED
from clearway.scenes.plan_scenes import floor_plan_scene
from clearway.scenes.scene import Provenance
from clearway.scenes.thor_v1 import write_scene


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("--count", 0), ("--count 0", "from 1 to 1000000")),
        (("--count", 1_000_001), ("--count 1000001",)),
        (("--count", "many"), ("--count", "many")),
        (("--kind", "house"), ("--kind", "room", "flat")),
        (("--split", "dev"), ("--split", "train", "validation", "test")),
        (("--seed", -1), ("--seed -1",)),
        (("--size", 0, 128), ("--size 0",)),
        (("--size", 8, 128), ("8 x 128 pixels", "16 to 1024")),
        (("--sensors", "depth"), ("leaves out rgb",)),
        (("--encoder", "depth-grid"), ("Add --sensors rgb depth",)),
        (("--workers", 0), ("--workers 0",)),
    ],
)
def test_what_cannot_be_generated_is_one_line(clearway, tmp_path, words, parts):
    answer = clearway("scenes", "generate", *words, "--out", tmp_path / "rooms")
    assert answer.refusal(*parts)
    assert not (tmp_path / "rooms").exists()


def test_a_file_instead_of_a_folder_is_one_line(clearway, tmp_path):
    (tmp_path / "rooms").write_text("notes")
    assert clearway("scenes", "generate", "--out", tmp_path / "rooms").refusal("a file. Give a folder")


def test_what_is_there_is_kept_and_counted(clearway, tmp_path, monkeypatch):
    asked = []

    def generate(requests, folder, seen, encoder, **rest):
        asked.append((seen.size_px, seen.sensors, encoder, rest["workers"]))
        folder.mkdir(exist_ok=True)
        missing = [scene_path(request, folder) for request in requests if not scene_path(request, folder).exists()]
        for path in missing:
            path.touch()
        return missing

    monkeypatch.setattr(files, "generate_scenes", generate)
    words = ("--kind", "flat", "--split", "validation", "--encoder", "none", "--out", tmp_path / "flats")
    first = clearway("scenes", "generate", *words, "--size", 48, 64)
    assert first.code == 0 and "1 made, flat-validation-000000.h5" in first.err
    second = clearway("scenes", "generate", *words, "--count", 3, "--sensors", "rgb", "depth", "--workers", 2)
    assert "2 made, 1 were there, flat-validation-000000.h5 to flat-validation-000002.h5" in second.err
    assert asked == [((48, 64), ("rgb",), "none", None), ((96, 128), ("rgb", "depth"), "none", 2)]


def test_a_generated_file_is_inspected_trained_and_evaluated(clearway, tmp_path, small):
    request = Request("flat", "train", 0, 1)
    scene = floor_plan_scene(generated_plan(request), 24)
    object.__setattr__(scene, "made_by", Provenance(GENERATED, seed=0, notes=notes_of(request)))
    object.__setattr__(scene, "observations", np.zeros((scene.state_count, 24, 32, 3), np.uint8))
    path = scene_path(request, tmp_path)
    write_scene(scene, path)
    found = clearway("scenes", "inspect", path, "--json").json
    assert (found["source"], found["components"], found["seed"]) == ("generated", 1, 0)
    assert clearway("train", path, "--out", tmp_path / "run", *small).code == 0
    assert clearway("evaluate", tmp_path / "run", "--episodes", 1, "--step-limit", 5).code == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"kind": "house"}, "kind='house'"),
        ({"count": True}, "count=True"),
        ({"size": 96}, "size=96"),
        ({"encoder": 5}, "encoder=5"),
        ({"out": 3}, "out=3"),
    ],
)
def test_wrong_arguments_in_python_are_one_error(tmp_path, arguments, said):
    with pytest.raises(door.ClearwayError, match=said):
        door.generate(**{"out": tmp_path / "rooms", **arguments})
