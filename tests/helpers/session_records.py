"""Sessions as bytes, for agents of every kind."""

from __future__ import annotations

import numpy as np

from clearway.deploy.agent import DeployedAgent
from clearway.deploy.navigator import arrival_of, decision_of
from clearway.scenes.sensors import RGB
from clearway.serve.session_record import most_record_bytes, sealed, shapes_of, unsealed
from clearway.serve.sessions import Answer, Progress, begun_state, new_session
from helpers.agents import equal

KEY = bytes(range(32))
STEPS = 3


def walked(agent: DeployedAgent) -> tuple[Progress, np.ndarray]:
    """Where a few steps have led, and the next picture."""
    pictures = np.random.default_rng(0).integers(0, 256, (STEPS + 2, 1, 12, 16, 3)).astype(np.uint8)
    state = agent.reset({RGB: pictures[0]}, np.array([7]))
    for seen in pictures[1:-1]:
        decisions, state = agent.act({RGB: seen}, state)
    answer = Answer(decision_of(decisions), arrival_of(decisions), STEPS)
    return Progress(1, STEPS, state, b"seen", answer), pictures[-1]


def assert_goes_on_to_the_bit(agent: DeployedAgent) -> None:
    """Assert that an agent remembers, and decides, the same after its state was bytes."""
    progress, seen = walked(agent)
    session, shapes = new_session("robot", "sampled", None, 0.0), shapes_of(begun_state(agent))
    record = sealed(session, progress, KEY)
    assert len(record) <= most_record_bytes(shapes)
    header, found = unsealed(record, KEY, shapes)
    assert (header["id"], header["owner"], header["seed"]) == (session.id, "robot", session.seed)
    assert (found.episode, found.steps, found.seen) == (1, STEPS, b"seen")
    assert repr(found.answer) == repr(progress.answer)
    assert found.state is not None and progress.state is not None and equal(found.state, progress.state)
    (first, then), (second, after) = (agent.act({RGB: seen}, state) for state in (progress.state, found.state))
    assert first.action == second.action and equal(then, after)
