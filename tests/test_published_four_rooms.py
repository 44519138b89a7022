"""What the pages say of the published settings in four rooms is what their records come to."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from helpers.published import (
    DOCS,
    EVIDENCE,
    assert_written,
    numbers,
    rows_of,
    section_of,
    unpack,
)


def four_rooms(record: str, folder: Path) -> Iterator[tuple[dict[str, Any], int, dict[str, np.ndarray], str]]:
    """Of each trial of a record: its run, after how many million frames, its episodes, and which targets were lost."""
    unpack(record, folder)
    for trial in sorted(folder.glob("runs/*/trials/*.json")):
        content = json.loads(trial.read_text(encoding="utf-8"))
        run = json.loads((trial.parents[1] / "run.json").read_text(encoding="utf-8"))
        episodes = {name: np.array(column) for name, column in content["episodes"].items()}
        lost = set(episodes["target"][~episodes["reached"].astype(bool)].tolist())
        frames = run["learner"]["frames"] // 10**6
        yield run, frames // 2 if content["about"]["halfway"] else frames, episodes, f"{len(lost)} of 20"


def row_of(begin: str) -> list[str]:
    """Cells of the row of the evidence that begins so, without commas."""
    lines = EVIDENCE.splitlines()
    (line,) = [line for line in lines if line.startswith(begin)]
    return line.removeprefix(begin).replace(",", "").strip(" |").split(" | ")


def test_four_rooms_otherwise_are_what_their_record_comes_to(tmp_path: Path) -> None:
    trials = list(four_rooms("four-rooms-otherwise", tmp_path / "four"))
    assert len(trials) == 8
    for run, frames, episodes, lost in trials:
        learner = run["learner"]
        changed = "whitened" if learner["whiten_features"] else "3 x rate"
        assert learner["lr_start"] == (0.0007 if changed == "whitened" else 0.0021)
        begin = f"| {run['reward']['name']}, {changed} | {frames} M | "
        steps, collisions, failed = row_of(begin)
        assert_written(steps, episodes["steps"].mean(), begin)
        assert_written(collisions, episodes["collisions"].mean(), begin)
        assert failed == lost


def test_the_rule_promises_four_rooms_what_is_said() -> None:
    (walk,) = [
        line for line in EVIDENCE.splitlines() if line.startswith("| random walk | 758, 106 |") and "2,626" in line
    ]
    steps = float(numbers(walk.replace(",", "").split("|")[6])[0])
    told = " to ".join(f"{steps * 20 * factor / 1e6:.1f}" for factor in (163, 176))
    assert f"x targets x 163 to 176) had promised `shortest` {told} M frames" in EVIDENCE


@pytest.mark.slow
@pytest.mark.parametrize(
    ("record", "encoder", "called"),
    [("four-rooms-eyes", "clearway", "by the eyes"), ("four-rooms-longer", "random-resnet50", "twice as long")],
)
def test_four_rooms_as_published_are_what_their_record_comes_to(
    record: str, encoder: str, called: str, tmp_path: Path
) -> None:
    trials = list(four_rooms(record, tmp_path / "four"))
    assert len(trials) == 4
    for run, frames, episodes, lost in trials:
        assert {scene["encoder"] for scene in run["scenes"]} == {encoder}
        assert [scene["name"] for scene in run["scenes"]] == ["bathroom", "bedroom", "living_room", "kitchen"]
        begin = f"| {run['reward']['name']}, {called} | {frames} M | "
        *cells, failed = row_of(begin)
        assert failed == lost
        room = np.array([number for number, scene in enumerate(run["scenes"]) for _ in scene["targets"]])
        for number, cell in enumerate(cells):
            own = room[episodes["target"]] == number
            steps, collisions, arrive, _ = cell.split()
            assert_written(steps, episodes["steps"][own].mean(), begin)
            assert_written(collisions, episodes["collisions"][own].mean(), begin)
            assert_written(arrive, 100 * episodes["reached"][own].mean(), begin)
            assert arrive != "100" or episodes["reached"][own].all(), begin
    if record == "four-rooms-longer":
        check_beside_the_eyes(trials)


def check_beside_the_eyes(trials: Sequence[tuple[dict[str, Any], int, dict[str, np.ndarray], str]]) -> None:
    """What the page of the eyes says of a random ResNet-50, halfway to 20 M frames."""
    part = section_of((DOCS / "seeing.md").read_text(encoding="utf-8"), "The paper's own network on them")
    walked = set()
    for run, frames, episodes, lost in trials:
        room = np.array([number for number, scene in enumerate(run["scenes"]) for _ in scene["targets"]])
        own = room[episodes["target"]]
        means = [
            [episodes[name][own == one].mean() for name in ("steps", "shortest_path_steps")]
            for one in range(len(run["scenes"]))
        ]
        walked.add(sum(steps <= 2 * shortest for steps, shortest in means))
        (line,) = [cells for cells in rows_of(part) if cells[0] == run["reward"]["name"]]
        assert frames != 10 or f"{line[2]} of 20" == lost
    assert walked == {2} and "on a random ResNet-50 two.** (Which two differs by reward: halfway through [20 M" in part
