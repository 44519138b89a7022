"""Concurrent pictures go through the agent together."""

import asyncio
import threading
from contextlib import closing

import numpy as np
import pytest

from clearway.agents.agent import Decisions, State
from clearway.scenes.sensors import RGB
from clearway.serve.batching import Batcher
from clearway.serve.faults import Fault
from clearway.serve.limits import Limits
from clearway.serve.service import Service
from clearway.serve.sessions import Answer
from clearway.serve.tokens import Tokens
from helpers.agents import equal
from helpers.serving import OWNER, TOKENS, grey
from helpers.sums import Sums, plain

BEGUN = Sums().reset({RGB: plain(1)[None]}, np.zeros(1, np.int64))
"""What `Sums` remembers when it begins to walk to a picture of level 1."""
PATIENT_S = 10  # for what must happen, on a busy machine


def ignore(pictures: int, seconds: float) -> None:
    pass


def value(step: tuple[Decisions, State]) -> float:
    return float(step[0].value[0])


def test_everyone_gets_the_own_row_and_waits_for_no_fuller_batch() -> None:
    agent, watched = Sums(0.05), []
    _, walking = Sums().act({RGB: plain(0)[None]}, BEGUN)

    async def ask() -> list[float]:
        batcher = Batcher(agent, Limits(batch=8), lambda *told: watched.append(told))
        steps = await asyncio.gather(*(batcher.act(OWNER, plain(level), walking) for level in range(20)))
        again = await asyncio.gather(*(batcher.act(OWNER, plain(0), after) for _, after in steps))
        assert [value(step) for step in again] == [1000.0 + level for level in range(20)]  # each by its own memory
        return [value(step) for step in steps]

    assert asyncio.run(ask()) == [1000.0 + level for level in range(20)]
    assert sum(agent.batches) == 40 and max(agent.batches) == 8 and len(agent.batches) <= 8
    assert [pictures for pictures, _ in watched] == agent.batches
    assert all(seconds >= 0.05 for _, seconds in watched)


def test_pictures_of_different_sizes_share_no_batch_and_none_is_passed_over() -> None:
    agent = Sums(0.01)

    async def ask() -> list[float]:
        batcher = Batcher(agent, Limits(), ignore)
        sizes = [(3, 4), (5, 6), (3, 4), (5, 6), (7, 7)]
        steps = [batcher.act(OWNER, plain(level, size), BEGUN) for level, size in enumerate(sizes)]
        return [value(step) for step in await asyncio.gather(*steps)]

    assert asyncio.run(ask()) == [1000.0 + 4 * level for level in range(5)]
    assert sorted(agent.batches) == [1, 2, 2]


def test_begins_and_steps_share_no_batch_and_each_begin_has_its_own_seed_and_target() -> None:
    agent = Sums(0.01)

    async def ask() -> tuple[list[State], float]:
        batcher = Batcher(agent, Limits(), ignore)
        begins = [batcher.reset(OWNER, plain(level), np.array([seed])) for level, seed in ((1, 5), (2, 6), (2, 5))]
        *states, step = await asyncio.gather(*begins, batcher.act(OWNER, plain(3), BEGUN))
        return states, value(step)

    states, stepped = asyncio.run(ask())
    assert stepped == 1012.0 and sorted(agent.batches) == [1, 3]
    for state, (level, seed) in zip(states, ((1, 5), (2, 6), (2, 5)), strict=True):
        alone = Sums().reset({RGB: plain(level)[None]}, np.array([seed]))
        assert equal(alone, state)


def test_an_answer_does_not_keep_its_batch() -> None:
    """A session's state is as large as one episode's, whoever was asked beside it."""

    async def ask() -> list[tuple[Decisions, State]]:
        batcher = Batcher(Sums(), Limits(), ignore)
        return await asyncio.gather(*(batcher.act(OWNER, plain(level), BEGUN) for level in range(3)))

    for decisions, state in asyncio.run(ask()):
        for array in (*state.values(), decisions.action, decisions.probabilities, decisions.value):
            assert array.base is None or array.base.nbytes == array.nbytes


def test_steps_sent_at_once_in_one_session_are_answered_one_after_the_other() -> None:
    """The second rests on the history that the first left."""

    async def run() -> list[Answer]:
        service = Service(Sums(seconds=0.05), Limits(), TOKENS)
        session = await service.sessions.open(OWNER, "argmax", None)
        with closing(service.decoders):
            await service.set_target(session, grey(0))
            return await asyncio.gather(*(service.step(session, grey(level)) for level in (1, 2)))

    assert [(answer.step, answer.decision.value) for answer in asyncio.run(run())] == [(1, 4.0), (2, 5.0)]


def test_a_step_sent_while_the_target_is_computed_waits_for_it() -> None:
    async def run() -> tuple[None, Answer]:
        service = Service(Sums(seconds=0.05), Limits(), TOKENS)
        session = await service.sessions.open(OWNER, "argmax", None)
        with closing(service.decoders):
            return await asyncio.gather(service.set_target(session, grey(2)), service.step(session, grey(1)))

    _, answer = asyncio.run(run())
    assert (answer.step, answer.decision.value) == (1, 2004.0)


def test_a_picture_whose_asker_has_gone_is_not_computed() -> None:
    agent = Sums(0.05)

    async def ask() -> None:
        batcher = Batcher(agent, Limits(batch=1), ignore)
        first, *others = [asyncio.create_task(batcher.act(OWNER, plain(1), BEGUN)) for _ in range(5)]
        await asyncio.sleep(0.01)
        for other in others[:3]:
            other.cancel()
        await first
        await others[3]

    asyncio.run(ask())
    assert agent.batches == [1, 1]


@pytest.mark.parametrize("fails", [False, True], ids=["answers", "an agent that fails"])
def test_an_asker_who_goes_while_the_batch_is_computed_leaves_the_others_theirs(fails) -> None:
    gone = threading.Event()

    class Waits(Sums):
        def act(self, observation, state):
            result = super().act(observation, state)
            assert gone.wait(PATIENT_S)
            if fails:
                raise ZeroDivisionError
            return result

    agent = Waits()

    async def ask() -> list[object]:
        batcher = Batcher(agent, Limits(), ignore)
        first, *others = [asyncio.create_task(batcher.act(OWNER, plain(level), BEGUN)) for level in range(3)]
        while not agent.batches:
            await asyncio.sleep(0.001)
        first.cancel()
        gone.set()
        async with asyncio.timeout(PATIENT_S):
            return await asyncio.gather(*others, return_exceptions=True)

    found = asyncio.run(ask())
    assert agent.batches == [3]
    if fails:
        assert [type(each) for each in found] == [ZeroDivisionError] * 2
    else:
        assert [value(step) for step in found] == [1004.0, 1008.0]


def test_too_many_that_wait_are_refused_at_once() -> None:
    async def ask() -> list[object]:
        batcher = Batcher(Sums(0.05), Limits(waiting=3, batch=2), ignore)
        return await asyncio.gather(*(batcher.act(OWNER, plain(1), BEGUN) for _ in range(5)), return_exceptions=True)

    found = asyncio.run(ask())
    refused = [step for step in found if isinstance(step, Fault)]
    assert [fault.code for fault in refused] == ["overloaded", "overloaded"]


def test_who_has_given_up_takes_no_place_among_those_that_wait() -> None:
    going_on = threading.Event()

    class Waits(Sums):
        def act(self, observation, state):
            result = super().act(observation, state)
            assert going_on.wait(PATIENT_S)
            return result

    async def ask() -> None:
        batcher = Batcher(agent := Waits(), Limits(waiting=3, batch=1), ignore)
        first = asyncio.create_task(batcher.act(OWNER, plain(1), BEGUN))
        while not agent.batches:
            await asyncio.sleep(0.001)
        others = [asyncio.create_task(batcher.act(OWNER, plain(1), BEGUN)) for _ in range(3)]
        await asyncio.sleep(0)
        assert batcher.waiting == 3
        for other in others:
            other.cancel()
        await asyncio.sleep(0)
        assert batcher.waiting == len(batcher._waiting) == 0
        last = asyncio.create_task(batcher.act(OWNER, plain(1), BEGUN))
        await asyncio.sleep(0)
        going_on.set()
        await asyncio.gather(first, last)

    asyncio.run(ask())


def test_a_refused_target_costs_a_session_none_of_its_draws() -> None:
    """Sent again, it begins the episode that it would have begun."""

    free = threading.Event()

    class Waits(Sums):
        def act(self, observation, state):
            assert free.wait(PATIENT_S)
            return super().act(observation, state)

    async def begin(refused: bool) -> State | None:
        service = Service(Waits(), Limits(waiting=1, batch=1), TOKENS)
        with closing(service.decoders):
            return await begun(service, refused)

    async def begun(service: Service, refused: bool) -> State | None:
        session = await service.sessions.open(OWNER, "sampled", 7)
        if refused:
            computed = asyncio.create_task(service.batcher.act(OWNER, plain(1), BEGUN))
            while not service.batcher.waiting:
                await asyncio.sleep(0)
            while service.batcher.waiting:
                await asyncio.sleep(0)
            waits = asyncio.create_task(service.batcher.act(OWNER, plain(1), BEGUN))
            await asyncio.sleep(0)
            with pytest.raises(Fault, match="too many pictures"):
                await service.set_target(session, grey(2))
            free.set()
            await asyncio.gather(computed, waits)
        await service.set_target(session, grey(2))
        return session.progress.state

    refused, plainly = asyncio.run(begin(True)), asyncio.run(begin(False))
    assert refused is not None and plainly is not None and equal(refused, plainly)


def test_an_agent_that_fails_fails_its_batch_alone() -> None:
    class Moody(Sums):
        def act(self, observation, state):
            if observation[RGB].max() == 13:
                raise ZeroDivisionError
            return super().act(observation, state)

    async def ask() -> list[object]:
        batcher = Batcher(Moody(), Limits(batch=1), ignore)
        return await asyncio.gather(
            *(batcher.act(OWNER, plain(level), BEGUN) for level in (12, 13, 14)), return_exceptions=True
        )

    found = asyncio.run(ask())
    assert isinstance(found[1], ZeroDivisionError)
    assert [value(found[index]) for index in (0, 2)] == [1048.0, 1056.0]
    with pytest.raises(ZeroDivisionError):
        raise found[1]


def test_the_pictures_of_one_owner_do_not_keep_another_s_waiting() -> None:
    """A crowd of the first's is there before; the second's single picture goes with the next batch."""
    agent, done = Sums(0.01), []

    async def ask() -> None:
        batcher = Batcher(agent, Limits(batch=2), ignore)

        async def asked(owner: str) -> None:
            await batcher.act(owner, plain(1), BEGUN)
            done.append(owner)

        crowd = [asyncio.create_task(asked("crowd")) for _ in range(12)]
        await asyncio.sleep(0.015)
        await asked("guest")
        await asyncio.gather(*crowd)

    asyncio.run(ask())
    assert done.index("guest") <= 6 and len(done) == 13


def test_an_owner_of_several_holds_a_part_of_the_places_and_of_the_sessions() -> None:
    tokens = Tokens([("crowd", 20 * "c"), ("guest", 20 * "g")])
    service = Service(Sums(0.05), Limits(waiting=4, sessions=6, batch=1), tokens)

    async def ask() -> list[object]:
        with closing(service.decoders):
            sessions = [await service.open(owner, "argmax", None) for owner in ("crowd", "crowd", "crowd", "guest")]
            with pytest.raises(Fault, match="3 sessions of this token"):
                await service.open("crowd", "argmax", None)
            begins = [service.set_target(session, grey(1)) for session in sessions]
            return await asyncio.gather(*begins, return_exceptions=True)

    first, second, refused, guest = asyncio.run(ask())
    assert first is second is guest is None
    assert isinstance(refused, Fault) and refused.code == "overloaded"
    assert service.waiting == 0
