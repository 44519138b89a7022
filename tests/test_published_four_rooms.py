"""What the pages say of the published settings in four rooms is what their records come to."""

import json
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from helpers.published import (
    DOCS,
    EVIDENCE,
    RESULTS,
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


def setting_of(learner: Mapping[str, Any]) -> str:
    """Which of the three settings of four rooms a run has, as the tables call it."""
    settings = tuple(learner[name] for name in ("lr_start", "centre_features", "whiten_features", "frames"))
    return {
        (0.0021, False, False, 10_000_000): "3 x rate",
        (0.0007, True, True, 10_000_000): "whitened",
        (0.0007, False, False, 20_000_000): "twice as long",
    }[settings]


def test_three_seeds_in_four_rooms_are_what_their_records_come_to(tmp_path: Path) -> None:
    lost: dict[str, dict[int, str]] = {}
    arrive = defaultdict[str, list[dict[str, float]]](list)  # at the end: by reward, of each run, at each target
    for record in ("four-rooms-otherwise", "four-rooms-longer", "four-rooms-seeds"):
        for run, frames, episodes, failed in four_rooms(record, tmp_path / record):
            assert {scene["encoder"] for scene in run["scenes"]} == {"random-resnet50"}
            begin = f"| {run['reward']['name']}, {setting_of(run['learner'])}, by seed | {frames} M | "
            lost.setdefault(begin, {})[run["seed"]] = failed.removesuffix(" of 20")
            if frames == run["learner"]["frames"] // 10**6:
                arrive[run["reward"]["name"]].append(arrivals(run, episodes))
    assert len(lost) == 12  # halfway, too
    for begin, by_seed in lost.items():
        *cells, solve = row_of(begin)
        assert cells == [by_seed[seed] for seed in range(3)], begin
        assert solve == f"{list(by_seed.values()).count('0')} of 3", begin
    after = {begin.split(", ")[0].strip("| "): by_seed for begin, by_seed in lost.items() if "| 20 M" in begin}
    usual, careful = (
        sorted({int(count) for count in after[name].values()}) for name in ("shortest", "collision-aware")
    )
    assert (usual, careful) == ([3, 5], [5])
    assert "none of 18 runs" in RESULTS and "after 20 M `shortest` loses 3 to 5, `collision-aware` 5 (" in RESULTS
    page = section_of(EVIDENCE, "Four rooms, three seeds")
    check_who_is_lost(arrive, page)
    (ten, twenty) = (minutes_of(tmp_path / "four-rooms-seeds", frames) for frames in (10_000_000, 20_000_000))
    assert len(ten) == 8 and len(twenty) == 4
    told = f"{min(ten):.0f} to {max(ten):.0f} minutes for 10 M frames, {min(twenty):.0f} to {max(twenty):.0f} for 20 M."
    assert told in page


def minutes_of(record: Path, frames: int) -> list[float]:
    """How long the runs of a record took that came to that many frames."""
    paths = record.glob("runs/*/metrics.jsonl")
    ends = [json.loads(path.read_text(encoding="utf-8").splitlines()[-1]) for path in paths]
    return [end["seconds"] / 60 for end in ends if end["frames"] == frames]


def arrivals(run: Mapping[str, Any], episodes: Mapping[str, np.ndarray]) -> dict[str, float]:
    """The share of episodes that arrive, by target."""
    targets = [f"{scene['name']} {state}" for scene in run["scenes"] for state in scene["targets"]]
    return {
        target: float(episodes["reached"][episodes["target"] == number].mean()) for number, target in enumerate(targets)
    }


def check_who_is_lost(arrive: Mapping[str, Sequence[Mapping[str, float]]], page: str) -> None:
    """What was seen at single targets at the end of the 18 runs."""
    runs = [run for of_reward in arrive.values() for run in of_reward]
    assert len(runs) == 18 and not any(min(run.values()) == 1 for run in runs)
    always = [target for target in runs[0] if all(run[target] < 1 for run in runs)]
    assert always == ["living_room 119"] and "at the end all 18 lose episodes to one target, living room 119." in page
    assert f"{sum(run['kitchen 560'] < 1 for run in runs)} of 18 lose some to kitchen 560." in page
    told = [
        f"`{reward}`{{}} in {100 * min(found):.0f} to {100 * max(found):.0f} %"
        for reward in ("shortest", "collision-aware")
        for found in [[run["living_room 119"] for run in arrive[reward]]]
    ]
    assert f"Those of {told[0].format(' arrive there')} of episodes, those of {told[1].format('')}." in page
    least = min(min(run.values()) for run in arrive["shortest"])
    assert f"`shortest` arrives in {100 * least:.0f} % or more of the episodes at every target" in page
    few = [sum(share < 0.5 for share in run.values()) for run in arrive["collision-aware"]]
    assert (min(few), max(few)) == (1, 6) and "`collision-aware` in fewer than half at one to six." in page


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
