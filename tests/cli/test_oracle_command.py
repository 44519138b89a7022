"""`clearway oracle`: exact figures of a corridor."""

from pathlib import Path

import numpy as np
import pytest

from clearway.scenes.thor_v1 import write_scene
from helpers.made import corridor_scene

OPTIMAL_KEYS = {"steps", "collision_visits", "precollision_visits"}
SOFT_KEYS = OPTIMAL_KEYS | {"collisions"}
TARGETS = (0, 8, 17)


@pytest.fixture(scope="module")
def corridor(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("oracle") / "corridor.h5"
    write_scene(corridor_scene(5), path)
    return path


def asked(clearway, corridor, *words):
    answer = clearway("oracle", corridor, "--targets", *TARGETS, *words, "--json")
    assert (answer.code, answer.err) == (0, "")
    return answer.json


def test_the_agreed_json(clearway, corridor):
    found = asked(clearway, corridor)
    steps = corridor_scene(5).distances
    assert [(row["scene"], row["target"]) for row in found] == [("corridor", target) for target in TARGETS]
    for row in found:
        assert row.keys() == {"scene", "target", "shortest_path_steps", "optimal", "soft"}
        assert row["optimal"].keys() == OPTIMAL_KEYS
        assert row["soft"].keys() == SOFT_KEYS
        to_target = steps[:, row["target"]]
        assert row["shortest_path_steps"] == pytest.approx(to_target[to_target > 0].mean())
        assert row["shortest_path_steps"] <= row["optimal"]["steps"] + 1e-9
        assert row["soft"]["collisions"] > 0


def test_without_zones_to_avoid_the_shortest_path_is_optimal(clearway, corridor):
    for row in asked(clearway, corridor, "--reward", "shortest"):
        assert row["optimal"]["steps"] == pytest.approx(row["shortest_path_steps"])


def test_without_the_clip_the_target_weighs_more_against_entropy(clearway, corridor):
    clipped, unclipped = asked(clearway, corridor), asked(clearway, corridor, "--no-clip")
    for with_clip, without in zip(clipped, unclipped, strict=True):
        assert without["soft"]["steps"] < with_clip["soft"]["steps"]
    alike = asked(clearway, corridor, "--no-clip", "--terminal", "1")
    assert np.allclose([row["soft"]["steps"] for row in alike], [row["soft"]["steps"] for row in clipped])


def test_a_table_without_json(clearway, corridor):
    answer = clearway("oracle", corridor)
    assert answer.code == 0
    assert answer.out.count("corridor") == 5  # seeded targets


@pytest.mark.parametrize("words", [("--discount", 0.9), ("--entropy", 0.05), ("--zones", "cell")], ids=lambda w: w[0])
def test_every_setting_moves_the_figures(clearway, corridor, words):
    plain, moved = (
        [row["soft"]["collision_visits"] for row in asked(clearway, corridor, *given)] for given in ((), words)
    )
    assert all(abs(one - other) > 1e-3 for one, other in zip(plain, moved, strict=True))


def test_the_table_fits_a_narrow_terminal(clearway, corridor, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    lines = clearway("oracle", corridor).out.splitlines()
    (heading,) = [line.split() for line in lines if "target" in line]
    assert heading == ["scene", "target", "shortest", "optimal", "in", "zone", "soft", "collisions", "in", "zone"]
    rows = [line.split() for line in lines if "corridor" in line]
    assert [len(row) for row in rows] == [8] * 5 and all(len(line) <= 80 for line in lines)


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("--entropy", "0"), "--entropy is 0.0"),
        (("--entropy", "-0.01"), "--entropy is -0.01"),
        (("--entropy", "nan"), "--entropy is nan"),
        (("--entropy", "inf"), "--entropy is inf"),
        (("--discount", "1"), "--discount is 1.0"),
        (("--discount", "0"), "--discount is 0.0"),
        (("--discount", "nan"), "--discount is nan"),
        (("--beta", "nan"), "--beta is nan"),
        (("--seed", "-1"), "--seed is -1"),
        (("--targets", "20"), "target 20 is out of range"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_bad_settings(clearway, corridor, words, part):
    assert clearway("oracle", corridor, *words).refusal(part)
