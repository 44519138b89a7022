"""The paper's figures hang together, and stand beside no others than their own."""

import pytest

from clearway.experiments.paper_numbers import (
    AVERAGE,
    FIGURE_5_AVERAGE_SC,
    KINDS,
    TABLE_1,
    TABLE_2,
    TABLE_3,
    PaperRow,
    reminder,
)

ROWS = [row for table in (TABLE_1, TABLE_2, TABLE_3) for row in table.values()]


@pytest.mark.parametrize("row", ROWS)
@pytest.mark.parametrize("metric", ["steps", "collisions"])
def test_averages_are_those_of_the_rooms(row: PaperRow, metric: str) -> None:
    values = getattr(row, metric)
    rooms = sum(values[kind] for kind in KINDS) / 4
    assert values[AVERAGE] == pytest.approx(rooms, rel=0.05)  # the paper rounds generously


def test_every_figure_typed_once_more() -> None:
    """In the order of the paper's rows: bathroom, bedroom, living room, kitchen, average."""
    typed = {
        "1 shortest steps": (TABLE_1, [7.17, 14.82, 15.20, 21.38, 14.70]),
        "1 shortest collisions": (TABLE_1, [0.04, 0.12, 0.25, 0.20, 0.15]),
        "1 collision-aware steps": (TABLE_1, [7.33, 14.81, 14.90, 20.83, 14.47]),
        "1 collision-aware collisions": (TABLE_1, [0.03, 0.04, 0.15, 0.12, 0.082]),
        "2 shortest steps": (TABLE_2, [7.43, 13.76, 1323.88, 19.17, 341.06]),
        "2 shortest collisions": (TABLE_2, [0.06, 0.15, 247.78, 0.30, 62.07]),
        "2 collision-aware steps": (TABLE_2, [7.29, 14.63, 568.78, 18.89, 152.39]),
        "2 collision-aware collisions": (TABLE_2, [0.03, 0.08, 61.66, 0.25, 15.5]),
        "3 shortest steps": (TABLE_3, [7.46, 13.92, 18.12, 18.03, 14.38]),
        "3 shortest collisions": (TABLE_3, [0.04, 0.12, 0.20, 0.19, 0.14]),
        "3 collision-aware steps": (TABLE_3, [7.16, 14.15, 17.73, 17.86, 14.225]),
        "3 collision-aware collisions": (TABLE_3, [0.01, 0.03, 0.05, 0.07, 0.04]),
    }
    kinds = ("bathroom", "bedroom", "living_room", "kitchen", "average")
    for name, (table, figures) in typed.items():
        _, reward, metric = name.split()
        assert getattr(table[reward], metric) == dict(zip(kinds, figures, strict=True)), name
    assert FIGURE_5_AVERAGE_SC == {"shortest": 0.574, "collision-aware": 0.581}


def test_of_some_rooms_their_own_mean_is_shown() -> None:
    row = TABLE_1["shortest"]
    assert row.average("steps", ["bathroom", "bedroom", "living_room", "kitchen"]) == 14.7
    assert row.average("steps", ["bathroom_02"]) == 7.17
    assert row.average("steps", ["bathroom", "kitchen"]) == pytest.approx((7.17 + 21.38) / 2)
    assert row.average("steps", ["bathroom", "hall"]) is None
    assert row.average("steps", [f"bathroom_{number}" for number in range(4)]) == 7.17
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
