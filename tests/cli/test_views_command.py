from __future__ import annotations

from pathlib import Path

import pytest

import clearway as door
from clearway.live.conditions import REFERENCE, Perturbations
from clearway.live.words import GEOMETRY
from clearway.scenes.thor_v1 import write_scene
from clearway.views import files
from clearway.views.files import shard_path
from clearway.views.settings import ViewSettings
from helpers.made import corridor_scene
from helpers.made_views import write_made


@pytest.fixture
def asked(monkeypatch) -> list[ViewSettings]:
    """What is asked for; empty files stand in for views."""
    found: list[ViewSettings] = []

    def take(scene_files, folder, settings, **rest) -> list[Path]:
        found.append(settings)
        folder.mkdir(exist_ok=True)
        missing = [shard_path(path, folder) for path in scene_files if not shard_path(path, folder).exists()]
        for path in missing:
            path.touch()
        return missing

    monkeypatch.setattr(files, "take_missing", take)
    return found


@pytest.fixture
def rooms(tmp_path) -> Path:
    """A folder of two scenes."""
    for name in ("one", "two"):
        write_scene(corridor_scene(name=name), tmp_path / f"rooms/{name}.h5")
    return tmp_path / "rooms"


def test_what_is_asked_for_is_taken_and_told(clearway, tmp_path, rooms, asked):
    out = tmp_path / "views"
    first = clearway("scenes", "views", rooms / "one.h5", "--out", out)
    assert first.code == 0 and "1 made, one.h5" in first.err
    words = ("--poses", 50, "--perturb", "all", "light=0.1", "--sensors", "rgb", "depth", "--size", 48, 64)
    second = clearway("scenes", "views", rooms, "--out", out, *words, "--seed", 3, "--held-out", "--scene-headings")
    assert "1 made, 1 were there, one.h5 to two.h5" in second.err
    third = clearway("scenes", "views", rooms, "--out", out, "--perturb", "none", "--compress")
    assert third.code == 0
    lit = Perturbations(**{**REFERENCE.to_json(), "light": 0.1})
    assert asked == [
        ViewSettings(perturbations=GEOMETRY),
        ViewSettings(50, 2, 3, lit, ("rgb", "depth"), (48, 64), held_out=True, scene_headings=True),
        ViewSettings(takes=1, perturbations=Perturbations(), compress=True),
    ]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--perturb", "fog"), "--perturb 'fog': there is none of that name"),
        (("--poses", 0), "--poses 0: expected 1 to 100000"),
        (("--takes", 2, "--perturb", "none"), "--takes 2: without perturbations"),
        (("--sensors", "depth"), "leaves out rgb"),
        (("--size", 4, 4), "--size 4: expected 16 to 1024"),
        (("--workers", 0), "--workers 0"),
        (("--seed", -1), "--seed -1"),
    ],
)
def test_bad_words_are_one_line_and_nothing_is_written(clearway, tmp_path, rooms, words, said):
    done = clearway("scenes", "views", rooms, "--out", tmp_path / "views", *words)
    assert done.code == 2 and said in done.err and done.err.count("\n") == 1
    assert not (tmp_path / "views").exists()


def test_places_that_are_none_are_one_line(clearway, tmp_path, rooms):
    assert "no scene given" in clearway("scenes", "views", "--out", tmp_path / "views").err
    assert "no such file" in clearway("scenes", "views", tmp_path / "none", "--out", tmp_path / "views").err
    (tmp_path / "file").touch()
    assert "a file. Give a folder" in clearway("scenes", "views", rooms, "--out", tmp_path / "file").err


def test_views_are_inspected_a_file_or_a_folder(clearway, tmp_path):
    for name in ("one", "two"):
        write_made(tmp_path, name)
    found = clearway("scenes", "inspect", tmp_path, "--json").json
    assert (found["rooms"], found["pictures"], found["poses"], found["takes"]) == (2, 40, 10, 2)
    assert found["perturbations"]["new_obstacle"] is True and "light" not in found["perturbations"]
    assert sum(found["zones"].values()) == 40 and found["sensors"][1].startswith("depth (16 x 16 float32")
    one = clearway("scenes", "inspect", tmp_path / "one.h5")
    assert one.code == 0 and "pictures" in one.out
    assert "have no map" in clearway("scenes", "inspect", tmp_path / "one.h5", "--map", "map.png").err
    content = bytearray((tmp_path / "one.h5").read_bytes())
    at = content.index(bytes(door.open_views(tmp_path / "one.h5").shards[0].rgb[7].tobytes()[:64]))
    content[at] ^= 1
    (tmp_path / "one.h5").write_bytes(content)
    done = clearway("scenes", "inspect", tmp_path)
    assert done.code == 2 and "one.h5, dataset 'rgb': is damaged" in done.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"perturb": "all"}, "perturb='all': expected words"),
        ({"poses": True}, "poses=True"),
        ({"held_out": 1}, "held_out=1: expected True or False"),
        ({"size": 96}, "size=96"),
        ({"out": 3}, "out=3"),
        ({"scenes": 3}, "scenes=3"),
        ({"sensors": "rgb"}, "is a text"),
    ],
)
def test_wrong_arguments_in_python_are_one_error(tmp_path, rooms, arguments, said):
    with pytest.raises(door.ClearwayError, match=said):
        door.take_views(**{"scenes": rooms, "out": tmp_path / "views", **arguments})
    assert not (tmp_path / "views").exists()
