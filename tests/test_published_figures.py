"""What the pages say of agents is what their records come to."""

import json
import re
import runpy
import tarfile
from pathlib import Path

import numpy as np
import pytest

from clearway.evaluation.bootstrap import RESAMPLES, intervals
from clearway.experiments.reproduce import REQUEST_FILE, gather
from clearway.experiments.section import Section

DOCS = Path(__file__).parents[1] / "docs"
PAGE = "".join((DOCS / page).read_text(encoding="utf-8") for page in ("seeing.md", "evidence.md"))
AGENTS = r"collision-aware|dearer|shuffled|shortest"
COLUMNS = ("success", "success_4x", "spl", "collisions")
ARRIVALS = ("false_arrivals", "missed_arrivals")
SHARES = ("success", "success_4x", "spl")
THIRD, FOURTH, FIFTH, SIXTH = (f"generalist-test-{number}.json" for number in ("third", "fourth", "fifth", "sixth"))
TOURS, WALKERS = "generalist-tours.json", "walkers-test.json"
KINDS = ("collision-aware", "shortest", "bump", "clearance")
ROWS = [
    (FIFTH, "rooms", "generalist", "| rooms | 100 % | 93.8"),
    (FIFTH, "rooms", "collisions cost nothing", "| rooms, collisions cost nothing | 100 % | 93.2"),
    (FIFTH, "rooms", "random", "| rooms, random walk |"),
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
    (SIXTH, "live: furniture moved ≤ 0.3 m", "generalist", "| furniture moved, 30 cm at most |"),
    (SIXTH, "live: new obstacle", "generalist", "| a new obstacle |"),
    (SIXTH, "live: all, strength 1", "generalist", "| all at once |"),
    (SIXTH, "real", "random", "| all real plans, random walk |"),
    *((WALKERS, None, f"{kind}-{seed}", f"| {kind}, seed {seed} |") for kind in KINDS for seed in range(3)),
    *((WALKERS, None, f"collision-aware-again-{n}", f"| collision-aware, seed {n}, may try") for n in range(3)),
    (WALKERS, None, "random", "| walk at random in these rooms |"),
    (THIRD, "real-tour", "generalist", "| real plans, after a tour of 500 steps |"),
]


def scenes_of(record: str, part: str | None, agent: str) -> list[dict[str, float]]:
    """Figures by scene; of a record without parts, None."""
    content = json.loads((DOCS / "figures" / record).read_text(encoding="utf-8"))
    return (content if part is None else content[part])[agent]["scenes"]


def numbers(cell: str) -> list[str]:
    """Those of "93.3 % (92.1-94.4)", as they are written."""
    return re.findall(r"\d+(?:\.\d+)?", cell)


def ends(values: np.ndarray) -> tuple[float, float]:
    """Of the mean over scenes, which are drawn anew."""
    rows = np.random.default_rng(0).integers(len(values), size=(RESAMPLES, len(values)))
    low, high = intervals(values[rows].mean(axis=1))
    return float(low), float(high)


def expect(written: str, value: float, what: str) -> None:
    """A figure is written to its last digit."""
    digits = len(written.partition(".")[2])
    assert abs(float(written) - value) <= 0.5001 * 10**-digits, f"{what}: written {written}, recorded {value}"


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
            expect(mean, float(values.mean()), f"{name} in {row}")
            for written, value in zip(interval, ends(values), strict=bool(interval)):
                expect(written, value, f"interval of {name} in {row}")
        for name, written in zip(ARRIVALS, numbers("".join(cells[len(COLUMNS) :])), strict=False):
            told = np.array([scene[name] for scene in scenes], float)  # NaN where no episode ended at a target
            expect(written, 100 * float(np.nanmean(told)), f"{name} in {row}")


def test_who_finds_poses_together_beats_the_nearest_picture_by_as_much_as_is_said() -> None:
    spl = [
        np.array([scene["spl"] for scene in scenes_of(TOURS, "rooms-perturbed-tour", agent)])
        for agent in ("generalist", "nearest picture of the tour")
    ]
    said = re.search(r"by (\S+) points of SPL \((\S+) to ([\d.]+)\)", PAGE)
    assert said is not None
    apart = 100 * (spl[0] - spl[1])
    for written, value in zip(said.groups(), (apart.mean(), *ends(apart)), strict=True):
        expect(written, float(value), said[0])


def mean(record: str, part: str | None, agents: tuple[str, ...], name: str) -> float:
    """Over agents and scenes."""
    return float(np.mean([[scene[name] for scene in scenes_of(record, part, agent)] for agent in agents]))


THE = ("generalist",)
THREE = ("success", "spl", "collisions")
ALONE = (
    "live: move ± 0.05 m",
    "live: turn ± 5°",
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
        ("| rooms, no tour:", [(FIFTH, "rooms", THE, name) for name in THREE]),
        (
            "| the same by the eyes",
            [(FIFTH, f"rooms-eyes-{seed}", THE, name) for seed in (1, 2) for name in THREE],
        ),
        (
            "| agents that learn to walk",
            [(WALKERS, None, tuple(f"collision-aware-{seed}" for seed in range(3)), name) for name in THREE],
        ),
        (
            "| rooms after a tour:",
            [(TOURS, "rooms-perturbed-tour", THE, name) for name in ("success_4x", "spl", "collisions")],
        ),
        ("| known rooms,", [(TOURS, "held-out-perturbed-tour", THE, name) for name in ("success_4x", "spl")]),
        ("| flats, no tour:", [(FIFTH, "flats", THE, name) for name in ("success", "spl")]),
        ("| flats after a tour,", [(THIRD, "flats-tour", THE, name) for name in ("success", "spl")]),
        ("| off the grid, a new obstacle:", [(SIXTH, OBSTACLE, THE, "success")]),
        ("| real plans, moves of", [(SIXTH, "real", THE, name) for name in THREE]),
        (
            "| twelve of 48 real plans",
            [(THIRD, "real-tour", THE, name) for name in ("success_4x", "spl", "collisions")],
        ),
    ],
)
def test_the_summary_says_what_the_records_say(
    begins: str, figures: list[tuple[str, str | None, tuple[str, ...], str]]
) -> None:
    (line,) = [line for line in PAGE.splitlines() if line.startswith(begins)]
    reached = re.sub(r"\(.*?\)", "", line.split("|")[4])
    for (record, part, agents, name), written in zip(figures, numbers(reached), strict=True):
        expect(written, mean(record, part, agents, name) * (100 if name in SHARES else 1), f"{name} in {begins}")


def test_the_summary_says_how_it_goes_off_the_grid() -> None:
    alone, together = (
        min(mean(SIXTH, part, THE, "success") for part in parts) / mean(SIXTH, UNPERTURBED, THE, "success")
        for parts in (ALONE, (ALL,))
    )
    (line,) = [line for line in PAGE.splitlines() if line.startswith("| off the grid, of its unperturbed")]
    for written, value in zip(numbers(line.split("|")[4]), (alone, together), strict=True):
        expect(written, 100 * value, line)
    said = re.search(r"within four times the shortest path it is (\d+) % of what it is with nothing", PAGE, re.I)
    assert said is not None
    parts = [mean(SIXTH, part, THE, "success_4x") for part in ("rooms-perturbed", "rooms")]
    expect(said[1], 100 * parts[0] / parts[1], said[0])
    building = (DOCS / "building.md").read_text(encoding="utf-8")
    said = re.search(r"in (\d+) to (\d+) % of\s+episodes, by what is perturbed", building)
    assert said is not None
    false = [mean(SIXTH, part, THE, "false_arrivals") for part in (UNPERTURBED, *ALONE, OBSTACLE, ALL)]
    for written, value in zip(said.groups(), (min(false), max(false)), strict=True):
        expect(written, 100 * value, said[0])


def test_walkers_and_the_generalist_are_compared_in_the_same_rooms() -> None:
    said = re.search(
        r"has (\S+) collisions and SPL (\S+) % \[in the first fifty of these rooms\].*?"
        r"has (\S+) and (\S+) % \(means of three seeds\): (\S+) more \((\S+) to ([\d.]+)\)",
        PAGE,
        re.S,
    )
    assert said is not None
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
        expect(written, float(value), said[0])


def test_anticipation_spares_as_many_collisions_as_is_said() -> None:
    careless, careful = (
        np.array([scene["collisions"] for scene in scenes_of(FIFTH, "rooms", agent)])
        for agent in ("collisions cost nothing", "generalist")
    )
    said = re.search(r"spares (\S+) collisions an\s+episode \((\S+) to ([\d.]+)\)", PAGE)
    assert said is not None
    for written, value in zip(said.groups(), ((careless - careful).mean(), *ends(careless - careful)), strict=True):
        expect(written, float(value), said[0])


def test_what_is_said_of_walkers_is_what_is_judged_from_their_record(monkeypatch: pytest.MonkeyPatch) -> None:
    benchmarks = DOCS.parent / "benchmarks"
    monkeypatch.syspath_prepend(benchmarks)
    judged = runpy.run_path(str(benchmarks / "walkers_judged.py"))["judged"]
    record = json.loads((DOCS / "figures" / WALKERS).read_text(encoding="utf-8"))
    asked = [("shortest", "collision-aware"), ("bump", "collision-aware"), ("shortest", "clearance")]
    aware, bump, clearance = judged(record, "collisions", asked)
    assert (aware.holds, bump.holds, clearance.holds) == (True, False, False)
    by_seed = re.search(r"by seed it is (\S+), (\S+) and (\S+): almost all", PAGE)
    assert by_seed is not None
    for written, value in zip(by_seed.groups(), aware.by_seed.mean(axis=1), strict=True):
        expect(written, float(value), by_seed[0])
    said = re.search(r"has (\S+) collisions fewer than `shortest` \((\S+) to (\S+), p = (\S+) for three", PAGE)
    other = re.search(r"With\s+seeds drawn anew, too, it is (\S+) to ([\d.]+)\.", PAGE)
    assert said is not None and other is not None
    rooms = aware.by_seed.mean(axis=0)
    values = (rooms.mean(), *ends(rooms), aware.p, *aware.other_seeds)
    for written, value in zip((*said.groups(), *other.groups()), values, strict=True):
        expect(written, float(value), said[0])
    (spl,) = judged(record, "spl", [("collision-aware", "shortest")])
    said = re.search(r"SPL differs by (\S+) points \((\S+) to ([\d.]+)\)", PAGE)
    assert said is not None and not spl.holds
    rooms = 100 * spl.by_seed.mean(axis=0)
    for written, value in zip(said.groups(), (rooms.mean(), *ends(rooms)), strict=True):
        expect(written, float(value), said[0])
    (again,) = judged(record, "collisions", [("collision-aware-again", "collision-aware")])
    said = re.search(r"spares (\S+) collisions \((\S+) to ([\d.]+)\): twelve of thirteen", PAGE)
    assert again.holds and said is not None
    for written, value in zip(said.groups(), (again.by_seed.mean(), *ends(again.by_seed.mean(axis=0))), strict=True):
        expect(written, float(value), said[0])


def test_a_figure_that_differs_in_its_last_digit_is_seen() -> None:
    expect("93.3", 93.34, "near")
    with pytest.raises(AssertionError, match=r"written 93\.3, recorded 93\.36"):
        expect("93.3", 93.36, "far")


@pytest.mark.slow
def test_what_memory_solves_is_what_its_record_comes_to(tmp_path: Path) -> None:
    records = runpy.run_path(str(DOCS.parent / "benchmarks" / "records.py"))
    records["unpack"](DOCS / "records" / "memory-bathroom.tar.xz", tmp_path / "memory")
    ((section,), page) = gather(tmp_path / "memory").sections, (DOCS / "results.md").read_text(encoding="utf-8")
    assert not section.missing
    (table,) = section.tables
    rows = [dict(zip(table.headings, row, strict=True)) for row in table.rows]
    lines = page.splitlines()
    told = [line.strip("|").split("|") for line in lines if line.startswith("| planner on a learnt map")]
    assert len(told) == 4
    for label, agents in (("default recipe | 3,", ["default"]), ("Q-learning, behaviour", ["q-learning", "bc"])):
        for line in lines:
            if line.startswith(f"| {label}"):
                told += [[agent, *line.strip("|").split("|")[1:]] for agent in agents]
    assert len(told) == 7
    for agent, frames, steps, collisions, shortest in told:
        count = int(frames.replace(",", ""))
        (row,) = [row for row in rows if row["agent"] == agent.strip() and row["frames"] == count]
        if numbers(shortest):
            least, *most = (float(end.rstrip("%")) for end in row["shortest ways"].split(" to "))
            expect(numbers(shortest)[0], least, "least")
            expect(numbers(shortest)[-1], most[0], "most")
        for cell, name in ((steps, "steps"), (collisions, "collisions")):
            mean, *interval = numbers(cell)
            expect(mean, row[name], f"{name} after {count} frames")
            recorded = numbers(str(row[f"95 % of {name}"]))
            assert not interval or [*map(float, interval)] == [*map(float, recorded)]
    verdicts = {claim.text.partition(":")[0]: claim.verdict for claim in section.claims}
    assert verdicts == {"default": "does not hold", "q-learning": "undecided", "bc": "undecided"}


def check_zones_of_cells(section: Section) -> None:
    """Rows and claims of its section of the evidence."""
    page = (DOCS / "evidence.md").read_text(encoding="utf-8").partition("### Zones of cells")[2]
    lines = page.partition("\n### ")[0].splitlines()
    steps, _, settled = section.tables
    for agent in ("shortest", "collision-aware, zones of poses", "collision-aware, zones of cells"):
        (line,) = [line for line in lines if line.startswith(f"| {agent} |")]
        cells = [cell.replace(",", "") for cell in re.split(r" \| ", line.strip("| "))]
        row = dict(zip(steps.headings, next(r for r in steps.rows if r[:3] == ("steps", "paper", agent)), strict=True))
        bumps = dict(
            zip(steps.headings, next(r for r in steps.rows if r[:3] == ("collisions", "paper", agent)), strict=True)
        )
        late = dict(zip(settled.headings, next(r for r in settled.rows if r[:2] == ("paper", agent)), strict=True))
        for cell, value, interval in (
            (cells[1], late["frames"], late["95 %"]),
            (cells[2], row["average"], row["95 %"]),
            (cells[3], bumps["average"], bumps["95 %"]),
        ):
            mean, low, high = numbers(cell)[:3]
            expect(mean, float(value), agent)
            assert [float(low), float(high)] == [
                pytest.approx(float(end.replace(",", "")), rel=0.01) for end in interval.split(" to ")
            ]
        assert cells[1].split()[-3] == str(late["settled"])
        assert cells[4] == row["failed targets"]
    told = [re.split(r" \| ", line.strip("| ")) for line in lines if re.match(r"\| (fewer|no more|settles)", line)]
    by_text = {
        claim.text.removeprefix("paper: ").replace(" with zones of cells", ""): claim for claim in section.claims
    }
    assert {text for text, *_ in told} == set(by_text) and len(told) == 5
    for text, difference, p, corrected in told:
        claim = by_text[text]
        assert f"p = {p}, for 5 claims {corrected} (Holm)" in claim.evidence
        low_to_high = difference.replace(" (", " [").replace(")", "]")
        assert f"difference {low_to_high}" in claim.evidence
        assert claim.verdict == "undecided"


@pytest.mark.slow
def test_zones_or_a_larger_step_is_what_its_record_comes_to(tmp_path: Path) -> None:
    records = runpy.run_path(str(DOCS.parent / "benchmarks" / "records.py"))
    records["unpack"](DOCS / "records" / "zones-or-step-bathroom.tar.xz", tmp_path / "zones")
    section, of_cells = gather(tmp_path / "zones").sections
    assert not section.missing and not of_cells.missing
    check_zones_of_cells(of_cells)
    table = section.tables[-1]
    rows = {row["agent"]: row for row in (dict(zip(table.headings, row, strict=True)) for row in table.rows)}
    told = {
        "shortest": "| shortest | 812",
        "dearer": "| steps as dear as zones",
        "shuffled": "| zones of shuffled",
        "collision-aware": "| collision-aware | 460",
    }
    lines = (DOCS / "results.md").read_text(encoding="utf-8").splitlines()
    for agent, begin in told.items():
        (line,) = [line for line in lines if line.startswith(begin)]
        _, frames, settled = line.strip("|").split("|")
        mean, *interval = numbers(frames.replace(",", ""))
        expect(mean, rows[agent]["frames"], agent)
        assert interval == numbers(str(rows[agent]["95 %"]).replace(",", ""))
        assert int(settled.split()[0]) == rows[agent]["settled"]
    evidence = (DOCS / "evidence.md").read_text(encoding="utf-8").partition("### Zones, or a larger step?")[2]
    claims = {" than ".join(re.findall(AGENTS, claim.text)): claim for claim in section.claims[1:]}
    claims["collision-aware than shortest"] = section.claims[0]
    for name, claim in claims.items():
        (line,) = [line for line in evidence.splitlines() if line.startswith(f"| {name} |")]
        _, difference, p, corrected, verdict = (cell.strip() for cell in line.strip("|").split("|"))
        mean, low, high = (float(end.replace(",", "")) for end in re.findall(r"-?\d[\d,]*", difference))
        found = claim.numbers["difference"]
        for written, value in zip((mean, low, high), (found.value, *found.interval), strict=True):
            assert abs(written - value) <= 500
        assert f"p = {p}, for 5 claims {corrected} (Holm)" in claim.evidence
        assert verdict == claim.verdict
    verdicts = [claim.verdict for claim in section.claims]
    assert verdicts == ["holds", "holds", "undecided", "undecided", "undecided"]


def test_four_rooms_otherwise_are_what_their_record_comes_to(tmp_path: Path) -> None:
    records = runpy.run_path(str(DOCS.parent / "benchmarks" / "records.py"))
    records["unpack"](DOCS / "records" / "four-rooms-otherwise.tar.xz", tmp_path / "four")
    page = (DOCS / "evidence.md").read_text(encoding="utf-8")
    trials = sorted((tmp_path / "four").glob("runs/*/trials/*.json"))
    assert len(trials) == 8
    for trial in trials:
        content = json.loads(trial.read_text(encoding="utf-8"))
        settings = json.loads((trial.parents[1] / "run.json").read_text(encoding="utf-8"))
        reward, frames = settings["reward"]["name"], 5 if content["about"]["halfway"] else 10
        learner = settings["learner"]
        changed = "whitened" if learner["whiten_features"] else "3 x rate"
        assert learner["lr_start"] == (0.0007 if changed == "whitened" else 0.0021)
        begin = f"| {reward}, {changed} | {frames} M | "
        (line,) = [line for line in page.splitlines() if line.startswith(begin)]
        steps, collisions, failed = line.removeprefix(begin).replace(",", "").strip(" |").split(" | ")
        episodes = {name: np.array(column) for name, column in content["episodes"].items()}
        expect(steps, episodes["steps"].mean(), begin)
        expect(collisions, episodes["collisions"].mean(), begin)
        assert failed == f"{len(set(episodes['target'][~episodes['reached'].astype(bool)].tolist()))} of 20"


@pytest.mark.slow
def test_the_bedroom_alone_is_what_its_record_comes_to(tmp_path: Path) -> None:
    records, folder = runpy.run_path(str(DOCS.parent / "benchmarks" / "records.py")), tmp_path / "bedroom"
    records["unpack"](DOCS / "records" / "bedroom.tar.xz", folder)
    page = (DOCS / "evidence.md").read_text(encoding="utf-8").partition("### The bedroom alone")[2]
    page = page.partition("\n## ")[0]
    asked = json.loads((folder / REQUEST_FILE).read_text(encoding="utf-8"))
    compared = 0
    for millions, settled in (("2.5", []), ("5", [("shortest", 2.3, 3), ("collision-aware", 4.25, 2)])):
        (folder / REQUEST_FILE).write_text(json.dumps({**asked, "frames": int(float(millions) * 1e6)}))
        (section,) = gather(folder).sections
        assert not section.missing
        ends, late = section.tables[:2]
        for _, agent, frames, _, failed, steps, between, collisions, between_collisions in ends.rows:
            begin = f"| {agent} | {frames / 1e6:g} M | {millions} M |"
            (line,) = [line for line in page.splitlines() if line.startswith(begin)]
            written = line.removeprefix(begin).strip(" |").split(" | ")
            for cell, value, interval in zip(written, (steps, collisions), (between, between_collisions), strict=False):
                mean, _, low_to_high = cell.replace(",", "").partition(" ")
                expect(mean, value, begin)
                assert low_to_high == f"({interval.replace(',', '').replace(' to ', '-')})", begin
            assert written[2] == failed
            compared += 1
        rows = {row[1]: row for row in late.rows}
        for agent, mean, count in settled:
            assert rows[agent][3:5] == (count, mean * 1e6)
            assert f"`{agent}` after {mean:.2f} M" in page
    assert compared == 8


@pytest.mark.slow
def test_off_the_grid_is_what_its_record_comes_to(tmp_path: Path) -> None:
    records = runpy.run_path(str(DOCS.parent / "benchmarks" / "records.py"))
    records["unpack"](DOCS / "records" / "off-grid-bathroom.tar.xz", tmp_path / "off-grid")
    (section,) = gather(tmp_path / "off-grid").sections
    assert not section.missing
    (table,) = section.tables
    rows = [dict(zip(table.headings, row, strict=True)) for row in table.rows]
    lines = (DOCS / "evidence.md").read_text(encoding="utf-8").partition("### Five seeds, published settings")[2]
    lines = lines.partition("\n### ")[0].splitlines()
    figures = [heading for heading in table.headings[4:] if not heading.startswith("95 %")]
    means = [row for row in rows if row["setting"] == "all settings, mean"]
    assert len(means) == 4
    for row in means:
        (line,) = [line for line in lines if line.startswith(f"| {row['reward']} |")]
        for cell, name in zip(line.strip("|").split("|")[1:], figures, strict=True):
            scale = 1 if name == "contacts" else 100
            ends = (float(end) for end in str(row[f"95 % of {name}"]).split(" to "))
            for written, value in zip(re.findall(r"[\d.]+", cell), (float(str(row[name])), *ends), strict=True):
                assert abs(float(written) - scale * value) <= (0.0051 if name == "contacts" else 0.051), (
                    f"{row['reward']}, {name}"
                )
    claims = [
        line.strip("|").split("|") for line in lines if line.endswith(("undecided |", "holds |", "does not hold |"))
    ]
    assert len(claims) == len(section.claims) == 12
    for (text, difference, p, corrected, verdict), claim in zip(claims, section.claims, strict=True):
        assert claim.text.endswith(f": {text.strip()}")
        found = claim.numbers["difference"]
        assert found.interval is not None
        told = f"{found.value:.3g} ({found.interval[0]:.3g} to {found.interval[1]:.3g})"
        assert difference.strip() == told
        assert f"p = {p.strip()}, for 6 claims {corrected.strip()} (Holm)" in claim.evidence
        assert verdict.strip() == claim.verdict


@pytest.mark.slow
def test_what_single_parts_bring_is_what_its_record_comes_to(tmp_path: Path) -> None:
    records = runpy.run_path(str(DOCS.parent / "benchmarks" / "records.py"))
    records["unpack"](DOCS / "records" / "ablations-two-rooms.tar.xz", tmp_path / "ablations")
    (section,) = gather(tmp_path / "ablations").sections
    assert not section.missing
    told = {
        "as it is: history 4": ("default", "collision-aware"),
        "history 1": ("default, history 1", "collision-aware"),
        "history 2": ("default, history 2", "collision-aware"),
        "history 8": ("default, history 8", "collision-aware"),
        "one head": ("default, one head", "collision-aware"),
        "the collision zone's penalty alone": ("default", "beta-alone"),
        "the precollision zone's penalty alone": ("default", "gamma-alone"),
    }
    rows = [dict(zip(table.headings, row, strict=True)) for table in section.tables for row in table.rows]
    part = (DOCS / "evidence.md").read_text(encoding="utf-8").partition("### What single parts bring")[2]
    lines = part.partition("\n### ")[0].splitlines()
    for begin, (learner, agent) in told.items():
        (line,) = [line for line in lines if line.startswith(f"| {begin}") and line.count("|") == 5]
        shown = line.strip("|").split("|")[1:]
        mine = [row for row in rows if (row["learner"], row["agent"]) == (learner, agent) and "seed" not in row]
        steps, collisions, settled = (
            next(row for row in mine if row.get("figure") == "steps"),
            next(row for row in mine if row.get("figure") == "collisions"),
            next(row for row in mine if "settled" in row),
        )
        for text, row, name in zip(shown, (steps, collisions, settled), ("average", "average", "frames"), strict=True):
            mean, *interval = numbers(text.replace(",", "").replace("-", " "))
            expect(mean, row[name], begin)
            assert interval == numbers(str(row["95 %"]).replace(",", ""))
    verdicts = [claim.verdict for claim in section.claims]
    assert verdicts == ["undecided"] * 6
    claimed = [line.strip("| ").split(" | ") for line in lines if line.endswith("| undecided |")]
    for cells, claim in zip(claimed, section.claims, strict=True):
        assert f"p = {cells[2]}, for 6 claims {cells[3]} (Holm)" in claim.evidence
        told = re.search(r"difference (\S+) \[(\S+) to (\S+)\]", claim.evidence)
        assert told and re.findall(r"-?[\d.]+", cells[1]) == [f"{float(one):.3f}" for one in told.groups()], cells
        arm = cells[0].rpartition("than with ")[2]
        assert (
            claim.text.endswith(arm)
            or {"beta-alone": "collision", "gamma-alone": "precollision"}[claim.text.rpartition(" ")[2]]
            == arm.split()[1]
        ), cells
    failed = {row["failed targets"] for row in rows if row.get("seeds") == 5 and "failed targets" in row}
    assert "All 50\ntargets" in part and failed == {"0 of 50"}


def test_rooms_that_nobody_tuned_on_are_solved_as_their_record_says() -> None:
    sets = json.loads((DOCS / "figures" / "fresh-rooms.json").read_text(encoding="utf-8"))
    runs = [run for one in sets for run in one["seeds"]]
    assert len(runs) == 6 and all(run["met"]["all"] and run["solved_targets"] == 20 for run in runs)
    first, solved = ([run["first_met"][name]["seconds"] for run in runs] for name in ("all", "solved_targets"))
    columns = [[run[name] for run in runs] for name in ("path_ratio", "worst_path_ratio", "collisions")]
    (line,) = [
        line for line in (DOCS / "results.md").read_text(encoding="utf-8").splitlines() if "three times four" in line
    ]
    for cell, values in zip(line.strip("|").split("|")[1:], [*columns, solved, first], strict=True):
        least, most = numbers(cell)
        expect(least, min(values), cell)
        expect(most, max(values), cell)
    for one in sets:
        for run in one["seeds"]:
            rows = run["evaluation"]["targets"]
            for name in ("steps", "collisions"):
                assert run[name] == pytest.approx(sum(row[name] for row in rows) / len(rows))


def test_other_encoders_and_rooms_meet_the_criteria_as_their_record_says() -> None:
    made = json.loads((DOCS / "figures" / "other-encoders-and-rooms.json").read_text(encoding="utf-8"))
    assert [one["command"].split()[-1] for one in made] == [
        f"{k}{n}.json" for k in ("encoder", "room") for n in range(1, 6)
    ]
    part = (DOCS / "evidence.md").read_text(encoding="utf-8").partition("**Other encoders, other rooms**")[2]
    for first, name in ((0, "| the random ResNet-50"), (5, "| the rooms")):
        runs = [run for one in made[first : first + 5] for run in one["seeds"]]
        assert len(runs) == 5 and all(run["met"]["all"] and run["solved_targets"] == 10 for run in runs)
        (line,) = [line for line in part.splitlines() if line.startswith(name)]
        cells = line.strip("|").split("|")[2:]
        for cell, figure in zip(cells, ("path_ratio", "worst_path_ratio", "collisions"), strict=True):
            least, most = numbers(cell)
            expect(least, min(run[figure] for run in runs), cell)
            expect(most, max(run[figure] for run in runs), cell)
        for run in runs:
            rows = run["evaluation"]["targets"]
            assert run["collisions"] == pytest.approx(sum(row["collisions"] for row in rows) / len(rows))


def test_one_pose_beside_four_is_what_its_record_comes_to() -> None:
    arms = runpy.run_path(str(DOCS.parent / "benchmarks" / "quality_arms.py"))
    records = arms["records_in"]([DOCS / "figures" / "history.json"])
    assert [one["learner"]["history_length"] for one in records] == [1, 4]
    part = (DOCS / "evidence.md").read_text(encoding="utf-8").partition("### What single parts bring")[2]
    for name, (*values, p, corrected) in arms["compared"](*records).items():
        (line,) = [line for line in part.splitlines() if line.startswith(f"| {name}")]
        *shown, told, told_of_both = line.replace(",", "").strip("| ").split("|")[1:]
        for cell, runs in zip(shown, values, strict=True):
            for number, value in zip(numbers(cell), (runs.mean(), runs.min(), runs.max()), strict=True):
                expect(number, value, cell)
        expect(told.strip(), p, line)
        expect(told_of_both.strip(), corrected, line)
        assert corrected < 0.05
    lines = [line.strip("| ").split(" | ") for line in part.splitlines()]
    (ratios,) = [cells[1:3] for cells in lines if cells[0].startswith("steps, x the shortest path (not asked)")]
    (met,) = [cells[1:3] for cells in lines if cells[0].startswith("all criteria met")]
    for record, ratio, count in zip(records, ratios, met, strict=True):
        runs = record["seeds"]
        for number, value in zip(
            numbers(ratio), [f([run["path_ratio"] for run in runs]) for f in (min, max)], strict=True
        ):
            expect(number, value, ratio)
        assert count == f"{sum(run['met']['all'] for run in runs)} of {len(runs)}"
    worst = max(run["worst_path_ratio"] for run in records[1]["seeds"])
    assert f"ends with a target {100 * (worst - 1):.1f} % above" in part
    results = (DOCS / "results.md").read_text(encoding="utf-8")
    fewest = [float(np.mean([run["collisions"] for run in record["seeds"]])) for record in records]
    assert "{:.4f} collisions an episode, not {:.4f}".format(*fewest) in results


@pytest.mark.parametrize("record", sorted((DOCS / "records").glob("*.tar.xz")), ids=lambda path: path.name)
def test_a_record_does_not_say_where_its_folder_lay(record: Path) -> None:
    with tarfile.open(record, "r:xz") as archive:
        settings = [member for member in archive if member.name.endswith(("run.json", "reproduction.json"))]
        assert len(settings) >= 2
        for member in settings:
            file = archive.extractfile(member)
            assert file is not None and not re.search(rb'(?:"| )/\w', file.read()), member.name
