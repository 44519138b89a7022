"""Results, JSON and tables of the whole protocol."""

import io
import json
import re
from dataclasses import replace

import pytest
from rich.console import Console

from clearway.agents.by_pose import RandomWalk
from clearway.agents.selection import Argmax
from clearway.evaluation.episodes import run_episodes
from clearway.evaluation.metrics import METRIC_NAMES
from clearway.evaluation.protocol import evaluate_agents
from clearway.evaluation.summary import Evaluation, Protocol, summarise
from clearway.evaluation.tables import MARK, main_rows, markdown_table, rich_tables, table_text
from clearway.world.world import make_world
from helpers.made import corridor_scene, grid_scene

TARGET_KEYS = {"scene", "target", "steps", "collisions", "success", "sc", "spl", "shortest_path_steps"}
TOP_KEYS = {"agent", "encoder", "episodes_per_target", "step_limit", "seed", "action_selection"}
TARGETS = {"grid": [3, 17, 40], "corridor": [0, 19]}


@pytest.fixture(scope="module")
def evaluations() -> list[Evaluation]:
    scenes = [grid_scene(2), corridor_scene(5, feature_count=32)]
    world = make_world(scenes, TARGETS)
    agents = {"first": RandomWalk(), "second": Argmax(RandomWalk())}
    return evaluate_agents(world, agents, encoder="made-up", episodes_per_target=40, step_limit=400)


def test_every_agent_is_shown_in_all_ways_and_the_references_are_there(evaluations):
    rows = [(e.agent, e.protocol.action_selection) for e in evaluations]
    assert rows == [
        ("first", "sampled"),
        ("first", "argmax"),
        ("first", "argmax-untried"),
        ("second", "sampled"),
        ("second", "argmax"),
        ("second", "argmax-untried"),
        ("random", "sampled"),
        ("shortest path", "sampled"),
    ]


def test_the_shortest_path_agent_is_perfect(evaluations):
    ideal = evaluations[-1]
    for result in (*ideal.targets, *ideal.scenes, ideal.average):
        assert result.values["steps"] == result.values["shortest_path_steps"]
        assert result.values["spl"] == result.values["sc"] == result.values["success"] == 1.0
        assert result.values["collisions"] == 0 and result.values["path_ratio"] == 1.0
        assert not result.failed_targets


def test_intervals_contain_their_value(evaluations):
    for evaluation in evaluations:
        for result in (*evaluation.targets, *evaluation.scenes, evaluation.average):
            assert tuple(result.values) == tuple(result.intervals) == METRIC_NAMES
            for name, (low, high) in result.intervals.items():
                assert low - 1e-9 <= result.values[name] <= high + 1e-9


def test_json_has_the_agreed_keys_and_survives_the_round_trip(evaluations):
    for evaluation in evaluations:
        content = evaluation.to_json()
        assert json.loads(json.dumps(content, allow_nan=False)) == content
        assert TOP_KEYS | {"targets", "scenes", "average"} <= set(content)
        assert all(set(target) >= TARGET_KEYS for target in content["targets"])
        assert [(t["scene"], t["target"]) for t in content["targets"]] == [(s, t) for s in TARGETS for t in TARGETS[s]]
        assert [scene["scene"] for scene in content["scenes"]] == list(TARGETS)
        by_hand = sum(scene["steps"] for scene in content["scenes"]) / 2
        assert content["average"]["steps"] == pytest.approx(by_hand)


def test_failed_targets_are_named_and_marked(evaluations):
    argmax_of_random = evaluations[1]  # walks forward for ever
    assert argmax_of_random.average.failed_targets
    assert argmax_of_random.average.solved_targets == 5 - len(argmax_of_random.average.failed_targets)
    for result in argmax_of_random.targets:
        assert bool(result.failed_targets) == (result.values["success"] < 1)
    table = table_text(evaluations, "targets")
    solved = table.headings.index("solved")
    for row in table.rows:
        assert row[solved].failed == (row[solved].text != "100 %")
        assert row[solved].text.startswith(MARK) == row[solved].failed
    assert any(note.startswith(MARK) for note in table.notes)
    assert not any(note.startswith(MARK) for note in table_text(evaluations[-1:]).notes)


def test_a_success_of_nearly_all_is_not_rounded_to_all(evaluations):
    perfect = evaluations[-1].targets[0]
    nearly = replace(perfect, failed_targets=(("grid", 3),), values={**perfect.values, "success": 0.9998})
    evaluation = replace(evaluations[-1], targets=(nearly,))
    solved = table_text([evaluation], "targets").rows[0][2]
    assert solved.failed and solved.text == f"{MARK} 99.9 %"


@pytest.mark.parametrize(("level", "rows"), [("average", 8), ("scenes", 16), ("targets", 40)])
def test_tables_show_every_row_and_the_encoder(evaluations, level, rows):
    text = markdown_table(evaluations, level)
    assert text.count("\n| ") == rows + 1  # the line of dashes and the rows follow the headings
    assert "Encoder: made-up." in text
    console = Console(width=100, record=True, file=io.StringIO())
    console.print(rich_tables(evaluations, [level]))
    shown = console.export_text()
    assert "Encoder: made-up." in shown and "shortest path" in shown and "…" not in shown


def test_wherever_success_stands_on_a_page_the_stricter_scores_stand_beside_it(evaluations):
    headings = [set(table_text(evaluations, width=width).headings) for width in ("terminal", "page", "all")]
    assert headings[0] < headings[1] < headings[2]
    assert {"sc %", "sc 4× %", "SPL %"} <= headings[1]
    assert {"sc %", "SPL %"} <= headings[0]


def test_the_terminal_s_table_fits_80_columns(evaluations):
    console = Console(width=200, file=io.StringIO())
    console.print(rich_tables(evaluations, ["average"]))
    rows = [line.rstrip() for line in console.file.getvalue().splitlines() if "–" in line or "steps" in line]
    assert len(rows) > 5
    assert max(map(len, rows[:-2])) <= 80


def test_several_tables_share_their_notes(evaluations):
    console = Console(width=100, record=True, file=io.StringIO())
    console.print(rich_tables(evaluations, ["targets", "scenes", "average"]))
    shown = console.export_text()
    assert shown.count("SPL %") == 3 and shown.count("Encoder: made-up.") == 1
    assert shown.index("Encoder: made-up.") > shown.rindex("SPL %")


def test_every_column_shows_its_own_figure(evaluations):
    values = {
        "steps": 12.345,
        "path_ratio": 1.234,
        "collisions": 0.2345,
        "collisions_per_100_steps": 2.5,
        "collision_free": 0.91,
        "sc": 0.82,
        "sc_4x": 0.73,
        "spl": 0.64,
        "collision_free_spl": 0.55,
        "share_collision": 0.46,
        "looped": 0.015,
    }
    others = dict.fromkeys(set(METRIC_NAMES) - values.keys(), -1.0)
    known = {**values, **others}
    ends = {name: (value, 2 * value) for name, value in known.items()}
    average = replace(evaluations[0].average, values=known, intervals=ends, failed_targets=(), target_count=5)
    table = table_text([replace(evaluations[0], average=average)])
    shown = {heading: (cell.text, cell.below) for heading, cell in zip(table.headings, table.rows[0], strict=True)}
    assert shown == {
        "agent": ("first", ""),
        "solved": ("5/5", ""),
        "steps": ("12.3", "12.3–24.7"),
        "× shortest": ("1.23", "1.23–2.47"),
        "collisions": ("0.234", "0.234–0.469"),
        "per 100 steps": ("2.50", "2.50–5.00"),
        "no collision %": ("91.0", "91.0–182.0"),
        "sc %": ("82.0", "82.0–164.0"),
        "sc 4× %": ("73.0", "73.0–146.0"),
        "SPL %": ("64.0", "64.0–128.0"),
        "collision-free SPL %": ("55.0", "55.0–110.0"),
        "in collision zone %": ("46.0", "46.0–92.0"),
        "looped %": ("1.50", "1.50–3.00"),
    }


def test_the_seed_is_that_of_the_bootstrap_too():
    scene = grid_scene(2)
    world = make_world([scene], {scene.name: [3, 17]})
    table = run_episodes(world, RandomWalk(), episodes_per_target=30, step_limit=400)
    first, again, other = (summarise(world, table, "a", "e", Protocol(30, 400, seed, "sampled")) for seed in (0, 0, 1))
    assert first.average.values == other.average.values
    assert first.average.intervals == again.average.intervals != other.average.intervals


def printed(evaluations: list[Evaluation], levels: list[str]) -> str:
    console = Console(width=80, file=io.StringIO())
    console.print(rich_tables(evaluations, levels, every=False, rest="elsewhere"))
    return console.file.getvalue()


def test_of_several_agents_the_main_rows_show_each_once(evaluations):
    shown = printed(evaluations, ["average"])
    names = [line.split("  ")[0].strip() for line in shown.splitlines() if re.match(r" [a-z].*/5", line)]
    assert names == ["first", "second", "random", "shortest path"]
    assert "4 more rows, of other ways of acting: elsewhere." in shown


def test_what_is_not_shown_is_named_as_what_it_is(evaluations):
    first, *_, random, shortest = evaluations
    optimum = replace(first, agent="optimum (shortest)")
    assert "1 more row, of exact optima: elsewhere." in printed([first, optimum, random, shortest], ["average"])
    both = "5 more rows, of other ways of acting and exact optima: elsewhere."
    assert both in printed([*evaluations, optimum], ["average"])
    assert "more row" not in printed(main_rows(evaluations), ["average"])


def test_ranges_are_explained_only_where_they_are_shown(evaluations):
    one_scene = [replace(evaluation, scenes=evaluation.scenes[:1]) for evaluation in evaluations]
    for which, levels in [(evaluations, ["scenes"]), (evaluations, ["targets"]), (one_scene, ["scenes"])]:
        shown = printed(which, levels)
        assert ("Ranges: 95 %" in shown) == ("–" in shown) == (which is one_scene)
    assert "Ranges: 95 %" in printed(evaluations, ["targets", "average"])
    single = [replace(one, protocol=replace(one.protocol, episodes_per_target=1)) for one in evaluations]
    shown = printed(single, ["average"])  # of one episode none can be told
    assert "Ranges" not in shown and "–" not in shown and "1 episode a target" in shown
