"""The same plans read from every kind of file, and files that are none."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.scenes import floor_plan_files
from clearway.scenes.floor_plan_files import floor_plan_names, read_floor_plan

# Seen from above, 3 cells wide and 2 deep:
#   . # #
#   . . #
ELL = [(0, 0), (0, 1), (1, 0)]
MAP = ".##\n..#\n"


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text)
    return path


def cells_of(path: Path, name: str | None = None) -> list[tuple[int, int]]:
    return sorted(tuple(cell) for cell in read_floor_plan(path, name).cells.tolist())


def test_all_kinds_of_files_hold_the_same_plan(tmp_path: Path) -> None:
    np.savez(tmp_path / "cells.npz", ell=np.array(ELL, np.int16))
    np.savez_compressed(tmp_path / "map.npz", ell=np.array([[1, 1], [1, 0], [0, 0]], bool))
    files = [
        tmp_path / "cells.npz",
        tmp_path / "map.npz",
        write(tmp_path, "list.csv", "x,z\n1,0\n0,0\n0,1\n"),
        write(tmp_path, "map.csv", "1,0,0\n1, 1,0\n"),
        write(tmp_path, "map.txt", MAP),
        write(tmp_path, "marked.txt", "\ufeff\n\n" + MAP.replace("\n", " \r\n") + "\n"),
    ]
    for path in files:
        assert cells_of(path) == ELL, path


def test_a_text_file_may_have_walls_and_doors(tmp_path: Path) -> None:
    plan = read_floor_plan(write(tmp_path, "flat.txt", "W.W\n#DW\n"), cell_size_m=0.5)
    assert plan.cells.tolist() == [[1, 0], [1, 1]] and plan.doors.tolist() == [[1, 0]]
    assert plan.walls.tolist() == [[0, 1], [2, 0], [2, 1]]
    assert (plan.name, plan.cell_size_m, plan.source) == ("flat", 0.5, str(tmp_path / "flat.txt"))


def test_a_file_of_many_plans(tmp_path: Path) -> None:
    path = tmp_path / "plans.npz"
    np.savez(path, hall=np.array([[4, 4]]), ell=np.array(ELL))
    assert floor_plan_names(path) == ("hall", "ell")
    plan = read_floor_plan(path, "hall", cell_size_m=0.5)
    assert (plan.name, plan.cells.tolist(), plan.cell_size_m) == ("hall", [[4, 4]], 0.5)
    assert cells_of(path, "ell") == ELL
    with pytest.raises(SceneError, match=r"plans.npz: holds 2 plans. Name one of hall, ell"):
        read_floor_plan(path)
    with pytest.raises(SceneError, match=r"plans.npz: holds no plan named attic. Name one of hall, ell"):
        read_floor_plan(path, "attic")


def test_a_text_file_holds_the_plan_of_its_own_name(tmp_path: Path) -> None:
    path = write(tmp_path, "hall.txt", "..\n")
    assert floor_plan_names(path) == ("hall",)
    assert read_floor_plan(path).name == "hall"
    with pytest.raises(SceneError, match="holds no plan named attic"):
        read_floor_plan(path, "attic")


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.txt", "..\n.\n", "line 2 has 1 cells, the first has 2"),
        (
            "a.txt",
            "..\n.x\n",
            r"line 2, column 2 holds 'x'. Write # for blocked, \. for reachable, W for a wall and D for a door in it",
        ),
        ("a.txt", "##\n##\n", "has 0 reachable cells"),
        ("a.txt", " \n\n", "is empty"),
        ("a.csv", "1,0\n2,1\n", "line 2, column 1 holds '2'. Write 0 for blocked and 1 for reachable"),
        ("a.csv", "x,z\n1,0\n1\n", "line 3 is '1', expected two whole numbers"),
        ("a.csv", "x,z\n1,0.5\n", "line 2 is '1,0.5', expected two whole numbers"),
        ("a.csv", "x,z\n1,99999999999999999999\n", "line 2 is '1,9999"),
        ("a.csv", "x,z\n1,0\n1,0\n", r"names the cell \(1, 0\) twice"),
        ("a.csv", "x,z\n", "has 0 reachable cells"),
        ("a.map", "..\n", r"its name ends in '.map', expected .npz or .csv or .txt"),
        ("a.npz", "..\n", "cannot be read .*zip"),
        (".txt", "..\n", "its name ends in ''"),
        ("§.txt", "..\n", "'§' is no name for a file"),
    ],
)
def test_files_that_hold_no_plan(tmp_path: Path, name: str, text: str, message: str) -> None:
    path = write(tmp_path, name, text)
    with pytest.raises(SceneError, match=f"^{path}.*{message}"):
        read_floor_plan(path)


def test_arrays_that_are_no_plan(tmp_path: Path) -> None:
    path = tmp_path / "plans.npz"
    np.savez(path, floats=np.zeros((2, 2)), flat=np.zeros(4, np.int64), objects=np.array([{}]), line=np.ones(3, bool))
    for name, message in {
        "floats": r"is float64 of shape \(2, 2\)",
        "flat": r"is int64 of shape \(4,\)",
        "objects": "cannot be read .*allow_pickle=False",
        "line": r"is bool of shape \(3,\)",
    }.items():
        with pytest.raises(SceneError, match=f"^{path}, dataset '{name}': {message}"):
            read_floor_plan(path, name)


def test_files_that_are_missing_or_not_text(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="there is no such file"):
        read_floor_plan(tmp_path / "none.txt")
    (tmp_path / "bytes.txt").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneError, match="cannot be read"):
        read_floor_plan(tmp_path / "bytes.txt")
    np.savez(tmp_path / "empty.npz")
    with pytest.raises(SceneError, match="holds no array"):
        read_floor_plan(tmp_path / "empty.npz")


def test_names_lead_out_of_no_folder(tmp_path: Path) -> None:
    path = tmp_path / "plans.npz"
    np.savez(path, **{"../../attic": np.array(ELL)})
    with pytest.raises(SceneError, match=r"'../../attic' is no name for a file"):
        read_floor_plan(path)


def test_files_that_are_too_large(tmp_path: Path, monkeypatch) -> None:
    np.savez_compressed(tmp_path / "zeros.npz", zeros=np.zeros((40_000, 2), np.int64))
    text = write(tmp_path, "map.txt", "." * 2000)
    monkeypatch.setattr(floor_plan_files, "MAX_BYTES", 1000)
    with pytest.raises(SceneError, match=r"dataset 'zeros': cannot be read .*unpack to more than"):
        read_floor_plan(tmp_path / "zeros.npz")
    with pytest.raises(SceneError, match=r"cannot be read .*larger than"):
        read_floor_plan(text)


def test_a_damaged_archive_is_one_clear_error_or_the_same_plan(tmp_path: Path) -> None:
    path = tmp_path / "plans.npz"
    np.savez_compressed(path, ell=np.array(ELL))
    whole, refused = path.read_bytes(), 0
    rng = np.random.default_rng(0)
    for _ in range(300):
        damaged = bytearray(whole)
        damaged[rng.integers(len(damaged))] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        try:
            assert cells_of(path) == ELL
        except SceneError:
            refused += 1
    assert refused > 100


def test_an_archive_is_opened_twice_however_many_plans_it_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "many.npz"
    np.savez(path, **{f"plan{number}": np.ones((2, 2 + number), bool) for number in range(9)})
    opened = []

    class Counted(zipfile.ZipFile):
        def __init__(self, *words: object) -> None:
            opened.append(words)
            super().__init__(*words)

    monkeypatch.setattr(floor_plan_files.zipfile, "ZipFile", Counted)
    plans = floor_plan_files.read_floor_plans(path)
    assert [(plan.name, len(plan.cells)) for plan in plans] == [(f"plan{n}", 2 * (2 + n)) for n in range(9)]
    assert len(opened) == 2
    assert [plan.name for plan in floor_plan_files.read_floor_plans(path, ("plan7", "plan1"))] == ["plan7", "plan1"]
