from pathlib import Path

import pytest
from PIL import Image


def photographed(folder: Path) -> Path:
    """Two places, four photographs each."""
    lines = ["file,x,z,heading"]
    for z in (0.0, 0.5):
        for heading in (0, 90, 180, 270):
            name = f"{z}-{heading}.png"
            Image.new("RGB", (40, 30), (int(100 * z), heading // 2, 9)).save(folder / name)
            lines.append(f"{name},0,{z},{heading}")
    table = folder / "office.csv"
    table.write_text("\n".join(lines))
    return table


def test_photographs_become_a_scene_that_can_be_inspected(clearway, tmp_path: Path, monkeypatch) -> None:
    table = photographed(tmp_path)
    answer = clearway("scenes", "import", "images", table, "--out", tmp_path / "scenes", "--height", 30)
    assert answer.code == 0, answer
    found = clearway("scenes", "inspect", tmp_path / "scenes" / "office.h5", "--json").json
    assert (found["states"], found["cells"], found["headings"]) == (8, 2, 4)
    assert found["encoder"] == "clearway"
    assert found["source"] == "images"


def test_tables_of_one_name_become_scenes_of_their_folders(clearway, tmp_path: Path) -> None:
    words = ("--out", tmp_path / "scenes", "--height", 30)
    answers = []
    for place in ("office", "lab", "lab"):
        (tmp_path / place).mkdir(exist_ok=True)
        table = photographed(tmp_path / place).rename(tmp_path / place / "poses.csv")
        answers.append(clearway("scenes", "import", "images", table, *words))
    assert [answer.code for answer in answers] == [0, 0, 0], answers
    assert sorted(path.name for path in (tmp_path / "scenes").iterdir()) == ["lab.h5", "office.h5"]
    assert ["replaces the scene" in " ".join(answer.err.split()) for answer in answers] == [False, False, True]


def test_a_missing_photograph_is_named_and_nothing_is_written(clearway, tmp_path: Path) -> None:
    table = photographed(tmp_path)
    (tmp_path / "0.5-90.png").unlink()
    answer = clearway("scenes", "import", "images", table, "--out", tmp_path / "scenes")
    assert answer.refusal("office.csv", "line 7", "0.5-90.png")
    assert not (tmp_path / "scenes").exists()


@pytest.mark.parametrize("name", ["../office", "..", "a\nb"])
def test_a_name_that_no_file_can_have_is_refused(clearway, tmp_path: Path, name: str) -> None:
    table = photographed(tmp_path)
    words = ("scenes", "import", "images", table, "--out", tmp_path / "scenes", "--name", name)
    assert clearway(*words).refusal("cannot be a scene's name", "without slashes")
    assert not (tmp_path / "office.h5").exists() and not (tmp_path / "scenes").exists()
