"""`clearway runs`: list, compare, clean."""

import json
import shutil
from pathlib import Path

import pytest

from clearway.learn.checkpoint import newest_checkpoint
from clearway.learn.run_folder import RunFolder


@pytest.fixture
def runs(clearway, trained, small, tmp_path, monkeypatch) -> Path:
    """Two runs in runs/, the second made longer, so that it has two checkpoints."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(trained.run, "runs/a")
    words = ("train", trained.scene, "--out", "runs/sub/b", "--reward", "shortest", "--targets", 26, 37, *small)
    assert clearway(*words).code == 0
    assert clearway(*words, "frames=1280", "--frames", 1280, "--resume").code == 0
    return Path("runs")


def files_below(folder: Path) -> set[str]:
    return {str(path) for path in folder.rglob("*") if path.is_file() and path.name != ".lock"}


def test_runs_are_listed(clearway, runs):
    answer = clearway("runs", "list")
    assert (answer.code, answer.err) == (0, "")
    *rows, caption = answer.out.splitlines()
    head, first, second = (line.split() for line in rows)
    assert caption.startswith("success, steps, collisions: of training's episodes")
    assert head == ["run", "reward", "algorithm", "seed", "frames", "solved", "success", "steps", "collisions"]
    assert (first[0], second[:6]) == ("runs/a", ["runs/sub/b", "shortest", "ppo", "0", "1,280", "0"])
    told = clearway("runs", "list", "runs", "--json").json
    assert [(run["run"], run["frames"], run["targets"]) for run in told] == [
        ("runs/a", 640, 5),
        ("runs/sub/b", 1280, 2),
    ]


def test_a_run_under_way_says_how_far_it_is(clearway, runs):
    path = runs / "a" / "run.json"
    content = json.loads(path.read_text())
    content["learner"]["frames"] = 5000
    path.write_text(json.dumps(content))
    assert "640 of 5,000" in clearway("runs", "list").out


def test_a_run_that_cannot_be_read_hides_no_other(clearway, runs):
    (runs / "a" / "run.json").write_text("{")
    answer = clearway("runs", "list")
    assert answer.code == 0
    assert answer.err.startswith("left out: runs/a/run.json: not readable")
    assert "runs/sub/b" in answer.out and "runs/a " not in answer.out


def test_what_lies_in_a_run_is_no_other_run(clearway, runs):
    for place in (runs / "a" / ".copied-0f", runs / ".trash"):  # as a copy under way has it
        place.mkdir()
        shutil.copy(runs / "a" / "run.json", place)
    shutil.copytree(runs / "sub" / "b", runs / "a" / "kept")
    assert [run["run"] for run in clearway("runs", "list", "--json").json] == ["runs/a", "runs/sub/b"]


def test_a_run_of_damaged_checkpoints_keeps_no_other_from_being_cleaned(clearway, runs):
    for path in (runs / "a" / "checkpoints").iterdir():
        for file in path.iterdir():
            file.write_bytes(b"")
    answer = clearway("runs", "clean", "--yes")
    assert answer.code == 0 and "left alone: " in answer.err and "removed 1 old checkpoint" in answer.err


def test_folders_without_runs(clearway, tmp_path):
    assert clearway("runs", "list", tmp_path).refusal("holds no runs", "clearway train")
    for name in ("list", "clean"):
        assert clearway("runs", name, tmp_path / "none").refusal("none: no such folder")


def test_runs_are_compared(clearway, runs):
    answer = clearway("runs", "compare", "runs/a", "runs/sub/b", "--curves", "curves.png")
    assert (answer.code, answer.err) == (0, "curves.png: learning curves\n")
    assert Path("curves.png").read_bytes().startswith(b"\x89PNG")
    rows = [line.split() for line in answer.out.splitlines()]
    assert ["frames", "640", "1280"] in rows
    assert ["targets", "bathroom_02=26,37"] in [[row[0], row[-1]] for row in rows]
    assert not {"seed", "discount"} & {row[0] for row in rows}  # in which they agree
    told = clearway("runs", "compare", "runs/a", "runs/sub/b", "--json").json
    assert told["differences"]["frames"] == ["640", "1280"]
    assert [run["run"] for run in told["runs"]] == ["runs/a", "runs/sub/b"]


def test_comparisons_that_cannot_be(clearway, runs):
    assert clearway("runs", "compare", "runs/a", "runs/a").refusal("two run folders or more")
    assert clearway("runs", "compare", "runs/a", "runs/sub").refusal("runs/sub: no run here")
    words = ("runs", "compare", "runs/a", "runs/sub/b", "--curves", "run.json")
    assert clearway(*words).refusal("ends in .png", "--curves")


def test_old_checkpoints_go_only_with_yes(clearway, runs):
    before = files_below(runs)
    answer = clearway("runs", "clean")
    (line,) = answer.out.splitlines()
    assert line.startswith("runs/sub/b/checkpoints/frames-000000000640  ")
    assert "1 old checkpoint, " in answer.err and "clearway runs clean runs --yes" in answer.err
    assert files_below(runs) == before
    answer = clearway("runs", "clean", "--yes")
    assert answer.code == 0 and answer.err.startswith("removed 1 old checkpoint, ")
    gone = before - files_below(runs)
    assert {str(Path(path).parent) for path in gone} == {"runs/sub/b/checkpoints/frames-000000000640"}
    assert clearway("evaluate", "runs/sub/b", "--episodes", 1, "--step-limit", 5).code == 0
    assert clearway("runs", "clean").err == "0 old checkpoints, 0.0 MB\n"


def test_looking_writes_nothing(clearway, runs):
    for lock in runs.rglob(".lock"):
        lock.unlink()
    (runs / "sub/b/.run.json.x.part").touch()
    before = {path: path.stat().st_mtime_ns for path in runs.rglob("*")}
    for words in (("list",), ("clean",), ("compare", "runs/a", "runs/sub/b"), ("clean", "runs/a", "--yes")):
        assert clearway("runs", *words).code == 0
    assert {path: path.stat().st_mtime_ns for path in runs.rglob("*")} == before


def test_the_newest_checkpoint_that_can_be_read_stays(clearway, runs):
    newest = newest_checkpoint(runs / "sub" / "b" / "checkpoints")
    (newest / "network.safetensors").write_bytes(b"broken")
    before = files_below(runs)
    assert clearway("runs", "clean", "--yes").out == ""
    assert files_below(runs) == before


def test_a_run_that_trains_is_left_alone(clearway, runs):
    before = files_below(runs)
    with RunFolder(runs / "sub" / "b").held():
        answer = clearway("runs", "clean", "--yes")
    assert "left alone: runs/sub/b: another process trains here" in answer.err
    assert files_below(runs) == before


def test_on_80_columns_a_long_name_stays_whole(clearway, runs, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    long = runs / "bathroom-collision-aware-alpha-0.02-gamma-0.015-ppo-s0"
    (runs / "a").rename(long)
    lines = [line.rstrip() for line in clearway("runs", "list").out.splitlines()]
    assert (lines[0], lines[1].split()[0], lines[1].split()[-1], lines[2]) == ("run", "reward", "collisions", str(long))
    assert max(map(len, lines)) <= 80
    assert "runs/sub/b" in lines and any(line.split()[:2] == ["shortest", "ppo"] for line in lines)


def test_on_80_columns_a_long_training_under_way_stays_whole(clearway, runs, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    path = runs / "a" / "run.json"
    content = json.loads(path.read_text())
    content["learner"]["frames"] = 5_000_000
    path.write_text(json.dumps(content))
    metrics = runs / "a" / "metrics.jsonl"
    last = json.loads(metrics.read_text().splitlines()[-1]) | {"frames": 4_946_176, "solved_targets": 1797}
    metrics.write_text(json.dumps(last) + "\n")
    told = clearway("runs", "list").out
    assert max(len(line.rstrip()) for line in told.splitlines()) <= 80
    assert "\N{HORIZONTAL ELLIPSIS}" not in told
    assert {"algorithm", "success", "collisions", "4,946,176", "5,000,000", "1797"} < set(told.split())


def test_compared_runs_of_long_names_are_numbered(clearway, runs, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    long = runs / f"bathroom-{'x' * 80}"
    (runs / "a").rename(long)
    lines = [line.rstrip() for line in clearway("runs", "compare", long, "runs/sub/b").out.splitlines()]
    assert lines.index(f"1  {long}") + 1 == lines.index("2  runs/sub/b")
    assert ["differs", "in", "1", "2"] in [line.split() for line in lines]
    assert ["frames", "640", "1280"] in [line.split() for line in lines]
