"""Hard, unseen and held-out targets."""

import json
from pathlib import Path

import numpy as np
import pytest

from clearway.envs.world import make_world
from clearway.evaluate.episodes import run_episodes
from clearway.evaluate.policies import random_policy, shortest_path_policy
from clearway.experiments import fig5, fig6, hard
from clearway.experiments.hard_targets import hard_targets, hardness
from clearway.zones import Zone
from made import corridor_scene, grid_scene
from small_setting import small_setting


def test_hardness_by_other_means() -> None:
    """Random-walk steps by walking, and the share of collision poses on shortest paths by counting."""
    scene, target = corridor_scene(3), 4  # the middle cell, looking along the corridor
    world = make_world([scene], {scene.name: (target,)})
    walked = run_episodes(world, random_policy(), episodes_per_target=4000, seed=1)
    direct = run_episodes(world, shortest_path_policy(world), episodes_per_target=4000, seed=1)
    share = direct.zone_steps[:, Zone.COLLISION].mean() / direct.steps.mean()
    assert hardness(scene)[target] == pytest.approx(walked.steps.mean() * share, rel=0.08)


def test_hard_targets_lie_apart_and_lead_the_ranking() -> None:
    scene = grid_scene(3, width=9, depth=9, obstacle_share=0.1)
    chosen = hard_targets(scene, 3)
    cells = np.rint(scene.locations_m[list(chosen)] / scene.cell_size_m)
    apart = np.abs(cells[:, None] - cells[None]).max(-1)
    assert (apart[~np.eye(3, dtype=bool)] >= 4).all()
    assert int(hardness(scene).argmax()) in chosen


def test_where_too_few_lie_apart_they_stand_closer() -> None:
    assert len(set(hard_targets(corridor_scene(3), 5))) == 5


def test_hard_targets_are_written_once_and_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    setting = small_setting(tmp_path)
    first = hard.chosen(setting)
    content = json.loads((tmp_path / hard.FILE).read_text())
    assert content["targets"] == {"bathroom": list(first[0]), "kitchen": list(first[1])}
    monkeypatch.setattr(hard, "hard_targets", lambda scene: pytest.fail("chosen again"))
    assert hard.chosen(setting) == first


@pytest.mark.parametrize("steps", [1, 2, 4])
def test_unseen_targets_are_so_many_steps_away_and_not_trained_on(tmp_path: Path, steps: int) -> None:
    setting = small_setting(tmp_path)
    chosen = fig5.unseen_targets(setting, steps)
    for scene, own, trained in zip(setting.scenes, chosen, setting.targets, strict=True):
        assert own and not set(own) & set(trained)
        away = scene.distances_to(np.array(trained))[:, list(own)]
        assert (away == steps).any(0).all()


def test_training_sets_grow_and_never_hold_what_is_held_out(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    held_out = fig6.held_out_targets(setting)
    before: list[set[int]] = [set(), set()]
    for count in fig6.TRAINED:
        (group, *_) = fig6._groups(setting, count)
        for number, own in enumerate(group.runs[0].targets):
            assert len(own) == count
            assert before[number] < set(own)
            assert not set(own) & set(held_out[number])
            before[number] = set(own)
        assert group.trial.targets == held_out
