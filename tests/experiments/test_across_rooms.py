"""An agent for each room, and verdicts over rooms."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from clearway.evaluation.metrics import METRIC_NAMES
from clearway.experiments import across_rooms
from clearway.experiments.across_rooms import InRoom
from clearway.experiments.correction import corrected
from clearway.experiments.groups import Scores
from clearway.experiments.in_short import in_short
from clearway.experiments.job import episodes_of
from clearway.experiments.reproduce import planned
from clearway.experiments.section import Claim, ReportTable
from clearway.experiments.setting import Setting
from helpers.report_tables import by_heading
from helpers.small_setting import FRAMES, do_here, small_setting


@pytest.fixture
def setting(tmp_path: Path) -> Setting:
    """Two rooms, one learner, two seeds."""
    setting = small_setting(tmp_path)
    return replace(setting, learners={"paper": setting.learners["paper"]})


def test_every_room_has_agents_of_its_own(setting: Setting) -> None:
    jobs = planned(setting, [across_rooms.NAME])
    assert [job.run.scenes for job in jobs] == [(file,) for file in setting.files for _ in range(4)]
    assert {job.run.reward.name for job in jobs} == {"shortest", "collision-aware"}
    do_here(setting.out, jobs, threads=1)
    section = across_rooms.section(setting)
    rows = by_heading(section.tables[0])
    assert [(row["room"], row["agent"], row["seeds"]) for row in rows] == [
        (room, agent, 2) for room in ("bathroom", "kitchen") for agent in ("shortest", "collision-aware")
    ]
    for row in rows:
        own = [job for job in jobs if (job.run.scenes[0].name, job.run.reward.name) == (row["room"], row["agent"])]
        tables = [episodes_of(setting.out, job.run, job.trials[0]) for job in own]
        assert row["steps"] == pytest.approx(np.mean([table.steps.mean() for table in tables if table is not None]))
        assert row["frames until settled"] == FRAMES and row["settled"] == 0
    assert rows[0]["random walk's steps"] == rows[1]["random walk's steps"] > rows[0]["shortest path"] > 1
    beside = by_heading(section.tables[1])
    assert [(row["room"], row["agent"]) for row in beside] == [
        (room, agent) for room in ("bathroom", "kitchen") for agent in ("planner on a learnt map", "nearest picture")
    ]
    assert all(row["steps"] == row["shortest path"] and row["collisions"] == 0 for row in beside)  # each room's map
    assert [row["map of"] for row in beside] == [f"{100 * -(-64 * row['poses'] // 100):,} frames" for row in rows]
    assert [row["shortest path"] for row in beside] == [row["shortest path"] for row in rows]
    (figure,) = section.figures
    assert figure.series[0].y == (1, 1) and len(set(figure.series[0].x)) == 2
    assert {claim.verdict for claim in section.claims} == {"undecided"}
    (line,) = in_short([section])
    assert "(3 asked): fewer than 6 rooms, or rooms that lack runs, decide nothing (one" in line and "4" not in line
    assert all("2 of 2 rooms are complete" in claim.evidence and claim.p is None for claim in section.claims)
    assert [{job.run.seed for job in jobs if job.run.scenes == (file,)} for file in setting.files] == [{0, 1}, {2, 3}]


def test_before_anything_has_run_there_are_rows_without_figures(setting: Setting) -> None:
    section = across_rooms.section(setting)
    assert [row["seeds"] for row in by_heading(section.tables[0])] == [0] * 4 and not section.figures
    assert all(claim.evidence.startswith("0 of 2 rooms are complete. Nothing is dec") for claim in section.claims)


CENSORED = 1e6
Rooms = Sequence[tuple[float, ...]]
"""Of each room: frames, collisions, steps, the share of episodes that arrive, and how many targets (else five)."""


@pytest.fixture
def judged(setting: Setting, monkeypatch: pytest.MonkeyPatch) -> Callable[[Rooms, Rooms], list[Claim]]:
    """The claims, in their order, where rooms come to such figures, of the collision-aware agents first."""

    def in_room(frames: float, collisions: float, steps: float, arrive: float, targets: int = 5) -> InRoom:
        values = np.ones((1, targets, len(METRIC_NAMES)))
        for name, value in (("collisions", collisions), ("steps", steps), ("success", arrive)):
            values[:, :, METRIC_NAMES.index(name)] = value
        return InRoom(Scores((0,), values), np.array([[frames]]), int(frames < CENSORED), 1)

    def claims(ours: Rooms, theirs: Rooms, lacks: Mapping[str, object] = MappingProxyType({})) -> list[Claim]:
        rooms = [
            {"shortest": in_room(*other), "collision-aware": in_room(*own)}
            for own, other in zip(ours, theirs, strict=True)
        ]
        rooms[2]["shortest"] = replace(rooms[2]["shortest"], **lacks)
        left = iter(rooms)
        several = replace(setting, **{name: getattr(setting, name)[:1] * len(rooms) for name in ("files", "scenes")})
        several = replace(several, targets=setting.targets[:1] * len(rooms))
        monkeypatch.setattr(across_rooms, "_in_room", lambda room: {"paper": next(left)})
        monkeypatch.setattr(across_rooms, "_who_learn_nothing", lambda rooms: ReportTable("beside", "", (), ()))
        return list(corrected(across_rooms.section(several)).claims)

    return claims


BASELINE = [(size, 0.2, size / 100, 1.0) for size in (200.0, 900.0, 4_000.0, 1_500.0, 700.0, 3_000.0, 1_100.0, 500.0)]


def test_what_every_room_shows_holds_however_rooms_differ(judged) -> None:
    ours = [(0.7 * frames, 0.1, steps, arrive) for frames, _, steps, arrive in BASELINE]
    found = judged(ours, BASELINE)
    assert [claim.verdict for claim in found] == ["holds"] * 3
    assert found[0].numbers["ratio"].value == pytest.approx(0.7)
    one_more = 1 / (5 * 3)  # episodes of a room
    assert found[1].numbers["ratio"].value == pytest.approx((0.1 + one_more) / (0.2 + one_more))
    assert [found[1].numbers[name].value for name in ("first", "second")] == pytest.approx([0.1, 0.2])
    assert "it lies below 1 in 8 of 8 rooms" in found[0].evidence and "below 1.02 in 8 of 8" in found[2].evidence
    back = judged(BASELINE, ours)
    assert [claim.verdict for claim in back] == ["does not hold", "does not hold", "holds"]


def test_where_rooms_disagree_it_is_undecided(judged) -> None:
    ours = [
        (frames * (0.6 if number % 2 else 1.5), 0.2, steps * (0.9 if number % 2 else 1.2), 1.0)
        for number, (frames, _, steps, _) in enumerate(BASELINE)
    ]
    assert [claim.verdict for claim in judged(ours, BASELINE)] == ["undecided"] * 3


def test_no_more_steps_allows_two_percent(judged) -> None:
    for share, verdict in ((1.01, "holds"), (1.05, "does not hold")):
        ours = [(*room[:2], share * room[2], 1.0) for room in BASELINE]
        assert judged(ours, BASELINE)[2].verdict == verdict


def test_agents_that_arrive_less_often_win_nothing(judged) -> None:
    ours = [(0.7 * frames, 0.0, steps, 0.97) for frames, _, steps, _ in BASELINE]
    settles, *others = judged(ours, BASELINE)
    assert settles.verdict == "holds"  # a run that misses a target has not settled: that is counted
    assert [claim.verdict for claim in others] == ["undecided"] * 2
    assert all("97.00%, 100.00%, so that the figures compare different episodes" in claim.evidence for claim in others)


def test_rooms_weigh_alike_however_many_targets_they_have(judged) -> None:
    ours, theirs = ([(*room, 1 if number == 0 else 5) for number, room in enumerate(BASELINE)] for _ in range(2))
    ours = [(0.7 * frames, 0.1, steps, arrive, targets) for frames, _, steps, arrive, targets in ours]
    ours[0] = (*ours[0][:3], 0.9, 1)
    found = judged(ours, theirs)[1]
    assert found.verdict == "undecided" and "episodes that arrived: 98.75%, 100.00%" in found.evidence


def test_one_lost_target_of_many_is_told_and_does_not_decide(judged) -> None:
    ours = [(0.7 * frames, 0.1, steps, 1.0) for frames, _, steps, _ in BASELINE]
    ours[0] = (*ours[0][:2], 2_000.0, 0.999)
    found = judged(ours, BASELINE)
    assert [claim.verdict for claim in found] == ["holds", "holds", "undecided"]  # one room with a thousandfold
    assert "(median 1)" in found[2].evidence and "Failed targets, over all seeds: 5 of 40, 0 of 40" in found[2].evidence


def test_rooms_that_neither_settles_say_nothing_and_stay_in(judged) -> None:
    rooms = [(CENSORED, 0.0, 10.0, 1.0)] * 3 + BASELINE[3:]
    ours = [*rooms[:3], *((0.5 * frames, 0.0, steps, 1.0) for frames, _, steps, _ in rooms[3:])]
    found = judged(ours, rooms)
    assert found[0].numbers["ratio"].value == pytest.approx(0.5 ** (5 / 8))
    assert "it lies below 1 in 5 of 8 rooms" in found[0].evidence
    assert found[1].numbers["ratio"].interval is not None  # though nobody collides in three


def test_while_a_room_lacks_runs_nothing_is_decided(judged) -> None:
    ours = [(0.5 * frames, 0.0, steps, 1.0) for frames, _, steps, _ in BASELINE]
    for lacks in ({"planned": 2}, {"frames": np.empty((0, 1))}):
        found = judged(ours, BASELINE, lacks)
        assert {(claim.verdict, claim.p) for claim in found} == {("undecided", None)}
        assert all(claim.evidence.startswith("7 of 8 rooms are complete") for claim in found)


def test_five_rooms_decide_nothing(judged) -> None:
    ours = [(0.5 * frames, 0.0, steps, 1.0) for frames, _, steps, _ in BASELINE[:5]]
    assert {claim.verdict for claim in judged(ours, BASELINE[:5])} == {"undecided"}
