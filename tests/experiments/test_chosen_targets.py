"""Hard, unseen and held-out targets."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.agents.by_pose import RandomWalk, shortest_paths
from clearway.errors import SceneError
from clearway.evaluation.episodes import run_episodes
from clearway.experiments import fig5, fig6, hard_tables
from clearway.experiments.groups import PAIR, Scores, all_jobs, compared, of_same_seeds
from clearway.experiments.hard_targets import hard_targets, hardness
from clearway.experiments.section import Claim
from clearway.scenes.actions import BLOCKED, Action
from clearway.scenes.floor_plans import GENERATED, FloorPlan
from clearway.scenes.plan_scenes import floor_plan_scene
from clearway.scenes.scene import Provenance, Scene
from clearway.world.world import make_world
from clearway.zones import Zone
from helpers.made import corridor_scene, grid_scene
from helpers.small_setting import do_here, small_setting


def test_hardness_by_other_means() -> None:
    """Random-walk steps by walking, and the share of collision poses on shortest paths by counting."""
    scene, target = corridor_scene(3), 4  # the middle cell, looking along the corridor
    world = make_world([scene], {scene.name: (target,)})
    walked = run_episodes(world, RandomWalk(), episodes_per_target=4000, seed=1)
    direct = run_episodes(world, shortest_paths(world), episodes_per_target=4000, seed=1)
    share = direct.zone_steps[:, Zone.COLLISION].mean() / direct.steps.mean()
    assert hardness(scene)[target] == pytest.approx(walked.steps.mean() * share, rel=0.08)


@pytest.mark.slow
def test_hard_targets_lie_apart_and_lead_the_ranking() -> None:
    scene = grid_scene(3, width=9, depth=9, obstacle_share=0.1)
    chosen = hard_targets(scene, 3)
    assert chosen.apart_cells == 4 <= least_apart(scene, chosen.targets)
    values = hardness(scene)
    assert int(values.argmax()) in chosen.targets
    assert chosen.rank[chosen.targets.index(int(values.argmax()))] == 1
    assert chosen.hardness == tuple(values[list(chosen.targets)])


def least_apart(scene: Scene, targets: tuple[int, ...]) -> int:
    """Cells between the two that lie closest."""
    places = scene.locations_m[list(targets)]
    apart = np.abs(places[:, None] - places[None]).max(-1) / scene.cell_size_m
    return int(np.rint(apart[~np.eye(len(targets), dtype=bool)].min()))


@pytest.mark.parametrize(("cells", "count", "apart"), [(3, 5, 0), (3, 3, 1), (5, 3, 2), (9, 3, 4)])
def test_where_too_few_lie_apart_they_stand_as_far_as_they_can(cells: int, count: int, apart: int) -> None:
    scene = corridor_scene(cells)
    chosen = hard_targets(scene, count)
    assert len(set(chosen.targets)) == count
    assert chosen.apart_cells == apart == least_apart(scene, chosen.targets)


def test_cells_may_lie_halfway_between_the_origin_s() -> None:
    scene = corridor_scene(9)
    halfway = replace(scene, locations_m=scene.locations_m + scene.cell_size_m / 2)
    assert hard_targets(halfway, 3) == hard_targets(scene, 3)
    assert least_apart(halfway, hard_targets(halfway, 3).targets) == 4


def test_hard_targets_lie_where_ways_lead() -> None:
    """Beside a room of four cells lies another one of two, with no way between them."""
    cells = np.array([[x, 0] for x in (0, 1, 2, 3, 9, 10)])
    scene = floor_plan_scene(FloorPlan("two rooms", cells), feature_count=4)
    chosen = hard_targets(scene, 5)
    assert (scene.components[list(chosen.targets)] == 0).all() and (scene.components == 1).any()
    assert max(chosen.rank) <= (scene.components == 0).sum()


def test_hard_targets_leave_out_what_is_held_out() -> None:
    scene = grid_scene(3, width=9, depth=9, obstacle_share=0.1)
    generated = replace(scene, made_by=Provenance(GENERATED, seed=0))
    hardest = hard_targets(scene, scene.state_count // 4, apart_cells=0).targets
    assert generated.held_out[list(hardest)].any()
    chosen = hard_targets(generated, scene.state_count // 4, apart_cells=0)
    assert not generated.held_out[list(chosen.targets)].any()
    assert max(chosen.rank) == len(chosen.targets)  # among those that may be targets


def test_seeds_that_one_reward_lacks_do_not_count_for_the_other() -> None:
    shortest, aware = Scores((5, 6, 7), np.arange(3.0).reshape(3, 1, 1)), Scores((7, 5), np.array([[[70.0]], [[50.0]]]))
    first, second = of_same_seeds([shortest, aware])
    assert first.seeds == second.seeds == (5, 7)
    assert (first.values.ravel().tolist(), second.values.ravel().tolist()) == ([0, 2], [50, 70])


def test_hard_targets_are_written_once_and_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    setting = small_setting(tmp_path)
    first = hard_tables.chosen(setting)
    content = json.loads((tmp_path / hard_tables.FILE).read_text())
    assert {name: found["targets"] for name, found in content["found"].items()} == {
        "bathroom": list(first[0]),
        "kitchen": list(first[1]),
    }
    monkeypatch.setattr(hard_tables, "hard_targets", lambda scene: pytest.fail("chosen again"))
    assert hard_tables.chosen(setting) == first


@pytest.mark.parametrize("steps", [1, 2, 4, 50])
def test_unseen_targets_are_so_many_steps_from_the_nearest_trained_one(tmp_path: Path, steps: int) -> None:
    setting = small_setting(tmp_path)
    chosen = fig5.unseen_targets(setting, steps)
    for scene, own, trained in zip(setting.scenes, chosen, setting.targets, strict=True):
        nearest = scene.distances_to(np.array(trained)).min(0)
        there = np.flatnonzero(nearest == min(steps, nearest.max()))  # no pose lies 50 away: the farthest stand in
        assert len(own) == min(len(there), setting.budget.unseen_targets) > 0
        assert set(own) <= set(there.tolist())


def test_poses_that_cannot_be_come_to_are_no_unseen_targets() -> None:
    scene = corridor_scene(8)
    graph = scene.graph.copy()
    graph[:28] = np.where(graph[:28] >= 28, BLOCKED, graph[:28])  # the last cell can be left, not entered
    away = fig5.steps_to_nearest(replace(scene, graph=graph), (0,))
    assert (away[28:] == -1).all() and away[:28].min() == 0 and away.max() == 8


def test_where_no_pose_lies_so_far_away_the_report_says_so(tmp_path: Path) -> None:
    (table, _) = fig5.section(small_setting(tmp_path)).tables
    (note,) = [note for note in table.notes if note.startswith("bathroom has no pose")]
    assert note.startswith("bathroom has no pose 8 steps from every trained target; its farthest, ")


def test_a_scene_with_fewer_targets_than_asked_for_is_told_and_one_without_any_refused(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    small = grid_scene(0, width=3, depth=2, obstacle_share=0, name="small")
    few = replace(setting, scenes=(setting.scenes[0], small))
    assert fig6._fewer(setting) == [] and len(fig6.training_targets(few, 45)[1]) == 19
    assert fig6._fewer(few) == [
        "small has 19 targets beside the held-out ones; where more are asked for, these stand in."
    ]
    tiny = grid_scene(0, width=1, depth=1, obstacle_share=0, name="tiny")
    with pytest.raises(SceneError, match="tiny: has no targets beside the 5 that figure 6 holds out"):
        fig6.training_targets(replace(setting, scenes=(tiny,)), 5)


def test_a_scene_with_a_way_out_that_leads_nowhere_back_has_no_hard_targets() -> None:
    scene = grid_scene(1, width=4, depth=4, obstacle_share=0)
    graph = scene.graph.copy()
    graph[:4, [Action.MOVE_FORWARD, Action.MOVE_BACKWARD]] = BLOCKED  # nothing leads out of the first cell
    with pytest.raises(SceneError, match="a random walk may never come to a target"):
        hardness(replace(scene, graph=graph))


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


@pytest.mark.parametrize("table", [hard_tables.TABLE2, hard_tables.TABLE3])
def test_whether_hard_targets_are_harder_is_open_until_the_usual_ones_are_there(
    tmp_path: Path, table: hard_tables.HardTable
) -> None:
    """It counts as a claim before (Holm): else verdicts would be taken back when they come."""
    setting = small_setting(tmp_path, seeds=4)
    setting = replace(setting, learners={"paper": setting.learners["paper"]})

    def claim() -> Claim:
        (found,) = [claim for claim in table.section(setting).claims if "detours" in claim.text]
        return found

    do_here(setting.out, all_jobs(table._groups(setting)), threads=1)
    assert (claim().verdict, claim().evidence) == ("undecided", hard_tables.NO_EASY)
    do_here(setting.out, all_jobs(compared(setting, PAIR)), threads=1)
    assert claim().p is not None and "; 4 and 4 seeds of 2 rewards each." in claim().evidence
