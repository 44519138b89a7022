from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from clearway.agents.by_pose import RandomWalk
from clearway.errors import RunError
from clearway.evaluation.episode_files import read_episodes, write_episodes
from clearway.evaluation.episodes import EpisodeTable, run_episodes
from helpers.small_runs import small_world


def walked() -> EpisodeTable:
    return run_episodes(small_world(), RandomWalk(), episodes_per_target=4, step_limit=30, seed=1)


def test_a_table_comes_back_as_it_was(tmp_path: Path) -> None:
    table = walked()
    write_episodes(tmp_path / "episodes.json", table, {"run": "a"})
    found, about = read_episodes(tmp_path / "episodes.json")
    assert about == {"run": "a"}
    for field in fields(EpisodeTable):
        before, after = getattr(table, field.name), getattr(found, field.name)
        if field.default is None:  # trajectories and arrivals
            assert after is None
            continue
        np.testing.assert_array_equal(before, after)
        assert before.dtype.kind == after.dtype.kind


@pytest.mark.parametrize("content", ["", "[]", '{"format_version": 1, "about": {}, "episodes": {}}', "{"])
def test_a_damaged_file_is_refused_by_name(tmp_path: Path, content: str) -> None:
    path = tmp_path / "episodes.json"
    path.write_text(content)
    with pytest.raises(RunError, match=r"episodes\.json"):
        read_episodes(path)


def test_a_newer_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "episodes.json"
    write_episodes(path, walked(), {})
    path.write_text(path.read_text().replace('"format_version":1', '"format_version":9'))
    with pytest.raises(RunError, match="newer"):
        read_episodes(path)


def test_columns_of_different_length_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "episodes.json"
    write_episodes(path, walked(), {})
    path.write_text(path.read_text().replace('"collisions":[', '"collisions":[7,'))
    with pytest.raises(RunError, match="length"):
        read_episodes(path)
