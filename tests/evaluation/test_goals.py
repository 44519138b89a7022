from __future__ import annotations

import numpy as np
import pytest

from clearway.agents.by_pose import shortest_paths
from clearway.errors import SceneError
from clearway.evaluation.goals import GoalEvaluation, GoalFigures, arrivals, drawn_goals, evaluate_goals
from clearway.scenes.actions import Action
from helpers.agents import by_rule, only
from helpers.made import corridor_scene, grid_scene, scene_of_cells

SCENES = [corridor_scene(5), grid_scene(1, feature_count=16)]


def test_goals_are_distinct_poses_of_the_largest_part_and_repeat_by_seed():
    cells = np.array([[0, 0], [1, 0], [2, 0], [9, 9]])
    scene = scene_of_cells(cells)
    goals = drawn_goals(scene, 11, 3)
    assert goals == sorted(set(goals)) and len(goals) == 11 and max(goals) < 12
    assert drawn_goals(scene, 11, 3) == goals != drawn_goals(scene, 11, 4)
    with pytest.raises(SceneError, match="12 goals asked for, the largest part has 12 poses"):
        drawn_goals(scene, 12, 3)
    assert drawn_goals(scene, 4, 3, np.arange(4, 8)) == [4, 5, 6, 7] != drawn_goals(scene, 4, 3)
    with pytest.raises(
        SceneError, match=r"5 goals asked for, the largest part has 4 poses for them\. Ask for 4 at most"
    ):
        drawn_goals(scene, 5, 3, np.arange(4, 8))


def test_goals_are_drawn_among_poses_where_they_are_given():
    walked = []

    def maker(world):
        walked.append(world.target_state.tolist())
        return shortest_paths(world)

    evaluate_goals({"own": maker}, SCENES, goals=4, among={"corridor": np.arange(8, 12)})
    (targets,) = walked
    assert targets[:4] == [8, 9, 10, 11] and all(target >= SCENES[0].state_count for target in targets[4:])


def test_shortest_paths_are_perfect_and_a_random_walk_is_not():
    own, random, shortest = evaluate_goals({"own": shortest_paths}, SCENES, goals=6, seed=1)
    assert [one.agent for one in (own, random, shortest)] == ["own", "random", "shortest path"]
    assert own.scenes == shortest.scenes and list(own.scenes) == ["corridor", "grid"]
    for figures in own.scenes.values():
        assert (figures.success, figures.success_4x, figures.spl, figures.collisions) == (1, 1, 1, 0)
        assert figures.episodes == 6
    assert own.average.episodes == 12
    assert random.average.spl < 0.5 and random.average.collisions > 1
    assert random.average.steps > 3 * own.average.steps


def test_failed_episodes_count_with_the_limit():
    turning, *_ = evaluate_goals(
        {"turning": lambda world: by_rule(world, only(Action.TURN_RIGHT))}, SCENES, goals=6, step_limit=30
    )
    figures = turning.scenes["corridor"]
    assert figures.success < 1 and figures.collisions == 0
    assert figures.steps >= 30 * (1 - figures.success)
    assert figures.success_4x <= figures.success


def test_the_average_is_the_mean_over_scenes():
    told = GoalEvaluation("a", {"x": GoalFigures(1, 1, 0.5, 2, 10, 4), "y": GoalFigures(0, 0, 0, 4, 500, 8)})
    assert told.average == GoalFigures(0.5, 0.5, 0.25, 3, 255, 12)
    content = told.to_json()
    assert content["scenes"][0] == {
        "scene": "x",
        "success": 1,
        "success_4x": 1,
        "spl": 0.5,
        "collisions": 2,
        "steps": 10,
        "episodes": 4,
    }
    assert content["average"]["episodes"] == 12


def test_an_episode_that_ends_where_it_first_says_to_be_there_succeeds_at_the_goal_alone() -> None:
    reached = np.array([True, True, True, False, False])
    false = np.array([0, 3, 0, 0, 1])
    told = np.array([True, True, False, False, False])
    assert arrivals(reached, false, told) == {
        "false_arrivals": 0.4,
        "missed_arrivals": pytest.approx(1 / 3),
        "success_stopped": 0.2,
    }
    assert arrivals(~reached & False, false, told)["missed_arrivals"] is None
    assert arrivals(reached, None, None) == {}
