import importlib.util
import json
from dataclasses import fields
from pathlib import Path

import pytest

from clearway.learn.metrics_log import MetricsLog, metrics_row
from clearway.learn.trainer import Update
from small_runs import small_learner, small_trainer

DOCUMENT = Path(__file__).parents[2] / "docs" / "metrics.md"


@pytest.fixture
def row() -> dict[str, float]:
    trainer = small_trainer(small_learner())
    return metrics_row(trainer, trainer.update(), seconds=1.23456)


def test_a_row_holds_progress_episodes_and_the_update(row: dict[str, float]) -> None:
    assert (row["frames"], row["updates"], row["seconds"]) == (80, 1, 1.235)
    assert set(row) >= {field.name for field in fields(Update)}
    assert set(row) >= {"episodes", "success", "steps", "collisions", "solved_targets"}


def test_every_figure_is_explained_in_the_document(row: dict[str, float]) -> None:
    training = DOCUMENT.read_text().split("\n## Training", 1)[1].split("\n## ", 1)[0]
    missing = [name for name in row if f"`{name}`" not in training]
    assert not missing


def test_rows_are_json_lines_that_reach_the_file_at_once(tmp_path: Path, row: dict[str, float], monkeypatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)  # as where TensorBoard is not installed
    log = MetricsLog(tmp_path / "metrics.jsonl")
    log.write(row)
    log.write(row | {"frames": 160})
    lines = (tmp_path / "metrics.jsonl").read_text().splitlines()
    log.close()
    assert [json.loads(line) for line in lines] == [row, row | {"frames": 160}]
    assert [path.name for path in tmp_path.iterdir()] == ["metrics.jsonl"]


def test_tensorboard_gets_every_figure_where_it_is_installed(tmp_path: Path, row: dict[str, float]) -> None:
    pytest.importorskip("tensorboard")
    log = MetricsLog(tmp_path / "metrics.jsonl")
    log.write(row)
    log.close()
    assert list((tmp_path / "tensorboard").iterdir())
