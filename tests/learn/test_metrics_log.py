import json
import re
from contextlib import closing
from pathlib import Path

import pytest

from clearway.learn.algorithms import ALGORITHMS
from clearway.learn.metrics_log import MetricsLog, metrics_row
from clearway.reward import COLLISION_AWARE
from clearway.world.world import make_world
from helpers.small_eyes import seen_by_eyes, ship, small_generalist
from helpers.small_runs import small_learner, small_scenes, small_targets, small_trainer

DOCUMENT = Path(__file__).parents[2] / "docs" / "metrics.md"


@pytest.fixture
def row() -> dict[str, float]:
    trainer = small_trainer(small_learner())
    return metrics_row(trainer, trainer.update(), seconds=1.23456)


def test_a_row_holds_progress_episodes_and_the_update(row: dict[str, float]) -> None:
    assert (row["frames"], row["updates"], row["seconds"]) == (80, 1, 1.235)
    assert set(row) >= {"loss", "entropy", "clipped", "hindsight_rows", "lr"}
    assert set(row) >= {"episodes", "success", "steps", "collisions", "solved_targets"}


LABELS = {"ppo": "PPO", "a2c": "A2C", "a3c": "A3C", "bc": "BC", "q-learning": "Q-learning", "recurrent": "Recurrent"}
LABELS |= {"adapt": "Adapt"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ALGORITHMS)
def test_the_document_explains_every_figure_of_an_algorithm_and_no_other(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    training = DOCUMENT.read_text().split("\n## Training", 1)[1].split("\n## ", 1)[0]
    table = training.split("| key | of |", 1)[1].split("\n\n", 1)[0]
    cells = [line.split(" | ") for line in table.splitlines()[2:]]
    explained = {
        key for keys, of, *_ in cells if LABELS[name] in of.split(", ") for key in re.findall(r"`(\w+)`", keys)
    }
    scenes = seen_by_eyes(tmp_path, *small_scenes()) if name in ("recurrent", "adapt") else small_scenes()
    if name == "adapt":
        ship(small_generalist(tmp_path), monkeypatch)
    world = make_world(scenes, small_targets())
    with closing(small_learner(ALGORITHMS[name]()).trainer(world, COLLISION_AWARE, 0)) as trainer:
        figures = trainer.update()
        while name == "recurrent" and not trainer.finished:  # it learns in two ways
            figures |= trainer.update()
        row = metrics_row(trainer, figures, seconds=1.0)
    assert set(figures) == explained
    assert not [key for key in row if f"`{key}`" not in training]


def test_rows_are_json_lines_that_reach_the_file_at_once(tmp_path: Path, row: dict[str, float]) -> None:
    log = MetricsLog(tmp_path / "metrics.jsonl")
    log.write(row)
    log.write(row | {"frames": 160})
    lines = (tmp_path / "metrics.jsonl").read_text().splitlines()
    log.close()
    assert [json.loads(line) for line in lines] == [row, row | {"frames": 160}]
    assert [path.name for path in tmp_path.iterdir()] == ["metrics.jsonl"]
