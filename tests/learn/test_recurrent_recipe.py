"""The recipe of docs/seeing.md for agents that learn to walk, small: rooms, eyes, training, rooms never entered."""

from __future__ import annotations

from pathlib import Path

import pytest

import clearway

SETTINGS = {"envs": 48, "rollout_steps": 16, "taught": 0.7}
MARGIN = 0.6  # of the random walk's steps; a tenth more success within four times the shortest path


@pytest.mark.slow
def test_the_small_recipe_beats_a_random_walk_in_rooms_never_entered(tmp_path: Path):
    for split, count in (("train", 12), ("validation", 4)):
        clearway.generate("room", count, split=split, out=tmp_path / split, encoder="clearway", workers=1)
    settings = clearway.Recurrent(frames=150_000, **SETTINGS)
    clearway.train(tmp_path / "train", algorithm=settings, perturb="all", takes=1, out=tmp_path / "run", threads=1)
    told, random, _ = clearway.evaluate_goals(tmp_path / "run", tmp_path / "validation", goals=15, step_limit=300)
    assert told.average.steps < MARGIN * random.average.steps
    assert told.average.success_4x > random.average.success_4x + 0.1
    assert told.average.collisions < MARGIN * random.average.collisions
    assert told.average.false_arrivals is not None
