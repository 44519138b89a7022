"""Figures of typed-in episodes, and what their tables say."""

from __future__ import annotations

import json

import numpy as np
import pytest
from rich.console import Console

from clearway.evaluation.episodes import EpisodeTable
from clearway.live.arrangement import Arrangement
from clearway.live.conditions import Perturbations
from clearway.live.episodes import LiveProtocol, LiveTable
from clearway.live.result_tables import agent_rows, compared_rows, markdown_tables, rich_tables
from clearway.live.results import LiveReport, LiveResult, grid_figures, summarise

PROTOCOL = LiveProtocol(2, 10, 0, "sampled")


def table(**columns: list[float]) -> LiveTable:
    """Two targets, two episodes each."""
    plain: dict[str, list[float]] = {
        "start": [0, 0, 0, 0],
        "seed": [0, 1, 2, 3],
        "steps": [10, 4, 5, 5],
        "contacts": [3, 0, 0, 1],
        "reached": [False, True, True, True],
        "shortest_path_steps": [4, 4, 5, 5],
        "least_gap_m": [0.0, 0.05, 0.2, 0.0],
        "mean_gap_m": [0.1, 0.3, 0.4, 0.2],
        "close_s": [5.0, 1.0, 0.0, 1.0],
        "near_s": [10.0, 2.0, 1.0, 4.0],
        "changed": [False, False, False, False],
    }
    arrays = {name: np.array(values) for name, values in (plain | columns).items()}
    return LiveTable(
        target=np.array([0, 0, 1, 1]), layouts=(Arrangement(()),) * 4, walks=(np.zeros((1, 3)),) * 4, **arrays
    )


def wary() -> LiveTable:
    return table(
        contacts=[0, 0, 0, 0], reached=[True] * 4, steps=[4, 4, 5, 5], least_gap_m=[0.1, 0.0505, 0.1, 0.1],
        close_s=[0.0, 0.0, 0.0, 0.0], near_s=[2.0, 2.0, 1.0, 1.0],
    )  # fmt: skip


@pytest.fixture(scope="module")
def result() -> LiveResult:
    return summarise("none", Perturbations(), {"bold": [table()], "wary": [wary()]}, seed=0)


@pytest.fixture(scope="module")
def report(result: LiveResult) -> LiveReport:
    """Beside "wary" on the grid: of four episodes three succeed."""
    grid = EpisodeTable(
        target=np.array([0, 0, 1, 1]),
        start=np.zeros(4, int),
        steps=np.array([10, 4, 5, 5]),
        collisions=np.array([6, 0, 0, 1]),
        reached=np.array([False, True, True, True]),
        shortest_path_steps=np.array([4, 4, 5, 5]),
        zone_steps=np.zeros((4, 3), int),
        looped=np.zeros(4, bool),
    )
    return LiveReport(
        (result,), {"wary": grid_figures(grid, np.array([0, 0]), seed=0)}, {"room": (3, 9)}, PROTOCOL, "tiny"
    )


def test_values_are_means_over_targets(result):
    values = result.agents["bold"].values
    assert values["success"] == pytest.approx((0.5 + 1.0) / 2)
    assert values["steps"] == pytest.approx((7 + 5) / 2)
    assert values["contacts"] == pytest.approx((1.5 + 0.5) / 2)
    assert values["contacts_per_100_steps"] == pytest.approx((300 / 14 + 100 / 10) / 2)
    assert values["contact_free"] == 0.5
    assert values["min_clearance_m"] == pytest.approx((0.025 + 0.1) / 2)
    assert values["mean_clearance_m"] == pytest.approx(((10 * 0.1 + 4 * 0.3) / 14 + 0.3) / 2)
    assert values["share_within_10cm"] == pytest.approx((6 / 14 + 1 / 10) / 2)
    assert values["share_within_30cm"] == pytest.approx((12 / 14 + 5 / 10) / 2)
    assert values["within_30cm_s"] == pytest.approx((6 + 2.5) / 2)


def test_every_value_lies_in_its_interval(result):
    for figures in result.agents.values():
        for name, (low, high) in figures.intervals.items():
            assert low - 1e-9 <= figures.values[name] <= high + 1e-9, name


def test_agents_are_compared_episode_by_episode(result):
    found = result.comparison
    assert found is not None and (found.first, found.second) == ("bold", "wary")
    assert found.differences.values["success"] == pytest.approx(0.25)
    assert found.differences.values["contacts"] == pytest.approx(-1.0)
    assert found.differences.values["min_clearance_m"] == pytest.approx((0.1 + 0.0005 - 0.1 + 0.1) / 4)
    # larger, a tie to a millimetre, smaller, larger
    assert found.larger_clearance.values["probability_of_larger_clearance"] == pytest.approx((0.75 + 0.5) / 2)


def test_scenes_count_alike():
    few = LiveTable(**{**vars(table()), "target": np.array([0, 0, 0, 0]), "contacts": np.array([8, 8, 8, 8])})
    both = summarise("none", Perturbations(), {"bold": [table(), few]}, seed=0)
    assert both.agents["bold"].values["contacts"] == pytest.approx((1.0 + 8.0) / 2)
    assert both.comparison is None and compared_rows([both]) == []


def test_tables_show_figures_with_intervals_and_say_what_success_means(report):
    (place, agent, on_grid), (_, name, cells), *_ = agent_rows(report)
    assert (place, agent) == ("on the grid", "wary")
    assert [value for value, _ in on_grid] == ["75", "6.0", "1.75", "–", "–", "–", "–"]
    assert name == "bold" and cells[0][0] == "75" and cells[1][0] == "6.0"
    ((_, _, differences),) = compared_rows(report.results)
    assert differences[1][0] == "-1.00" and " to " in differences[1][1]
    text = markdown_tables(report)
    assert "| on the grid | wary | 75 (" in text and "| – | – | – | – |" in text
    assert "| none | wary | 100 (100–100) |" in text
    assert "wary less bold" in text and "within 25 cm, at most half a cell, and 45°" in text and "Encoder: tiny" in text


def test_a_terminal_of_80_columns_shows_every_figure_whole(report):
    console = Console(width=80, record=True)
    console.print(rich_tables(report))
    text = console.export_text()
    assert "…" not in text and max(map(len, text.splitlines())) <= 80
    for _, _, cells in (*agent_rows(report), *compared_rows(report.results)):
        assert all(word in text for value, ends in cells for word in (value, *ends.split(" to ")))


def test_the_grid_stands_in_one_place_of_the_json(report):
    content = json.loads(json.dumps(report.to_json()))
    found = content["grid"]["agents"]["wary"]
    assert (found["success"], found["steps"], found["contacts"], found["contact_free"]) == (0.75, 6.0, 1.75, 0.5)
    assert found["contacts_per_100_steps"] == pytest.approx((600 / 14 + 10) / 2)
    assert set(found) == {*found["intervals"], "intervals"} and "min_clearance_m" not in found
    assert content["targets"] == {"room": [3, 9]}
    assert [one["setting"] for one in content["results"]] == ["none"]


def test_results_are_json(result):
    content = json.loads(json.dumps(result.to_json()))
    assert content["agents"]["bold"]["success"] == 0.75
    assert content["comparison"]["probability_of_larger_clearance"] == 0.625
    assert content["perturbations"]["new_obstacle"] is False
