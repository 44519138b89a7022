import json

import numpy as np
import pytest
import torch

from clearway.view.stage import Stage, scene_stage
from clearway.view.viewing import Viewing

CORRIDOR = "scene=corridor&start=0&target=8"


def begun(stage: Stage, query: str = CORRIDOR) -> tuple[Viewing, dict]:
    session = Viewing(stage)
    answer = session.answer({"do": "begin", "episode": query})
    assert answer["kind"] == "episode", answer
    json.dumps(answer, allow_nan=False)
    return session, answer


def walk(session: Viewing, steps: int) -> dict:
    for _ in range(steps):
        answer = session.answer({"do": "step"})
        assert answer["kind"] == "steps"
    return answer


def test_two_agents_begin_side_by_side(stage: Stage) -> None:
    _, answer = begun(stage)
    assert (answer["scene"], answer["start"], answer["target"], answer["drive"]) == (0, 0, 8, False)
    assert [(w["name"], w["agent"], w["reward"]) for w in answer["walkers"]] == [
        ("aware", True, "collision-aware"),
        ("plain", True, "shortest"),
    ]
    for walker in answer["walkers"]:
        (first,) = walker["steps"]
        assert (first["state"], first["to_go"], first["collisions"], first["action"]) == (0, 2, 0, None)
        assert sum(first["probabilities"]) == pytest.approx(1, abs=1e-5)
    assert answer["link"] == "scene=corridor&start=0&target=8&selection=sampled&seed=0&walk=&walk="


def test_what_is_left_open_is_chosen_and_repeats_with_the_seed(stage: Stage) -> None:
    session, answer = begun(stage, "scene=grid")
    assert answer["target"] == 5  # the first one trained on
    steps = session.stage.scenes[1].distances[:, 5]
    starts = {begun(stage, f"scene=grid&seed={seed}")[1]["start"] for seed in range(12)}
    assert len(starts) > 3
    assert all(steps[start] > 0 for start in starts)
    assert begun(stage, "scene=grid&seed=7")[1]["start"] == begun(stage, "scene=grid&seed=7")[1]["start"]
    assert begun(stage, "")[1]["scene"] == 0


def test_steps_follow_the_scene_s_graph_and_the_link_tells_them(stage: Stage) -> None:
    session, before = begun(stage, "scene=grid&start=0&target=22&seed=5")
    graph = stage.scenes[1].graph
    here = [walker["steps"][0] for walker in before["walkers"]]
    for _ in range(6):
        after = walk(session, 1)["steps"]
        for last, step in zip(here, after, strict=True):
            assert step["action"] == last["next"]
            arrived = graph[last["state"], step["action"]]
            assert step["blocked"] == (arrived < 0)
            assert step["state"] == (last["state"] if arrived < 0 else arrived)
        here = after
    walks = [part.removeprefix("walk=") for part in session.walked().query().split("&") if part.startswith("walk=")]
    assert [len(letters) for letters in walks] == [6, 6]
    assert walks[0] == "".join("FRLB"[step.action] for step in session.walkers[0].steps[1:])


def test_a_link_replays_the_episode(stage: Stage) -> None:
    session, _ = begun(stage, "scene=grid&start=0&target=22&seed=5&drive=1")
    session.answer({"do": "drive", "action": 1, "along": True})
    walk(session, 4)
    session.answer({"do": "drive", "action": 0, "along": False})
    replayed, answer = begun(stage, session.walked().query())
    assert answer["recorded"] == 5
    walk(replayed, 5)
    assert [w.steps for w in replayed.walkers] == [w.steps for w in session.walkers]
    assert replayed.walked() == session.walked()


def test_the_user_races_alone_or_along(stage: Stage) -> None:
    session, answer = begun(stage, CORRIDOR + "&drive=1")
    assert [w["name"] for w in answer["walkers"]] == ["aware", "plain", "you"]
    alone = session.answer({"do": "drive", "action": 0, "along": False})["steps"]
    assert alone[:2] == [None, None] and alone[2]["state"] == 4
    agents = walk(session, 1)["steps"]
    assert agents[0] and agents[1] and agents[2] is None
    along = session.answer({"do": "drive", "action": 0, "along": True})
    assert all(along["steps"][:2]) or along["ended"][0] or along["ended"][1]
    assert along["steps"][2]["reached"] and along["ended"][2]


def test_a_scene_alone_is_for_the_user(stage: Stage) -> None:
    session, answer = begun(scene_stage(stage.scenes[2]), "start=0&target=2")
    assert answer["drive"] and [w["name"] for w in answer["walkers"]] == ["you"]
    steps = [session.answer({"do": "drive", "action": 1, "along": True})["steps"][0] for _ in range(2)]
    assert [step["state"] for step in steps] == [1, 2]  # two of twelve headings
    assert steps[1]["reached"]
    assert session.answer({"do": "map", "walker": 0})["kind"] == "refused"


def test_the_map_is_what_the_plain_network_says(stage: Stage) -> None:
    session, _ = begun(stage, "scene=bare&start=0&target=30")
    answer = session.answer({"do": "map", "walker": 1})
    assert (answer["kind"], answer["walker"]) == ("map", 1)
    agent, scene = stage.agents[1].trained, stage.agents[1].scenes[2]
    assert scene.features is not None
    features = agent.feature_map(torch.from_numpy(scene.features))
    history = features[:, None].expand(-1, 4, -1)
    with torch.no_grad():
        scores, values = agent.network(history, features[30].expand(len(features), -1), torch.full((60,), 2))
    scale = agent.record.learner.reward_scale
    np.testing.assert_allclose(answer["values"], values.numpy() / scale, atol=2e-4)
    np.testing.assert_allclose(answer["probabilities"], torch.softmax(scores, 1).numpy(), atol=2e-4)


@pytest.mark.parametrize(
    ("query", "said"),
    [
        ("scene=attic", "attic"),
        ("scene=corridor&target=99", "99"),
        ("scene=corridor&start=20", "start 20: corridor has states 0 to 19"),
        ("walk=X", "walk=X"),
    ],
)
def test_a_refused_episode_leaves_the_old_one(stage: Stage, query: str, said: str) -> None:
    session, _ = begun(stage)
    walk(session, 1)
    before = session.walked()
    answer = session.answer({"do": "begin", "episode": query})
    assert answer["kind"] == "refused" and said in answer["text"]
    assert session.walked() == before
    walk(session, 1)


@pytest.mark.parametrize(
    "message",
    [
        None,
        [],
        {},
        {"do": "dance"},
        {"do": "begin"},
        {"do": "begin", "episode": 3},
        {"do": "drive", "action": 4, "along": True},
        {"do": "drive", "action": -1, "along": True},
        {"do": "drive", "action": 0},
        {"do": "drive", "action": 0, "along": True},  # nobody drives here
        {"do": "map", "walker": 2},
        {"do": "map", "walker": -1},
        {"do": "map", "walker": "0"},
    ],
)
def test_an_unknown_message_is_refused_and_changes_nothing(stage: Stage, message: object) -> None:
    session, _ = begun(stage)
    assert session.answer(message)["kind"] == "refused"
    assert [len(walker.steps) for walker in session.walkers] == [1, 1]


@pytest.mark.parametrize(
    "message", [{"do": "step"}, {"do": "map", "walker": 0}, {"do": "drive", "action": 0, "along": True}]
)
def test_nothing_happens_before_an_episode_has_begun(stage: Stage, message: object) -> None:
    assert Viewing(stage).answer(message)["kind"] == "refused"
