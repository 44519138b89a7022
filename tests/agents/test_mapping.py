from __future__ import annotations

import zlib
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from clearway.agents import exploring, tour_map
from clearway.agents.agent import FEATURES, LAST_ACTION
from clearway.agents.exploring import Explorer
from clearway.agents.mapping import MappingAgent
from clearway.agents.tour_map import map_of
from clearway.evaluation import metrics
from clearway.evaluation.episodes import run_episodes
from clearway.evaluation.takes import Takes
from clearway.evaluation.tours import Touring, walk_tour
from clearway.mapping.beliefs import NEXT, NEXT_AT_0, likeliest
from clearway.mapping.eyes_sight import EyesSight
from clearway.mapping.following import Follower
from clearway.mapping.moves import STAYED
from clearway.mapping.room_map import RoomMap
from clearway.mapping.settings import MappingSettings
from clearway.perception.around import PLACES_M
from clearway.perception.whereabouts import ELSEWHERE
from clearway.world.world import make_world
from helpers.agents import check_agent
from helpers.made import grid_scene
from helpers.perfect_sight import PerfectSight, seen_perfectly
from helpers.small_eyes import seen_by_eyes, small_eyes

SETTINGS = MappingSettings(side_m=15.0)


@pytest.fixture(scope="module")
def scene():
    return seen_perfectly(grid_scene(1, width=8, depth=7, obstacle_share=0.25))


@pytest.fixture(scope="module")
def world(scene):
    targets = np.random.default_rng(0).choice(np.flatnonzero(scene.components == 0), 12, replace=False)
    return make_world([scene], {scene.name: sorted(targets.tolist())})


def walked(world, agent):
    return run_episodes(world, agent, episodes_per_target=3, step_limit=300)


def test_with_good_eyes_it_finds_every_target_with_hardly_a_collision(scene, world):
    table = walked(world, MappingAgent(PerfectSight(scene), settings=SETTINGS))
    assert metrics.success(table).mean() == 1
    assert metrics.spl(table).mean() > 0.55 and table.collisions.mean() < 0.5
    assert table.false_arrivals is not None and (table.false_arrivals > 0).mean() < 0.1


def test_what_it_did_last_may_be_put_right(scene):
    agent = MappingAgent(PerfectSight(scene), settings=SETTINGS)
    seen, target = ({FEATURES: scene.features[first : first + 20]} for first in (0, 20))
    decisions, state = agent.act(seen, agent.reset(target, np.arange(20)))
    assert np.array_equal(state[LAST_ACTION], decisions.action) and len(set(decisions.action.tolist())) > 1


def test_who_holds_itself_for_shut_in_forgets_that_and_finds_its_target(scene, world):
    agent = MappingAgent(PerfectSight(scene), settings=SETTINGS)
    target = int(world.target_state[0])
    here = int(np.flatnonzero((scene.components == 0) & (np.arange(scene.state_count) != target))[-1])
    state = agent.reset({FEATURES: scene.features[[target]]}, np.zeros(1, np.uint64))
    for step in range(200):
        decisions, state = agent.act({FEATURES: scene.features[[here]]}, state)
        if step == 0:
            state["shut"][:] = True
        following = scene.graph[here, decisions.action[0]]
        here = here if following < 0 else int(following)
        if here == target:
            break
    assert here == target


@pytest.mark.slow
def test_who_sees_no_obstacles_bumps_into_them(scene, world):
    blind = PerfectSight(scene)
    blind.stands = lambda features: np.zeros((len(features), 63), np.float32)
    assert walked(world, MappingAgent(blind, settings=SETTINGS)).collisions.mean() > 1  # who sees them: below 0.5


def toured(scene, world, sight, steps=400):
    touring = Touring(
        lambda steps: Explorer(sight, steps, settings=SETTINGS),
        lambda state: MappingAgent(sight, known=map_of(state, sight, SETTINGS), settings=SETTINGS),
        steps,
    )
    return touring, walk_tour(world, touring, scene, seed=0)


@pytest.fixture(scope="module")
def tour(scene, world):
    """Who has toured the room, and the tour."""
    return toured(scene, world, PerfectSight(scene))


@pytest.mark.slow
def test_a_tour_comes_near_every_pose_before_it_comes_to_all():
    hall = seen_perfectly(grid_scene(1, width=14, depth=14, obstacle_share=0.25))
    targets = make_world([hall], {hall.name: [5, 9]})
    sight = PerfectSight(hall)
    taken = [map_of(toured(hall, targets, sight, n)[1].state, sight, SETTINGS).taken for n in (120, 800)]
    apart = np.abs(taken[1][:, None] - taken[0]).astype(float)
    apart[..., 0][apart[..., 0] > 0] = np.inf  # another heading shows something else
    assert len(taken[0]) < 120 and len(taken[1]) > 400
    assert (apart.max(axis=2).min(axis=1) > 2).mean() < 0.15  # cells


def test_a_target_whose_very_picture_a_tour_has_taken_needs_no_eyes(scene, world, tour):
    _, tour = tour
    blind = PerfectSight(scene)
    blind.whereabouts = lambda first, second: np.zeros((len(first), ELSEWHERE), np.float32)
    known = map_of(tour.state, PerfectSight(scene), SETTINGS)
    table = walked(world, MappingAgent(blind, known=known, settings=SETTINGS))
    assert metrics.success(table).mean() == 1 and metrics.spl(table).mean() > 0.9


def test_after_a_tour_it_walks_almost_the_shortest_paths(world, tour):
    touring, tour = tour
    assert tour.poses == 1
    table = walked(world, touring.after(tour.state))
    assert metrics.success(table).mean() == 1 and metrics.spl(table).mean() > 0.9
    assert table.collisions.mean() <= 0.05
    assert table.told_arrival is not None and table.told_arrival.mean() > 0.9


def test_without_a_tour_the_last_look_alone_tells_of_the_cell_ahead(scene, tour):
    """Where there is a tour, looks add up."""
    target, seen = {FEATURES: scene.features[9:10]}, {FEATURES: scene.features[5:6]}
    told = NEXT_AT_0 + NEXT * PerfectSight(scene).stands(scene.features[5:6])[0, PLACES_M.index((0.5, 0.0))]
    known, held = map_of(tour[1].state, PerfectSight(scene), SETTINGS), []
    for toured in (None, replace(known, room=np.clip(known.room, -3, 3))):  # whose cells were only seen
        agent = MappingAgent(PerfectSight(scene), None, toured, SETTINGS)
        _, after = agent.act(seen, agent.reset(target, np.zeros(1, np.uint64)))
        held.append(np.isclose(after["room"][0], told).any())
    assert held == [True, False]


class Misled(PerfectSight):
    """The first two looks at every fifth way between cells tell that a move along it was blocked."""

    def __init__(self, scene):
        super().__init__(scene)
        self.looks = {}

    def stands(self, features):
        return super().stands(np.rint(features))

    def description(self, features):
        return super().description(np.rint(features))

    def whereabouts(self, first, second):
        first, second = np.rint(first), np.rint(second)
        found = super().whereabouts(first, second)
        for row, (here, there) in enumerate(zip(first[:, :3], second[:, :3], strict=True)):
            way = str([here[:2].tolist(), there[:2].tolist()])
            beside = here[2] == there[2] and np.abs(here[:2] - there[:2]).sum() == 1
            if beside and zlib.crc32(way.encode()) % 5 == 0:
                self.looks[way] = self.looks.get(way, 0) + 1
                if self.looks[way] <= 2:
                    found[row] = 0
                    found[row, STAYED] = 2.0
        return found


@pytest.mark.slow
def test_a_tour_whose_pictures_never_repeat_goes_back_to_what_it_doubts(monkeypatch):
    small = seen_perfectly(grid_scene(2, width=5, depth=5, obstacle_share=0.25))
    around, takes = make_world([small], {small.name: [5, 9]}), Takes(1, {FEATURES: [small.features[:, None]]})
    poses = []
    for again_every in (1000, 40):
        monkeypatch.setattr(exploring, "AGAIN_EVERY", again_every)
        sight = Misled(small)
        touring = Touring(partial(Explorer, sight, settings=SETTINGS), lambda state: None, 240)
        tour = walk_tour(around, touring, small, seed=0, takes=takes)
        poses.append(tour.poses)
    assert poses[0] < 0.5 and poses[1] == 1
    known = map_of(tour.state, sight, SETTINGS)
    assert len(known.taken) == 240, "a picture a step, where they were found anew"
    assert len(np.unique(known.taken, axis=0)) == (small.components == 0).sum()


def explored(scene, steps, pictures=None, settings=SETTINGS):
    """An explorer's state after steps that stay where they are, of pictures that never repeat but show one pose."""
    explorer = Explorer(PerfectSight(scene), pictures or steps, settings=settings)
    state = explorer.reset({}, np.zeros(1, np.int64))
    for step in range(steps):
        shown = scene.features[:1] * (1 + 1e-3 * (step % 37))
        _, state = explorer.act({FEATURES: shown.astype(np.float32)}, state)
    state["repeats"][:] = -1
    return state


def test_poses_are_found_anew_of_walks_that_are_kept_whole_and_stay_on_the_lattice(scene, monkeypatch):
    sight = PerfectSight(scene)
    state = explored(scene, 12)
    assert len(map_of(state, sight, SETTINGS).taken) == 12
    assert len(map_of({**state, "repeats": np.zeros(1, np.int8)}, sight, SETTINGS).taken) == state["count"][0] < 12
    longer = explored(scene, 13, pictures=12)
    assert len(map_of(longer, sight, SETTINGS).taken) == longer["count"][0] < 12
    monkeypatch.setattr(tour_map, "smoothed", lambda walk, *_: np.full((12, 3), -1))
    assert len(map_of(state, sight, SETTINGS).taken) == state["count"][0]


def test_who_goes_by_a_map_stands_where_its_last_picture_was_taken(scene):
    follower = Follower(PerfectSight(scene), SETTINGS, pictures=8)
    _, after = follower.follow(scene.features[:1], follower.begin(1))
    taken = np.array([(0, 15, 15), (1, 15, 15), (1, 15, 16)])
    room, shut = np.full(after["room"][0].shape, 3.0, np.float32), np.ones(after["shut"][0].shape, bool)
    known = RoomMap(room, shut, taken, scene.features[[0, 1, 2]].astype(np.float16))
    assert follower.go_by(known, after, 0).index == likeliest(after["here"][0]).index == (1, 15, 16)
    assert (after["here"][0] == 0).sum() == 1 and after["been"][0].sum() == 3 == after["count"][0]
    assert after["shut"][0].all() and (after["room"][0] == 3).all()
    assert np.array_equal(after["taken"][0, :3], taken) and (after["mark"][0] > 0).sum() == 3


def test_a_tour_follows_from_its_seed(scene, world):
    sight = PerfectSight(scene)
    touring = Touring(lambda steps: Explorer(sight, steps, settings=SETTINGS), lambda state: None, 30)
    one, again, other = (walk_tour(world, touring, scene, seed) for seed in (0, 0, 1))
    known = [map_of(tour.state, sight, SETTINGS) for tour in (one, again, other)]
    assert np.array_equal(known[0].features, known[1].features) and np.array_equal(known[0].room, known[1].room)
    assert known[0].taken.shape != known[2].taken.shape or not np.array_equal(known[0].features, known[2].features)


@pytest.mark.parametrize("kind", ["plain", "toured", "explorer"])
def test_it_keeps_the_protocol(tmp_path, kind):
    seen = seen_by_eyes(tmp_path / "eyes", grid_scene(2))[0]
    features = seen.features.astype(np.float32)
    sight = EyesSight(small_eyes().eval())
    settings = MappingSettings(side_m=7.0)
    explorer = Explorer(sight, 4, settings=settings)
    agent = {"explorer": explorer, "plain": MappingAgent(sight, settings=settings)}.get(kind)
    if agent is None:
        state = explorer.reset({}, np.arange(1))
        for row in range(4):
            _, state = explorer.act({FEATURES: features[row : row + 1]}, state)
        agent = MappingAgent(sight, known=map_of(state, sight, settings), settings=settings)
    rng = np.random.default_rng(0)
    observations = [{FEATURES: features[rng.integers(len(features), size=3)]} for _ in range(4)]
    assert check_agent(agent, observations, {FEATURES: features[:3]}, draws=False).shape == (4, 3)
