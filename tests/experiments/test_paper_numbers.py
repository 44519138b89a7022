"""The paper's figures hang together, and stand beside no others than their own."""

import pytest

from clearway.experiments.paper_numbers import AVERAGE, KINDS, TABLE_1, TABLE_2, TABLE_3, PaperRow, reminder

ROWS = [row for table in (TABLE_1, TABLE_2, TABLE_3) for row in table.values()]


@pytest.mark.parametrize("row", ROWS)
@pytest.mark.parametrize("metric", ["steps", "collisions"])
def test_averages_are_those_of_the_rooms(row: PaperRow, metric: str) -> None:
    values = getattr(row, metric)
    rooms = sum(values[kind] for kind in KINDS) / 4
    assert values[AVERAGE] == pytest.approx(rooms, rel=0.05)  # the paper rounds generously


def test_of_some_rooms_their_own_mean_is_shown() -> None:
    row = TABLE_1["shortest"]
    assert row.average("steps", ["bathroom", "bedroom", "living_room", "kitchen"]) == 14.7
    assert row.average("steps", ["bathroom_02"]) == 7.17
    assert row.average("steps", ["bathroom", "kitchen"]) == pytest.approx((7.17 + 21.38) / 2)
    assert row.average("steps", ["bathroom", "hall"]) is None
    assert row.by_scene("collisions", ["kitchen_02", "hall"]) == [0.2, None]


@pytest.mark.parametrize(
    ("scenes", "targets", "said"),
    [
        (True, True, "The paper's figures are of single runs."),
        (
            False,
            True,
            "The paper's figures are of single runs on other scenes and features; compare rewards, not rooms.",
        ),
        (
            False,
            False,
            "The paper's figures are of single runs on other scenes, features and targets; compare rewards, not rooms.",
        ),
        (True, False, "The paper's figures are of single runs on other targets; compare rewards, not rooms."),
    ],
)
def test_the_reminder_says_what_differs(scenes: bool, targets: bool, said: str) -> None:
    assert reminder(scenes, targets) == said
