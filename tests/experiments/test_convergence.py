from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.evaluation.episode_files import read_episodes, write_episodes
from clearway.experiments import convergence
from clearway.experiments.convergence import mark_steps, settled_row, settling
from clearway.experiments.fig4 import jobs
from clearway.experiments.groups import PAIR, compared
from clearway.experiments.job import do, run_folder, trial_path
from clearway.experiments.setting import Setting
from helpers.small_setting import small_setting


def rows(*steps: float | None, success: float = 1.0) -> list[dict[str, float]]:
    """Metrics every 10 frames with such means of steps; None: no episode ended."""
    return [
        {"frames": 10.0 * number, "episodes": float(own is not None), "steps": own or 0.0, "success": success}
        for number, own in enumerate(steps, start=1)
    ]


@pytest.mark.parametrize(
    ("steps", "frames"),
    [
        ((30, 9, 30, 10, 9), 40),  # the first time below was no lasting one
        ((10, 10), 10),  # at the mark is settled
        ((30, None, 9, 9), 30),
        ((30, 30, 9), None),  # a last row alone may be luck
        ((9, 30, None, 9, None), None),
        ((9,), None),
        ((9, 9, 11), None),
        ((30, None), None),
        ((None,), None),
        ((), None),
    ],
)
def test_training_has_settled_after_its_last_row_above_the_mark(
    steps: tuple[float | None, ...], frames: int | None
) -> None:
    row = settled_row(rows(*steps), 10)
    assert (None if row is None else row["frames"]) == frames


def test_training_whose_episodes_are_cut_has_not_settled_however_few_steps_they_take() -> None:
    cut, arriving = rows(9, 9, success=0.94), rows(9, 9, 9, 9, success=0.95)
    assert settled_row(cut, 10) is None
    assert settled_row([*cut, *arriving[2:]], 10) == arriving[2]


def steps_one_by_one(graph: list[list[int]], target: int) -> list[int]:
    """Shortest-path steps from every other pose, by trying more and more steps."""
    found, here, steps = {target: 0}, {target}, 0
    while here:
        steps += 1
        here = {pose for pose, after in enumerate(graph) if pose not in found and here & set(after)}
        found |= dict.fromkeys(here, steps)
    return [steps for pose, steps in found.items() if pose != target]


def test_the_mark_is_twice_the_shortest_paths(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    means = []
    for scene, own in zip(setting.scenes, setting.targets, strict=True):
        paths = [steps_one_by_one(scene.graph.tolist(), target) for target in own]
        means.append(sum(sum(path) / len(path) for path in paths) / len(own))
    assert mark_steps(setting, setting.targets) == pytest.approx(2 * sum(means) / len(means))


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Setting:
    """The small setting, figure 4's jobs done; as if every episode had reached its target."""
    setting = small_setting(tmp_path_factory.mktemp("reproduction"))
    for job in jobs(setting):
        do(setting.out, job, threads=1)
        for trial in job.trials:
            tell_reached(trial_path(setting.out, job.run, trial), True)
    return setting


def tell_reached(path: Path, last: bool) -> None:
    """Write a trial anew: every episode reached its target, the last one if `last`."""
    table, about = read_episodes(path)
    reached = np.ones(len(table), bool)
    reached[-1] = last
    write_episodes(path, replace(table, reached=reached), about)


@pytest.mark.parametrize(("detour", "settled"), [(1e6, 2), (1e-6, 0)])
def test_runs_that_never_settle_count_with_all_frames(
    done: Setting, detour: float, settled: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(convergence, "DETOUR", detour)
    monkeypatch.setattr(convergence, "ARRIVING", 0.0)
    table, claims = settling("fig4", done, compared(done, PAIR))
    for row, group in zip(table.rows, compared(done, PAIR), strict=True):
        named = dict(zip(table.headings, row, strict=True))
        first = [next(r for r in run_folder(done.out, run).metrics() if r["episodes"])["frames"] for run in group.runs]
        whole = [run.learner.frames for run in group.runs]
        assert (named["seeds"], named["settled"]) == (2, settled)
        assert named["frames"] == pytest.approx(sum(first if settled else whole) / 2)
    assert [claim.text.split(":")[0] for claim in claims] == ["paper", "default"]


def test_a_run_whose_metrics_were_removed_does_not_count(done: Setting, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(convergence, "DETOUR", 1e6)
    monkeypatch.setattr(convergence, "ARRIVING", 0.0)
    groups = compared(done, PAIR)
    metrics = run_folder(done.out, groups[0].runs[1]).metrics_path
    text = metrics.read_text()
    metrics.unlink()
    table, _ = settling("fig4", done, groups)
    metrics.write_text(text)
    columns = [table.headings.index(name) for name in ("seeds", "settled")]
    assert [[row[number] for number in columns] for row in table.rows] == [[1, 1], [2, 2], [2, 2], [2, 2]]


def test_a_run_that_misses_a_target_in_the_end_has_not_settled(done: Setting, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(convergence, "DETOUR", 1e6)
    monkeypatch.setattr(convergence, "ARRIVING", 0.0)
    groups = compared(done, PAIR)
    missed = trial_path(done.out, groups[0].runs[1], groups[0].trial)
    tell_reached(missed, False)
    table, _ = settling("fig4", done, groups)
    tell_reached(missed, True)
    assert [row[table.headings.index("settled")] for row in table.rows] == [1, 2, 2, 2]
