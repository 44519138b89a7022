"""Goals off the grid: figures of live episodes, tours before them, and what an agent says of its arrival."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from clearway.agents.agent import Decisions, Observation, State
from clearway.agents.by_pose import RandomWalk
from clearway.errors import AgentError, SceneError
from clearway.evaluation.goals import drawn_goals
from clearway.live import goals
from clearway.live.conditions import REFERENCE, Condition, Perturbations, as_it_was_built
from clearway.live.episodes import LiveProtocol, run_live_episodes
from clearway.live.goals import LiveTouring, walk_to_goals
from clearway.live.live_room import MODEL_SOURCE
from clearway.live.tours import walk_live_tour
from clearway.rooms.camera import eye_view
from clearway.rooms.render import Camera, studio
from clearway.scenes.actions import Action
from clearway.scenes.floor_plans import GENERATED
from clearway.scenes.scene import Provenance
from clearway.scenes.sensors import RGB
from clearway.world.world import make_world

NONE = Condition("none", Perturbations())
SETTINGS = {"goals": 8, "step_limit": 60, "seed": 1}


@pytest.fixture(autouse=True)
def own_room(live, monkeypatch) -> None:
    """The small room stands for the one that its scene would be built as."""
    monkeypatch.setattr(goals, "live_room", lambda scene: live)


@pytest.fixture(scope="module")
def camera(live) -> Iterator[Camera]:
    with studio(live.model, eye_view(), workers=1) as opened:
        yield opened


class Claiming(RandomWalk):
    """Walks at random and always holds that it is there, or never."""

    def __init__(self, claims: bool) -> None:
        self.claims = claims

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        decisions, after = super().act(observation, state)
        return Decisions(decisions.action, arrived=np.full(len(decisions.action), self.claims)), after


class Ahead(RandomWalk):
    """Looks at colour pictures, and walks ahead without end; it remembers how many steps."""

    sees = (RGB,)

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        return {"steps": np.zeros(len(seed), np.int64)}

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        count = len(observation[RGB])
        return Decisions(np.full(count, int(Action.MOVE_FORWARD))), {"steps": state["steps"] + 1}


def test_what_cannot_be_moved_is_told_before_any_room_is_built(live, monkeypatch):
    monkeypatch.setattr(goals, "live_room", lambda scene: pytest.fail("built"))
    model = replace(live.scene, name="model", made_by=Provenance(MODEL_SOURCE))
    rooms, asked = [live.scene, model], [NONE, Condition("all", REFERENCE)]
    with pytest.raises(SceneError, match="model: nothing can be moved in a MuJoCo model, and move_furniture is asked"):
        walk_to_goals("random", RandomWalk(), rooms, asked, **SETTINGS)
    made_by = Provenance(GENERATED, seed=0, notes={"generator_version": "0"})
    rooms = [live.scene, replace(live.scene, name="old", made_by=made_by)]
    with pytest.raises(SceneError, match=r"old: .*generate it again"):
        walk_to_goals("random", RandomWalk(), rooms, [NONE], **SETTINGS)


def test_figures_are_those_of_the_episodes_to_the_goals_of_the_grid(live):
    world = make_world([live.scene], {live.scene.name: drawn_goals(live.scene, 8, 1)})
    table = run_live_episodes(live, world, RandomWalk(), None, NONE.perturbations, LiveProtocol(1, 60, 1, "sampled"))
    noisy = Condition("all", REFERENCE)
    plain, changed = walk_to_goals("random", RandomWalk(), [live.scene], [NONE, noisy], **SETTINGS)
    figures = plain.scenes["walkable"]
    assert plain.agent == "random" and plain.perturbed["label"] == "none" and plain.tour is None
    assert figures.episodes == 8 and figures.false_arrivals is None
    assert 0 < figures.success == table.reached.mean() < 1
    assert figures.collisions == table.contacts.mean() > 0 and figures.steps == table.steps.mean()
    least = np.array([steps if reached else np.inf for steps, reached in zip(table.steps, table.reached, strict=True)])
    assert figures.spl == pytest.approx(np.mean(table.shortest_path_steps / np.maximum(least, 1)))
    assert figures.success_4x == np.mean(least <= 4 * table.shortest_path_steps)
    assert changed.perturbed["perturbations"] == REFERENCE.to_json() and changed.scenes != plain.scenes


@pytest.mark.parametrize("claims", [True, False])
def test_who_holds_to_be_there_is_asked_where_it_is_and_where_it_is_not(live, claims):
    (told,) = walk_to_goals("claiming", Claiming(claims), [live.scene], [NONE], **SETTINGS)
    figures = told.scenes["walkable"]
    assert 0 < figures.success < 1
    assert figures.false_arrivals == float(claims) and figures.missed_arrivals == float(not claims)
    assert figures.success_stopped == 0  # it says so at once, elsewhere, or never


def test_what_no_agent_may_do_is_one_line_off_the_grid_too(live):
    class Wrong(RandomWalk):
        def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
            decisions, after = super().act(observation, state)
            return Decisions(decisions.action, arrived=np.ones(1, bool)), after

    with pytest.raises(AgentError, match=r"gave arrived bool \(1,\), expected bool \(8,\)"):
        walk_to_goals("wrong", Wrong(), [live.scene], [NONE], **SETTINGS)


def test_two_scenes_of_one_name_are_refused_before_any_room_is_built(live, monkeypatch):
    monkeypatch.setattr(goals, "live_room", lambda scene: pytest.fail("built"))
    with pytest.raises(SceneError, match="two scenes have this name"):
        walk_to_goals("random", RandomWalk(), [live.scene, live.scene], [NONE], **SETTINGS)


@pytest.mark.slow
def test_a_tour_is_walked_off_the_grid_and_makes_the_agent(live, camera):
    tour = walk_live_tour(live, Ahead(), camera, Perturbations(), steps=6, seed=0)
    assert tour.state["steps"].tolist() == [6]
    assert tour.contacts >= 2, "the room is five steps long"
    made = []

    def after(state: State) -> RandomWalk:
        made.append(state["steps"].tolist())
        return RandomWalk()

    (told,) = walk_to_goals("toured", LiveTouring(Ahead(), after, 6), [live.scene], [NONE], **{**SETTINGS, "seed": 0})
    assert made == [[6]]
    assert told.tour == {"steps": 6, "collisions": tour.contacts}
    (plain,) = walk_to_goals("random", RandomWalk(), [live.scene], [NONE], **{**SETTINGS, "seed": 0})
    assert told.scenes == plain.scenes


def test_a_tour_sees_what_is_perturbed_and_nothing_that_is_moved(live, camera):
    assert as_it_was_built(REFERENCE).new_obstacle is False and as_it_was_built(REFERENCE).move_furniture == 0
    assert as_it_was_built(REFERENCE).light == REFERENCE.light

    class Looking(Ahead):
        def __init__(self) -> None:
            self.seen: list[np.ndarray] = []

        def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
            self.seen.append(observation[RGB][0])
            return super().act(observation, state)

    def first_seen(perturbations: Perturbations) -> np.ndarray:
        explorer = Looking()
        walk_live_tour(live, explorer, camera, perturbations, steps=1, seed=0)
        return explorer.seen[0]

    plain = first_seen(Perturbations())
    np.testing.assert_array_equal(first_seen(Perturbations(move_furniture=0.3, new_obstacle=True)), plain)
    assert not np.array_equal(first_seen(Perturbations(pixel_noise=5.0)), plain)
