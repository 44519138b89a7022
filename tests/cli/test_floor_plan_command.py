from pathlib import Path

import numpy as np
import pytest

from clearway.rooms import library


@pytest.fixture
def plans(tmp_path: Path) -> Path:
    path = tmp_path / "plans.npz"
    np.savez(path, hall=np.array([[0, 0], [0, 1], [0, 2]]), ell=np.array([[0, 0], [0, 1], [1, 0]]))
    return path


@pytest.mark.slow
def test_a_plan_becomes_a_furnished_room(clearway, tmp_path, monkeypatch):
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    (tmp_path / "nook.txt").write_text(".#\n..\n")
    words = ("--cell-size", 0.5, "--sensors", "rgb", "depth")
    answer = clearway("scenes", "import", "floor-plan", tmp_path / "nook.txt", *words, "--out", tmp_path / "scenes")
    assert answer.code == 0, answer
    assert answer.err.startswith(f"{tmp_path / 'nook.txt'}: rendering and encoding nook\n")
    assert "nook.h5: 12 states, 3 cells of 0.5 m, 1 x 1 m" in answer.err
    found = clearway("scenes", "inspect", tmp_path / "scenes" / "nook.h5", "--json").json
    assert (found["states"], found["encoder"], found["source"]) == (12, "clearway", "floor_plan")
    assert found["picture_size"] == [300, 400]
    assert found["sensors"][1] == "depth (300 x 400 float32, 0 to 20 m)"
    assert found["closest_cosine_distance"] > 0.001


def test_a_plan_too_large_to_render_is_refused_before_any_is_rendered(clearway, tmp_path):
    path = tmp_path / "plans.npz"
    np.savez(path, hall=np.array([[0, 0]]), street=np.array([[0, 0], [500, 0]]))
    answer = clearway("scenes", "import", "floor-plan", path, "--out", tmp_path / "scenes")
    assert answer.refusal("plans.npz", "'street'", "spans 125.2 x 0.2 m", "made-up features")
    assert not (tmp_path / "scenes").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--sensors", "depth"), ("'depth' leaves out rgb", "Name each once")),
        (("--encoder", "depth-grid"), ("depth-grid sees depth", "Add --sensors rgb depth")),
        (("--sensors", "rgb", "depth", "--features", 8), ("--features renders nothing", "Leave out one of them")),
    ],
)
def test_sensors_that_cannot_be_had_are_refused(clearway, plans, tmp_path, words, said):
    answer = clearway("scenes", "import", "floor-plan", plans, *words, "--out", tmp_path / "scenes")
    assert answer.refusal(*said)
    assert not (tmp_path / "scenes").exists()


@pytest.mark.parametrize("words", [("--workers", 0), ("--workers", 0, "--ray", "local"), ("--encoder-seed", -1)])
def test_flags_of_encoding_are_refused_before_anything_is_rendered(clearway, plans, tmp_path, monkeypatch, words):
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    answer = clearway("scenes", "import", "floor-plan", plans, *words, "--out", tmp_path / "scenes")
    assert answer.refusal(f"{words[0]} is {words[1]}")
    assert not (tmp_path / "scenes").exists() and not (tmp_path / "cache" / "scenes").exists()


def test_an_encoder_that_cannot_be_had_is_told_before_anything_is_rendered(clearway, plans, tmp_path, monkeypatch):
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    monkeypatch.setattr(library, "cached_plan_scene", lambda *_, **__: pytest.fail("rendered"))
    answer = clearway("scenes", "import", "floor-plan", plans, "--encoder", "nowhere/none", "--out", tmp_path / "out")
    assert answer.code == 2 and "encoder 'nowhere/none': is not in the cache" in answer.err
    assert not (tmp_path / "out").exists()


def test_every_plan_becomes_a_scene_that_can_be_trained(clearway, plans, tmp_path, small):
    answer = clearway("scenes", "import", "floor-plan", plans, "--out", tmp_path / "scenes", "--features", 24)
    assert answer.code == 0, answer
    assert "hall.h5: 12 states, 3 cells" in answer.err and "ell.h5: 12 states" in answer.err
    found = clearway("scenes", "inspect", tmp_path / "scenes" / "hall.h5", "--json").json
    assert (found["states"], found["encoder"], found["source"]) == (12, "made-up", "floor_plan")
    assert clearway("train", tmp_path / "scenes", "--out", tmp_path / "run", *small).code == 0


def test_some_plans_with_another_size_and_seed(clearway, plans, tmp_path):
    words = ("--name", "ell", "--features", 8, "--seed", 4, "--cell-size", 0.5, "--out", tmp_path / "scenes")
    assert clearway("scenes", "import", "floor-plan", plans, *words).code == 0
    assert [path.name for path in (tmp_path / "scenes").iterdir()] == ["ell.h5"]
    found = clearway("scenes", "inspect", tmp_path / "scenes" / "ell.h5", "--json").json
    assert (found["feature_count"], found["seed"], found["mean_degree"]) == (8, 4, pytest.approx(4 / 3))


def test_a_plan_drawn_by_hand_has_larger_cells_than_published_ones(clearway, plans, tmp_path):
    (tmp_path / "office.txt").write_text("....\n.#..\n")
    (tmp_path / "list.csv").write_text("x,z\n0,0\n1,0\n")
    told = {
        "office.txt": "office.h5: 28 states, 7 cells of 0.5 m, 2 x 1 m",
        "list.csv": "list.h5: 8 states, 2 cells of 0.5 m, 1 x 0.5 m",
        "plans.npz": "hall.h5: 12 states, 3 cells of 0.25 m, 0.25 x 0.75 m",
    }
    for name, said in told.items():
        answer = clearway("scenes", "import", "floor-plan", tmp_path / name, "--features", 8, "--out", tmp_path / "out")
        assert said in answer.err


def test_parts_that_cannot_be_reached_are_reported(clearway, tmp_path):
    (tmp_path / "flat.txt").write_text("WWWWW\nW..W.\nWWDWW\nW...W\n")
    answer = clearway("scenes", "import", "floor-plan", tmp_path / "flat.txt", "--features", 8, "--out", tmp_path)
    assert answer.code == 0, answer
    assert "flat: 1 part cannot be reached from the largest part (kept in the scene): 1 cell at (4, 2)" in answer.err
    found = clearway("scenes", "inspect", tmp_path / "flat.h5", "--json").json
    assert (found["cells"], found["components"], found["component_sizes"]) == (7, 2, [24, 4])


@pytest.mark.parametrize("words", [(), ("--features", 4)])
def test_a_door_in_no_wall_is_one_line(clearway, tmp_path, words):
    (tmp_path / "flat.txt").write_text("...\n.D.\n...\n")
    answer = clearway("scenes", "import", "floor-plan", tmp_path / "flat.txt", "--out", tmp_path / "scenes", *words)
    assert answer.refusal("flat.txt", "has a door in the cell (1, 1) that is in no wall", "Put walls")
    assert not (tmp_path / "scenes").exists()


def test_a_map_can_be_drawn_without_a_picture_from_above(clearway, tmp_path):
    (tmp_path / "room.txt").write_text("..#\n...\n")
    assert (
        clearway("scenes", "import", "floor-plan", tmp_path / "room.txt", "--out", tmp_path, "--features", 8).code == 0
    )
    assert clearway("scenes", "inspect", tmp_path / "room.h5", "--map", tmp_path / "room.png").code == 0
    assert (tmp_path / "room.png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("--name", "attic"), ("plans.npz", "attic", "Name one of hall, ell")),
        (("--features", "0"), ("plans.npz", "0 features", "Ask for")),
        (("--features", "8", "--encoder", "resnet50"), ("--encoder says how to encode", "leave out --encoder")),
        (("--seed", "-1"), ("the seed must be 0 or more",)),
        (("--seed", "-1", "--features", "8"), ("the seed must be 0 or more",)),
        (("--cell-size", "0"), ("plans.npz", "'hall'", "cell size of 0.0 m")),
    ],
)
def test_what_cannot_be_made_is_one_line(clearway, plans, tmp_path, words, parts):
    assert clearway("scenes", "import", "floor-plan", plans, "--out", tmp_path / "scenes", *words).refusal(*parts)
    assert not (tmp_path / "scenes").exists()
