"""What the pages say of agents that see is what their records come to."""

import json
import re
import runpy

import numpy as np
import pytest

from clearway.evaluation.bootstrap import RESAMPLES, intervals
from clearway.experiments.correction import LEVEL, holm
from clearway.perception.encode import find_record
from clearway.perception.eyes import NAME
from helpers.published import DOCS, assert_written, numbers, words_of

PAGE = "".join((DOCS / page).read_text(encoding="utf-8") for page in ("seeing.md", "evidence.md"))
COLUMNS = ("success", "success_4x", "spl", "collisions")
ARRIVALS = ("false_arrivals", "missed_arrivals")
SHARES = ("success", "success_4x", "spl")
THIRD, FOURTH, FIFTH, SIXTH = (f"generalist-test-{number}.json" for number in ("third", "fourth", "fifth", "sixth"))
TOURS, WALKERS, AGAIN = "generalist-tours.json", "walkers-test.json", "off-grid-again.json"
FROZEN, ELSEWHERE = "generalist-frozen.json", "walkers-elsewhere.json"
STOPPED = json.loads((DOCS / "figures" / "generalist-stopped.json").read_text(encoding="utf-8"))
NO_MEMORY, NO_CELLS, NEAREST = "without memory", "without the map's cells", "nearest picture of the tour"
EARLIER_WALKERS = "recurrent-test.json"
THEIRS = ("RecurrentPPO, 16 x 128", "RecurrentPPO, 96 x 32")
KINDS = ("collision-aware", "shortest", "bump", "clearance")
ROWS = [
    (FROZEN, "rooms", "generalist", "| rooms | 100 % | 93.8 % (92.7-94.8)"),
    (FROZEN, "rooms", "collisions cost nothing", "| rooms, collisions cost nothing | 100 % | 92.8 % (91.7-94.0)"),
    (FROZEN, "rooms", "random", "| rooms, random walk | 75.2 % (71.8-78.7) | 8.2 % (7.0-9.5)"),
    (FROZEN, "flats", "generalist", "| flats | 89.6 % (86.3-92.5) | 43.2 % (39.2-47.5)"),
    (FROZEN, "flats", "random", "| flats, random walk | 18.9 % (16.5-21.4) | 1.8 % (0.9-2.7)"),
    (FROZEN, "rooms-tour", "generalist", "| rooms, after a tour |"),
    (FROZEN, "flats-tour", "generalist", "| flats, after a tour |"),
    (FROZEN, "real-tour", "generalist", "| real plans, after a tour |"),
    (FROZEN, "rooms-perturbed-tour", "generalist", "| toured, perturbed |"),
    (FROZEN, "held-out-perturbed-tour", "generalist", "| toured, perturbed, targets held out |"),
    (FROZEN, "without", "generalist", "| not toured, all of it |"),
    (FROZEN, "without", NO_MEMORY, "| not toured, without memory |"),
    (FROZEN, "without-tour", "generalist", "| after a tour, all of it |"),
    (FROZEN, "without-tour", NO_MEMORY, "| after a tour, without memory |"),
    (FROZEN, "without-tour", NO_CELLS, "| after a tour, without the map's cells |"),
    (FROZEN, "without-tour", NEAREST, "| after a tour, nearest picture |"),
    (FROZEN, "without-perturbed-tour", "generalist", "| after a tour, perturbed, all of it |"),
    (FROZEN, "without-perturbed-tour", NO_MEMORY, "| after a tour, perturbed, without memory |"),
    (FROZEN, "without-perturbed-tour", NO_CELLS, "| after a tour, perturbed, without the map's cells |"),
    (FROZEN, "without-perturbed-tour", NEAREST, "| after a tour, perturbed, nearest picture |"),
    (FIFTH, "rooms", "generalist", "| rooms | 100 % | 93.8 % (92.7-94.9)"),
    (FIFTH, "rooms", "collisions cost nothing", "| rooms, collisions cost nothing | 100 % | 93.2"),
    (FIFTH, "rooms", "random", "| rooms, random walk | 72.9"),
    (FIFTH, "rooms-eyes-1", "generalist", "| rooms, eyes of seed 1 | 100 % (99.8-100) | 94.0"),
    (FIFTH, "rooms-eyes-2", "generalist", "| rooms, eyes of seed 2 | 100 % | 93.7"),
    (FIFTH, "flats", "generalist", "| flats | 91.5"),
    (FIFTH, "flats", "random", "| flats, random walk | 28"),
    (FIFTH, "flats-eyes-1", "generalist", "| flats, eyes of seed 1 | 92"),
    (FIFTH, "flats-eyes-2", "generalist", "| flats, eyes of seed 2 | 91"),
    (FIFTH, "before-rooms-eyes-1", "generalist", "| rooms, eyes of seed 1 | 100 % (99.8-100) | 93.0"),
    (FIFTH, "before-rooms-eyes-2", "generalist", "| rooms, eyes of seed 2 | 100 % | 92.7"),
    (FIFTH, "before-flats-eyes-1", "generalist", "| flats, eyes of seed 1 | 86"),
    (FIFTH, "before-flats-eyes-2", "generalist", "| flats, eyes of seed 2 | 84"),
    (THIRD, "rooms-tour", "generalist", "| rooms, after a tour of 500 steps |"),
    (THIRD, "rooms", "generalist", "| no tour | 100 % | 93.3"),
    (THIRD, "rooms", "collisions cost nothing", "| no tour, collisions cost nothing | 100 % | 92.5"),
    (THIRD, "rooms", "random", "| random walk | 72.5"),
    (THIRD, "rooms-perturbed", "generalist", "| no tour | 99.5"),
    (THIRD, "flats", "generalist", "| flats, no tour | 86.2"),
    (THIRD, "flats-tour", "generalist", "| flats, after a tour of 500 steps | 97.7"),
    (THIRD, "real", "generalist", "| real plans, no tour |"),
    (FOURTH, "rooms", "generalist", "| rooms, no tour | 100 % (99.8-100) | 92.8"),
    (FOURTH, "rooms", "collisions cost nothing", "| rooms, collisions cost nothing | 100 % (99.8-100) |"),
    (FOURTH, "rooms-perturbed-tour", "generalist", "| rooms, everything perturbed, after a tour that sees it too |"),
    (FOURTH, "flats", "generalist", "| flats, no tour | 85.0"),
    (FOURTH, "validation-rooms", "generalist", "| validation rooms, no tour |"),
    (FOURTH, "validation-rooms-perturbed", "generalist", "| validation rooms, everything perturbed, no tour |"),
    (FOURTH, "validation-rooms-perturbed-tour", "generalist", "| validation rooms, everything perturbed, after"),
    (FOURTH, "validation-flats", "generalist", "| validation flats, no tour |"),
    (TOURS, "rooms-perturbed-tour", "generalist", "| toured for 500 steps, perturbed |"),
    (TOURS, "rooms-perturbed-tour", "nearest picture of the tour", "| who goes by that tour's nearest picture |"),
    (TOURS, "held-out-perturbed-tour", "generalist", "| known room, targets held out |"),
    (TOURS, "rooms-perturbed", "generalist", "| not toured, perturbed |"),
    (TOURS, "rooms", "generalist", "| not toured, nothing perturbed |"),
    (SIXTH, "real", "generalist", "| all real plans |"),
    (SIXTH, "rooms-perturbed", "generalist", "| no tour, everything perturbed |"),
    (SIXTH, "rooms", "generalist", "| no tour, nothing perturbed |"),
    (SIXTH, "live: none", "generalist", "| off the grid, nothing perturbed |"),
    (SIXTH, "live: move ± 0.05 m", "generalist", "| moves ± 5 cm |"),
    (SIXTH, "live: turn ± 5°", "generalist", "| turns ± 5 degrees |"),
    (SIXTH, "live: camera height ± 0.05 m", "generalist", "| camera's height"),
    (SIXTH, "live: camera pitch ± 3°", "generalist", "| camera's pitch"),
    (SIXTH, "live: light ± 30%", "generalist", "| light ± 30 % |"),
    (SIXTH, "live: pixel noise 10", "generalist", "| noise of pixels |"),
    (SIXTH, "live: furniture moved ≤ 0.3 m", "generalist", "| furniture moved, as registered |"),
    (AGAIN, "live: furniture moved ≤ 0.3 m", "generalist", "| furniture moved, 30 cm at most |"),
    (SIXTH, "live: new obstacle", "generalist", "| a new obstacle |"),
    (SIXTH, "live: all, strength 1", "generalist", "| all at once, as registered |"),
    (AGAIN, "live: all, strength 1", "generalist", "| all at once |"),
    (SIXTH, "real", "random", "| all real plans, random walk |"),
    *((WALKERS, None, f"{kind}-{seed}", f"| {kind}, seed {seed} |") for kind in KINDS for seed in range(3)),
    *((WALKERS, None, f"collision-aware-again-{n}", f"| collision-aware, seed {n}, may try") for n in range(3)),
    (WALKERS, None, "random", "| walk at random in these rooms |"),
    (EARLIER_WALKERS, None, "rec-aware", "| collision-aware | 97.5"),
    (EARLIER_WALKERS, None, "rec-shortest", "| shortest | 98.1"),
    (EARLIER_WALKERS, None, "rec-forgets", "| collision-aware, without memory |"),
    (EARLIER_WALKERS, None, "random", "| random walk | 72.5 % (68.7"),
    (THIRD, "real-tour", "generalist", "| real plans, after a tour of 500 steps |"),
]


def scenes_of(record: str, part: str | None, agent: str) -> list[dict[str, float]]:
    """Figures by scene; of a record without parts, None."""
    content = json.loads((DOCS / "figures" / record).read_text(encoding="utf-8"))
    return (content if part is None else content[part])[agent]["scenes"]


def ends(values: np.ndarray) -> tuple[float, float]:
    """Of the mean over scenes, which are drawn anew."""
    rows = np.random.default_rng(0).integers(len(values), size=(RESAMPLES, len(values)))
    low, high = intervals(values[rows].mean(axis=1))
    return float(low), float(high)


@pytest.mark.parametrize(("record", "part", "agent", "row"), ROWS)
def test_a_row_of_the_page_is_what_the_record_comes_to(record: str, part: str, agent: str, row: str) -> None:
    lines = [line for line in PAGE.splitlines() if line.startswith(row)]
    assert lines, f"a row begins with {row}"
    scenes = scenes_of(record, part, agent)
    for line in lines:
        cells = line.strip("|").split("|")[1:]
        for name, cell in zip(COLUMNS, cells, strict=False):
            values = np.array([scene[name] for scene in scenes]) * (100 if name in SHARES else 1)
            mean, *interval = numbers(cell)
            assert_written(mean, float(values.mean()), f"{name} in {row}")
            for written, value in zip(interval, ends(values), strict=bool(interval)):
                assert_written(written, value, f"interval of {name} in {row}")
        for name, written in zip(ARRIVALS, numbers("".join(cells[len(COLUMNS) :])), strict=False):
            told = np.array([scene.get(name) for scene in scenes], float)  # NaN where no episode ended at a target
            assert_written(written, 100 * float(np.nanmean(told)), f"{name} in {row}")


def test_success_with_a_word_of_it_is_what_the_records_come_to() -> None:
    lines = PAGE.partition("but in the last row | no tour | after a tour |")[2].partition("\n\n")[0].splitlines()[2:]
    rows = {
        "rooms": ((FROZEN, "rooms"), (FROZEN, "rooms-tour")),
        "flats": ((FROZEN, "flats"), (FROZEN, "flats-tour")),
        "real plans": ((SIXTH, "real"), (FROZEN, "real-tour")),
        "off the grid, all at once": ((AGAIN, "live: all, strength 1"),),
    }
    assert [line.strip("| ").split(" | ")[0] for line in lines] == list(rows)
    for line, parts in zip(lines, rows.values(), strict=True):
        for cell, (record, part) in zip(line.strip("| ").split(" | ")[1:], parts, strict=False):
            scenes = scenes_of(record, part, "generalist")
            success = 100 * np.mean([scene["success"] for scene in scenes])
            found = measured_stops(part, scenes) if record == FROZEN and part in STOPPED else bounds_of_stops(scenes)
            written = re.findall(r"[\d.]+(?= | %|-|\))", cell.replace("(7c07e36)", "").replace("(487050c)", ""))
            for each, value in zip(written, (*found, success), strict="as it is" not in cell):
                assert_written(each, float(value), line)


def measured_stops(part: str, scenes: list[dict]) -> tuple[float, ...]:
    """Success, had episodes ended where the agent first said to be there, and its interval; of the same walks."""
    again = STOPPED[part]["generalist"]["scenes"]
    assert [{name: scene[name] for name in before} for before, scene in zip(scenes, again, strict=True)] == scenes
    shares = 100 * np.array([scene["success_stopped"] for scene in again])
    return float(shares.mean()), *ends(shares)


def bounds_of_stops(scenes: list[dict]) -> tuple[float, float]:
    """Between what that lies, where it was not measured: no false arrival, or as many as can be, in missed episodes."""
    missed, false = ([scene.get(name) or 0 for scene in scenes] for name in ("missed_arrivals", "false_arrivals"))
    said = [scene["success"] * (1 - share) for scene, share in zip(scenes, missed, strict=True)]
    low = np.mean([max(0, s - f) for s, f in zip(said, false, strict=True)])
    high = np.mean([min(s, 1 - f) for s, f in zip(said, false, strict=True)])
    return 100 * float(low), 100 * float(high)


def test_tours_come_to_as_many_poses_and_collisions_as_is_said() -> None:
    pattern = (
        r"come to (\d+) % of the poses of rooms, (\d+) % of flats, (\d+) % of real plans, "
        r"and have (\d+), (\d+) and (\d+) collisions themselves"
    )
    for said, name in zip(re.finditer(pattern, PAGE), (FROZEN, THIRD), strict=True):
        record = json.loads((DOCS / "figures" / name).read_text(encoding="utf-8"))
        tours = [record[part]["generalist"]["tour"] for part in ("rooms-tour", "flats-tour", "real-tour")]
        found = [100 * tour["poses"] for tour in tours] + [tour["collisions"] for tour in tours]
        for written, value in zip(said.groups(), found, strict=True):
            assert_written(written, value, said[0])


def test_who_finds_poses_together_beats_the_nearest_picture_by_as_much_as_is_said() -> None:
    spl = [
        np.array([scene["spl"] for scene in scenes_of(TOURS, "rooms-perturbed-tour", agent)])
        for agent in ("generalist", "nearest picture of the tour")
    ]
    said = words_of(r"by (\S+) points of SPL \((\S+) to ([\d.]+)\)", PAGE)
    apart = 100 * (spl[0] - spl[1])
    for written, value in zip(said.groups(), (apart.mean(), *ends(apart)), strict=True):
        assert_written(written, float(value), said[0])


def mean(record: str, part: str | None, agents: tuple[str, ...], name: str) -> float:
    """Over agents and scenes."""
    return float(np.mean([[scene[name] for scene in scenes_of(record, part, agent)] for agent in agents]))


THE = ("generalist",)
THREE, TOURED = ("success", "spl", "collisions"), ("success_4x", "spl", "collisions")
MOVES, TURNS = "live: move ± 0.05 m", "live: turn ± 5°"
ALONE = (
    MOVES,
    TURNS,
    "live: camera height ± 0.05 m",
    "live: camera pitch ± 3°",
    "live: light ± 30%",
    "live: pixel noise 10",
    "live: furniture moved ≤ 0.3 m",
)
UNPERTURBED, OBSTACLE, ALL = "live: none", "live: new obstacle", "live: all, strength 1"


@pytest.mark.parametrize(
    ("begins", "figures"),
    [
        ("| rooms, no tour:", [(FROZEN, "rooms", THE, name) for name in THREE]),
        (
            "| the same by the eyes",
            [(FIFTH, f"rooms-eyes-{seed}", THE, name) for seed in (1, 2) for name in THREE],
        ),
        (
            "| agents that learn to walk",
            [(WALKERS, None, tuple(f"collision-aware-{seed}" for seed in range(3)), name) for name in THREE],
        ),
        ("| rooms after a tour:", [(FROZEN, "rooms-tour", THE, name) for name in TOURED]),
        ("| rooms after a tour, everything", [(FROZEN, "rooms-perturbed-tour", THE, name) for name in TOURED]),
        ("| known rooms after", [(FROZEN, "held-out-perturbed-tour", THE, name) for name in TOURED[:2]]),
        ("| flats, no tour:", [(FROZEN, "flats", THE, name) for name in ("success", "spl")]),
        ("| flats after a tour:", [(FROZEN, "flats-tour", THE, name) for name in ("success", "spl")]),
        ("| off the grid, a new obstacle:", [(SIXTH, OBSTACLE, THE, "success")]),
        ("| real plans, moves of", [(SIXTH, "real", THE, name) for name in THREE]),
        ("| real plans after a tour:", [(FROZEN, "real-tour", THE, name) for name in TOURED]),
    ],
)
def test_the_summary_says_what_the_records_say(
    begins: str, figures: list[tuple[str, str | None, tuple[str, ...], str]]
) -> None:
    (line,) = [line for line in PAGE.splitlines() if line.startswith(begins)]
    reached = re.sub(r"\(.*?\)", "", line.split("|")[4])
    for (record, part, agents, name), written in zip(figures, numbers(reached), strict=True):
        assert_written(
            written, mean(record, part, agents, name) * (100 if name in SHARES else 1), f"{name} in {begins}"
        )


def off_grid(part: str, name: str) -> float:
    """Of the agent, in the rows that were walked again from their record."""
    again = json.loads((DOCS / "figures" / AGAIN).read_text(encoding="utf-8"))
    return mean(AGAIN if part in again else SIXTH, part, THE, name)


def test_the_summary_says_how_it_goes_off_the_grid() -> None:
    alone, together = (
        min(off_grid(part, "success") for part in parts) / off_grid(UNPERTURBED, "success") for parts in (ALONE, (ALL,))
    )
    (line,) = [line for line in PAGE.splitlines() if line.startswith("| off the grid, success in 500 steps, of")]
    for written, value in zip(numbers(line.split("|")[4]), (alone, together), strict=True):
        assert_written(written, 100 * value, line)
    said = words_of(r"within four times the shortest path it is (\d+) % of what it is with nothing", PAGE, re.I)
    parts = [mean(SIXTH, part, THE, "success_4x") for part in ("rooms-perturbed", "rooms")]
    assert_written(said[1], 100 * parts[0] / parts[1], said[0])
    said = words_of(r"all at once leaves (\d+) % \((\d+) % as registered\), turns (\d+) %, moves (\d+) %", PAGE)
    shares = [mean(SIXTH, ALL, THE, "success_4x"), *(off_grid(part, "success_4x") for part in (ALL, TURNS, MOVES))]
    for written, share in zip((said[2], said[1], said[3], said[4]), shares, strict=True):
        assert_written(written, 100 * share / off_grid(UNPERTURBED, "success_4x"), said[0])
    said = words_of(r"all at once (\S+) % \((\S+) % as registered\)\. With a new obstacle", PAGE)
    for written, record in zip(said.groups(), (AGAIN, SIXTH), strict=True):
        assert_written(
            written, 100 * mean(record, ALL, THE, "success") / mean(SIXTH, UNPERTURBED, THE, "success"), said[0]
        )
    building = (DOCS / "building.md").read_text(encoding="utf-8")
    said = words_of(r"in (\d+) to (\d+) % of\s+episodes, by what is perturbed", building)
    false = [off_grid(part, "false_arrivals") for part in (UNPERTURBED, *ALONE, OBSTACLE, ALL)]
    for written, value in zip(said.groups(), (min(false), max(false)), strict=True):
        assert_written(written, 100 * value, said[0])


def test_walkers_and_the_generalist_are_compared_in_the_same_rooms() -> None:
    said = words_of(
        r"has (\S+) collisions and SPL (\S+) % \[in the first fifty of these rooms\].*?"
        r"has (\S+) and (\S+) % \(means of three seeds\): (\S+) more \((\S+) to ([\d.]+)\)",
        PAGE,
        re.S,
    )
    found = {}
    for name in ("collisions", "spl"):
        own = {scene["scene"]: scene[name] for scene in scenes_of(SIXTH, "rooms", "generalist")}
        others = [
            {scene["scene"]: scene[name] for scene in scenes_of(WALKERS, None, f"collision-aware-{seed}")}
            for seed in range(3)
        ]
        found[name] = (
            np.array(list(own.values())),
            np.mean([[other[scene] for scene in own] for other in others], axis=0),
        )
    (fewer, more), (spl, their_spl) = found["collisions"], found["spl"]
    values = (fewer.mean(), 100 * spl.mean(), more.mean(), 100 * their_spl.mean(), (more - fewer).mean())
    for written, value in zip(said.groups(), (*values, *ends(more - fewer)), strict=True):
        assert_written(written, float(value), said[0])


@pytest.mark.parametrize(
    ("record", "pattern"),
    [
        (FROZEN, r"spares (\S+) collisions an episode \((\S+) to (\S+)\), and costs (\S+) points of SPL \((\S+) to"),
        (FIFTH, r"spares (\S+) collisions an\s+episode \((\S+) to (\S+)\), and costs (\S+) points of SPL\.\n- 41"),
    ],
)
def test_anticipation_spares_as_many_collisions_as_is_said(record: str, pattern: str) -> None:
    said = words_of(pattern, PAGE)
    apart = {}
    for name, scale in (("collisions", 1), ("spl", 100)):
        careless, careful = (
            scale * np.array([scene[name] for scene in scenes_of(record, "rooms", agent)])
            for agent in ("collisions cost nothing", "generalist")
        )
        apart[name] = careless - careful
    told = [apart["collisions"].mean(), *ends(apart["collisions"]), apart["spl"].mean(), ends(apart["spl"])[0]]
    for written, value in zip(said.groups(), told, strict=False):
        assert_written(written, float(value), said[0])


def test_what_memory_and_map_bring_is_judged_from_the_record(monkeypatch: pytest.MonkeyPatch) -> None:
    benchmarks = DOCS.parent / "benchmarks"
    monkeypatch.syspath_prepend(benchmarks)
    p_of_mean = runpy.run_path(str(benchmarks / "by_scene.py"))["p_of_mean"]
    page = PAGE.partition("#### What memory and map bring")[2].partition("\n### ")[0]
    judged = {
        "without": {"memory": NO_MEMORY},
        "without-tour": {"memory": NO_MEMORY, "cells": NO_CELLS, "picture": NEAREST},
        "without-perturbed-tour": {"memory": NO_MEMORY, "cells": NO_CELLS, "picture": NEAREST},
    }
    begins = ("| no tour |", "| a tour |", "| a tour, perturbed |")
    lines = [line for line in page.splitlines() if line.startswith(begins)]
    assert len(lines) == sum(map(len, judged.values()))
    for part, taken in judged.items():
        own = np.array([scene["spl"] for scene in scenes_of(FROZEN, part, "generalist")])
        apart = [own - np.array([scene["spl"] for scene in scenes_of(FROZEN, part, agent)]) for agent in taken.values()]
        for difference, p in zip(apart, holm([p_of_mean(values) for values in apart]), strict=True):
            _, what, points, written, verdict = lines.pop(0).strip("| ").split(" | ")
            assert what.split()[-1] in taken
            figures = (difference.mean(), *ends(difference))
            for told, value in zip(re.findall(r"-?[\d.]+", points), figures, strict=True):
                assert_written(told, 100 * float(value), points)
            assert_written(written, p, points)
            assert verdict == ("yes" if p <= LEVEL and difference.mean() > 0 else "undecided")


def test_what_is_said_of_walkers_is_what_is_judged_from_their_record(monkeypatch: pytest.MonkeyPatch) -> None:
    benchmarks = DOCS.parent / "benchmarks"
    monkeypatch.syspath_prepend(benchmarks)
    judged = runpy.run_path(str(benchmarks / "walkers_judged.py"))["judged"]
    record = json.loads((DOCS / "figures" / WALKERS).read_text(encoding="utf-8"))
    asked = [("shortest", "collision-aware"), ("bump", "collision-aware"), ("shortest", "clearance")]
    aware, bump, clearance = judged(record, "collisions", asked)
    assert (aware.holds, bump.holds, clearance.holds) == (True, False, False)
    by_seed = words_of(r"by seed it is (\S+), (\S+) and (\S+): almost all", PAGE)
    for written, value in zip(by_seed.groups(), aware.by_seed.mean(axis=1), strict=True):
        assert_written(written, float(value), by_seed[0])
    said = re.search(r"has (\S+) collisions fewer than `shortest` \((\S+) to (\S+), p = (\S+) for three", PAGE)
    other = re.search(r"With\s+seeds drawn anew, too, it is (\S+) to ([\d.]+)\.", PAGE)
    assert said is not None and other is not None
    rooms = aware.by_seed.mean(axis=0)
    values = (rooms.mean(), *ends(rooms), aware.p, *aware.other_seeds)
    for written, value in zip((*said.groups(), *other.groups()), values, strict=True):
        assert_written(written, float(value), said[0])
    (spl,) = judged(record, "spl", [("collision-aware", "shortest")])
    said = re.search(r"SPL differs by (\S+) points \((\S+) to ([\d.]+)\)", PAGE)
    assert said is not None and not spl.holds
    rooms = 100 * spl.by_seed.mean(axis=0)
    for written, value in zip(said.groups(), (rooms.mean(), *ends(rooms)), strict=True):
        assert_written(written, float(value), said[0])
    (again,) = judged(record, "collisions", [("collision-aware-again", "collision-aware")])
    said = re.search(r"spares (\S+) collisions \((\S+) to ([\d.]+)\): twelve of thirteen", PAGE)
    assert again.holds and said is not None
    for written, value in zip(said.groups(), (again.by_seed.mean(), *ends(again.by_seed.mean(axis=0))), strict=True):
        assert_written(written, float(value), said[0])


def test_adapting_takes_as_many_frames_as_its_record_says() -> None:
    record = json.loads((DOCS / "figures" / "adapting.json").read_text(encoding="utf-8"))["frames, seconds"]
    lines = (DOCS / "learning.md").read_text(encoding="utf-8").splitlines()
    arms = ("adapted", "adapted without walks", "from nothing")
    frames = {
        arm: {count: [row[arm][0] for row in record if row["targets"] == count] for count in (5, 20)} for arm in arms
    }
    for count in (5, 20):
        cells = [", ".join(f"{taken:,}" for taken in frames[arm][count]) for arm in arms]
        assert f"| {count} | " + " | ".join(cells) + " |" in lines
    ends = {
        arm: {count: f"{min(all_):,} to {max(all_):,}" for count, all_ in found.items()}
        for arm, found in frames.items()
    }
    for arm in ("adapted", "from nothing"):
        assert all(one in PAGE for one in ends[arm].values())
    took = [
        "{:.0f} to {:.0f}".format(*(end(row[arm][1] for row in record) for end in (min, max)))
        for arm in ("adapted", "from nothing")
    ]
    assert any(f"in {took[0]} s, from nothing in {took[1]}," in line for line in lines)
    more = np.divide(frames["adapted without walks"][20], frames["adapted"][20])
    assert any(f"twenty in {more.min():.1f} to {more.max():.1f} times the frames" in line for line in lines)


def record_of(name: str) -> dict:
    return json.loads((DOCS / "figures" / name).read_text(encoding="utf-8"))


def test_the_curve_over_scenes_is_what_its_record_comes_to() -> None:
    record, curve = record_of("eyes-curve.json"), PAGE.partition("### How eyes grow")[2].partition("### Beside")[0]
    labels = {"nothing": "eyes of the first stage"}
    lines = [line.strip("|").split("|") for line in curve.splitlines() if line.startswith("| ") and "%" in line]
    assert len(lines) == 6
    means: dict[str, list[float]] = {"success": [], "spl": []}
    for label, pictures, *cells in lines:
        name = labels.get(label.strip(), label.strip())
        part = record[f"{name}, 81,920 pictures" if pictures.strip() == "81,920" else name]
        for figure, cell in zip(("success", "spl", "collisions"), cells, strict=True):
            values = np.array([scene[figure] for scene in part["scenes"]]) * (1 if figure == "collisions" else 100)
            mean, *interval = numbers(cell)
            assert_written(mean, float(values.mean()), f"{figure} of {label}")
            for written, value in zip(interval, ends(values), strict=bool(interval)):
                assert_written(written, value, f"interval of {figure} of {label}")
            if figure in means and pictures.strip() == "40,960":
                means[figure].append(float(values.mean()))
    said = words_of(
        r"ten times as many scenes (\S+) points of success and (\S+) of SPL, for a\s+hundred times (\S+) and (\S+),",
        curve,
    )
    scenes = np.log10([18, 37, 74, 146])  # rooms and flats
    slopes = [float(np.polyfit(scenes, means[figure], 1)[0]) for figure in ("success", "spl")]
    for written, value in zip(said.groups(), (*slopes, *(2 * slope for slope in slopes)), strict=True):
        assert_written(written, value, said[0])


def test_the_first_two_generalists_are_what_their_records_come_to() -> None:
    said = words_of(
        r"generalist-test\.json\) \(no tour, SPL (\S+) %, (\S+) collisions;\s+flats: success (\S+) %, SPL (\S+) %\).*"
        r"generalist-test-again\.json\) \((\S+) %, (\S+); flats: (\S+) %, (\S+) %\)",
        PAGE,
        re.S,
    )
    asked = ("rooms", "spl"), ("rooms", "collisions"), ("flats", "success"), ("flats", "spl")
    found = [
        mean(record, part, THE, name) * (1 if name == "collisions" else 100)
        for record in ("generalist-test.json", "generalist-test-again.json")
        for part, name in asked
    ]
    for written, value in zip(said.groups(), found, strict=True):
        assert_written(written, value, said[0])


def test_the_recurrent_learner_is_as_fast_as_its_record_says() -> None:
    speed = record_of("recurrent.json")["speed"]["figures"]
    told = [speed["frames_per_second"][name] for name in ("ours", "ours, taught", *THEIRS)]
    said = words_of(
        r"ours (\S+) \(PPO\) and (\S+) \(while it is taught\), "
        r"sb3-contrib's RecurrentPPO on the same table (\S+) \(.*?\)\s+"
        r"and (\S+) \(.*?\): (\S+) and (\S+) times as many",
        PAGE,
    )
    for written, value in zip(said.groups(), (*told, told[0] / told[2], told[0] / told[3]), strict=True):
        assert_written(written.replace(",", ""), value, said[0])
    learning = (DOCS / "learning.md").read_text(encoding="utf-8")
    said = words_of(r"five targets take (\d+) MB of table, and (\d+) MB of features", learning)
    kept = [speed["memory"][f"{name}_mb_per_1000_rooms"] for name in ("pair_table", "features_float16")]
    for written, value in zip(said.groups(), kept, strict=True):
        assert_written(written, value, said[0])


def test_the_shipped_eyes_see_as_their_record_says() -> None:
    record = record_of("recognition.json")
    assert record["eyes"] == find_record(NAME, []).identity, "other eyes: measure them anew"
    rows = {
        "these eyes": "clearway",
        "pixels, 18 x 24, centred": "pixels 18 x 24",
        "random ResNet-50": "random-resnet50",
        "random ResNet-50, whitened": "random-resnet50, whitened",
    }
    page = PAGE.partition("### Beside other encoders")[2].partition("\n### ")[0]
    lines = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| ") and "%" in line]
    assert [label for label, *_ in lines] == list(rows)
    for label, *cells in lines:
        found = record["recognised"][f"all: {rows[label]}"]
        for cell, figure in zip(cells, ("recognised", "recognised_near"), strict=True):
            values = 100 * np.array(found[figure])
            for written, value in zip(numbers(cell), (float(values.mean()), *ends(values)), strict=True):
                assert_written(written, value, f"{figure} of {label}")
    said = words_of(
        r"within (\S+) m and (\S+) degrees \(medians\), both within half a metre and 15 degrees in (\S+) %; "
        r"the free way\s+ahead within a quarter of a metre in (\S+) % \(one answer for all: (\S+) %\)",
        page,
    )
    told = record["told"]["all"]
    scales = {"place_m": 1, "turn_deg": 1, "poses": 100, "free_ahead": 100, "free_ahead_constant": 100}
    for written, (name, scale) in zip(said.groups(), scales.items(), strict=True):
        assert_written(written, scale * float(np.mean(told[name])), name)


@pytest.mark.parametrize(
    ("part", "begins"),
    [
        ("rooms", "| frozen rooms 0 to 49 |"),
        ("rooms-perturbed", "| the same, everything perturbed |"),
        ("plans", "| the 48 real plans, moves of 0.25 m |"),
        ("flats", "| the 50 frozen flats |"),
        ("live: none", "| walkers, off the grid, nothing perturbed |"),
        ("live: move ± 0.05 m", "| walkers, moves ± 5 cm |"),
        ("live: turn ± 5°", "| walkers, turns ± 5 degrees |"),
        ("live: camera height ± 0.05 m", "| walkers, camera's height ± 5 cm |"),
        ("live: camera pitch ± 3°", "| walkers, camera's pitch ± 3 degrees |"),
        ("live: light ± 30%", "| walkers, light ± 30 % |"),
        ("live: pixel noise 10", "| walkers, noise of pixels |"),
        ("live: furniture moved ≤ 0.3 m", "| walkers, furniture moved, 30 cm at most |"),
        ("live: new obstacle", "| walkers, a new obstacle |"),
        ("live: all, strength 1", "| walkers, all at once |"),
    ],
)
def test_walkers_walk_elsewhere_as_their_record_says(part: str, begins: str) -> None:
    (line,) = [line for line in PAGE.splitlines() if line.startswith(begins)]
    runs = [scenes_of(ELSEWHERE, part, f"aware-{seed}") for seed in range(3)]
    *cells, arrivals = line.strip("| ").split(" | ")[1:]
    for name, cell in zip(COLUMNS, cells, strict=True):
        of_seeds = [np.mean([scene[name] for scene in run]) * (100 if name in SHARES else 1) for run in runs]
        for written, value in zip(numbers(cell), (np.mean(of_seeds), min(of_seeds), max(of_seeds)), strict=True):
            assert_written(written, float(value), f"{name} in {line}")
    for name, written in zip(ARRIVALS, numbers(arrivals), strict=True):
        of_seeds = [np.nanmean([np.nan if scene.get(name) is None else scene[name] for scene in run]) for run in runs]
        assert_written(written, 100 * float(np.mean(of_seeds)), f"{name} in {line}")


def test_walkers_keep_as_much_of_their_success_under_perturbations_as_is_said() -> None:
    agents = tuple(f"aware-{seed}" for seed in range(3))
    perturbed, plain = (mean(ELSEWHERE, part, agents, "success_4x") for part in ("rooms-perturbed", "rooms"))
    said = words_of(r"within 4 x is (\d+) % of what it is with nothing perturbed", PAGE)
    assert_written(said[1], 100 * perturbed / plain, said[0])
    success = {
        part: mean(ELSEWHERE, part, agents, "success")
        for part in json.loads((DOCS / "figures" / ELSEWHERE).read_text(encoding="utf-8"))
        if part.startswith("live: ")
    }
    least, all_of_it, obstacle = words_of(
        r"leaves (\S+) % of success or more, .* All at once leaves (\d+) %, .* new obstacle success is (\d+) %", PAGE
    ).groups()
    whole, everything, new = (success.pop(f"live: {name}") for name in ("none", "all, strength 1", "new obstacle"))
    assert_written(least, 100 * min(success.values()) / whole, "each alone")
    assert_written(all_of_it, 100 * everything / whole, "all at once")
    assert_written(obstacle, 100 * new, "a new obstacle")


def test_walkers_grow_as_their_record_says() -> None:
    page = PAGE.partition("### How walkers grow")[2].partition("\n## ")[0]
    lines = [line.strip("| ").split(" | ") for line in page.splitlines() if re.match(r"\| \d+ \| \d M", line)]
    runs = {f"rooms{count}-0": (count, 4) for count in (20, 40, 80)}
    runs |= {"aware-0": (160, 4), "frames8-0": (160, 8), "frames2-0": (160, 2), "frames1-0": (160, 1)}
    asked = [("curve-rooms", name) for name in THREE] + [("curve-flats", name) for name in THREE]
    means = {}
    for (run, (rooms, frames)), (told_rooms, told_frames, *cells) in zip(runs.items(), lines, strict=True):
        assert (int(told_rooms), told_frames) == (rooms, f"{frames} M")
        for (part, name), cell in zip(asked, cells, strict=True):
            values = np.array([scene[name] for scene in scenes_of(ELSEWHERE, part, run)])
            values = values * (100 if name in SHARES else 1)
            means[run, part, name] = values.mean()
            for written, value in zip(numbers(cell), (values.mean(), *ends(values)), strict=True):
                assert_written(written, float(value), f"{name} of {run}")
    lines = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| ten times as many")]
    which = [("rooms", 0, [*runs][:4]), ("frames", 1, [*runs][3:])]
    for (what, place, chosen), (label, *cells) in zip(which, lines, strict=True):
        assert label == f"ten times as many {what}"
        for (part, name), cell in zip(asked, cells, strict=True):
            x = np.log10([runs[run][place] for run in chosen])
            slope = float(np.polyfit(x, [means[run, part, name] for run in chosen], 1)[0])
            assert_written(cell.strip("+").split()[0], slope, f"{name} with {label}")


def test_twice_as_many_frames_bring_walkers_what_is_said() -> None:
    said = words_of(
        r"SPL rises by (\S+) points \((\S+) to (\S+)\), collisions stay \((\S+) more, -(\S+)\s+to (\S+)\), "
        r"success falls by (\S+) points \((\S+) to (\S+)\); and in flats success falls by (\S+) points "
        r"\((\S+) to (\S+)\), "
        r"collisions rise by (\S+) \((\S+) to (\S+)\)",
        PAGE,
    ).groups()
    asked = (
        ("rooms", "spl"),
        ("rooms", "collisions"),
        ("rooms", "success"),
        ("flats", "success"),
        ("flats", "collisions"),
    )
    for place, (part, name) in enumerate(asked):
        scale = 1 if name == "collisions" else 100
        pairs = zip(*(scenes_of(ELSEWHERE, f"curve-{part}", run) for run in ("frames8-0", "aware-0")), strict=True)
        more = scale * np.array([eight[name] - four[name] for eight, four in pairs])
        stays = (part, name) == ("rooms", "collisions")
        found = [-ends(more)[0], ends(more)[1]] if stays else sorted(abs(value) for value in ends(more))
        for written, value in zip(said[3 * place : 3 * place + 3], (abs(more.mean()), *found), strict=True):
            assert_written(written, float(value), f"{name} in {part}")


def test_one_real_plan_holds_as_much_of_what_fails_as_is_said() -> None:
    said = words_of(r"(FloorPlan\d+), has (\d+) % of the collisions and (\d+) % of what does not end within 4 x", PAGE)
    scenes = scenes_of(FROZEN, "real-tour", "generalist")
    (worst,) = [scene for scene in scenes if scene["scene"] == said[1]]
    for written, of in ((said[2], lambda scene: scene["collisions"]), (said[3], lambda scene: 1 - scene["success_4x"])):
        assert_written(written, 100 * of(worst) / sum(map(of, scenes)), said[0])
