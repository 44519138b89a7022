import importlib.util
import json
import re
import sys
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

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


def test_rows_are_json_lines_that_reach_the_file_at_once(tmp_path: Path, row: dict[str, float], monkeypatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)  # as where TensorBoard is not installed
    log = MetricsLog(tmp_path / "metrics.jsonl")
    log.write(row)
    log.write(row | {"frames": 160})
    lines = (tmp_path / "metrics.jsonl").read_text().splitlines()
    log.close()
    assert [json.loads(line) for line in lines] == [row, row | {"frames": 160}]
    assert [path.name for path in tmp_path.iterdir()] == ["metrics.jsonl"]


class FakeWriter:
    """Stands in for TensorBoard's: appends what it is handed to a file in its folder."""

    def __init__(self, log_dir: str, purge_step: int | None) -> None:
        folder = Path(log_dir)
        folder.mkdir(exist_ok=True)
        self.file = (folder / "events").open("a")

    def add_scalar(self, name: str, value: float, step: float, walltime: float) -> None:
        self.file.write(json.dumps([name, step, value, walltime]) + "\n")

    def close(self) -> None:
        self.file.close()


@pytest.fixture
def fake_board(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: name == "tensorboard")
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", SimpleNamespace(SummaryWriter=FakeWriter))


@pytest.mark.usefixtures("fake_board")
def test_tensorboard_has_each_figure_of_a_resumed_run_once(tmp_path: Path, row: dict[str, float]) -> None:
    rows = [row | {"frames": 80 * number, "seconds": float(number)} for number in range(1, 5)]
    path = tmp_path / "metrics.jsonl"
    log = MetricsLog(path)
    for each in rows[:3]:
        log.write(each)
    log.close()
    path.write_text(json.dumps(rows[0]) + "\n")  # the checkpoint was written after the first row
    log = MetricsLog(path, before=rows[:1], seconds=1.5)
    for each in rows[1:]:
        log.write(each)
    log.close()
    events = [json.loads(line) for line in (tmp_path / "tensorboard" / "events").read_text().splitlines()]
    assert [event[:3] for event in events] == [[name, r["frames"], r[name]] for r in rows for name in r]
    times = [event[3] for event in events if event[0] == "loss"]
    assert [later - times[0] for later in times] == pytest.approx([0.0, 1.0, 2.0, 3.0], abs=1e-3)
    assert [json.loads(line) for line in path.read_text().splitlines()] == rows


def test_tensorboard_reads_what_was_written(tmp_path: Path, row: dict[str, float]) -> None:
    pytest.importorskip("tensorboard")
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    path = tmp_path / "metrics.jsonl"
    log = MetricsLog(path)
    log.write(row)
    log.write(row | {"frames": 160})
    log.close()
    log = MetricsLog(path, before=[row], seconds=row["seconds"])
    log.write(row | {"frames": 160, "loss": 7.0})
    log.close()
    read = EventAccumulator(str(tmp_path / "tensorboard")).Reload()
    assert set(read.Tags()["scalars"]) == set(row)
    found = [(event.step, event.value) for event in read.Scalars("loss")]
    assert found == [(80, pytest.approx(row["loss"])), (160, 7.0)]
