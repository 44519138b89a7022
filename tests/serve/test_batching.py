"""Concurrent pictures go through the model together."""

import asyncio
import threading

import numpy as np
import pytest

from clearway.serve.batching import Batcher
from clearway.serve.faults import Fault
from clearway.serve.limits import Limits
from clearway.serve.service import Answer, Service
from helpers.serving import grey
from helpers.sums import Sums, plain

TARGET = np.array([1.0, 1.0], np.float32)
PATIENT_S = 10  # for what must happen, on a busy machine


def ignore(pictures: int, seconds: float) -> None:
    pass


def test_everyone_gets_the_own_row_and_waits_for_no_fuller_batch() -> None:
    model, watched = Sums(0.05), []

    async def ask() -> list[float]:
        batcher = Batcher(model, Limits(batch=8), lambda *told: watched.append(told))
        history = np.zeros((4, 2), np.float32)
        steps = await asyncio.gather(*(batcher.step(plain(level), history, TARGET) for level in range(20)))
        return [float(step.value[0]) for step in steps]

    assert asyncio.run(ask()) == [1000.0 + level for level in range(20)]
    assert sum(model.batches) == 20 and max(model.batches) == 8 and len(model.batches) <= 4
    assert [pictures for pictures, _ in watched] == model.batches
    assert all(seconds >= 0.05 for _, seconds in watched)


def test_pictures_of_different_sizes_share_no_batch_and_none_is_passed_over() -> None:
    model = Sums(0.01)

    async def ask() -> list[float]:
        batcher = Batcher(model, Limits(), ignore)
        sizes = [(3, 4), (5, 6), (3, 4), (5, 6), (7, 7)]
        steps = [batcher.step(plain(level, size), None, TARGET) for level, size in enumerate(sizes)]
        return [float(step.value[0]) for step in await asyncio.gather(*steps)]

    assert asyncio.run(ask()) == [1000.0 + 4 * level for level in range(5)]
    assert sorted(model.batches) == [1, 2, 2]


def test_steps_sent_at_once_in_one_session_are_answered_one_after_the_other() -> None:
    """The second rests on the history that the first left."""

    async def run() -> list[Answer]:
        service = Service(Sums(seconds=0.05), Limits())
        session = service.sessions.open("argmax", None)
        await service.set_target(session, grey(0))
        return await asyncio.gather(*(service.step(session, grey(level)) for level in (1, 2)))

    assert [(answer.step, answer.decision.value) for answer in asyncio.run(run())] == [(1, 4.0), (2, 5.0)]


def test_a_step_sent_while_the_target_is_computed_waits_for_it() -> None:
    async def run() -> tuple[None, Answer]:
        service = Service(Sums(seconds=0.05), Limits())
        session = service.sessions.open("argmax", None)
        return await asyncio.gather(service.set_target(session, grey(2)), service.step(session, grey(1)))

    _, answer = asyncio.run(run())
    assert (answer.step, answer.decision.value) == (1, 2004.0)


def test_a_picture_whose_asker_has_gone_is_not_computed() -> None:
    model = Sums(0.05)

    async def ask() -> None:
        batcher = Batcher(model, Limits(batch=1), ignore)
        first, *others = [asyncio.create_task(batcher.step(plain(1), None, TARGET)) for _ in range(5)]
        await asyncio.sleep(0.01)
        for other in others[:3]:
            other.cancel()
        await first
        await others[3]

    asyncio.run(ask())
    assert model.batches == [1, 1]


@pytest.mark.parametrize("fails", [False, True], ids=["answers", "a model that fails"])
def test_an_asker_who_goes_while_the_batch_is_computed_leaves_the_others_theirs(fails) -> None:
    gone = threading.Event()

    class Waits(Sums):
        def step(self, seen, start, history, target):
            result = super().step(seen, start, history, target)
            assert gone.wait(PATIENT_S)
            if fails:
                raise ZeroDivisionError
            return result

    model = Waits()

    async def ask() -> list[object]:
        batcher = Batcher(model, Limits(), ignore)
        first, *others = [asyncio.create_task(batcher.step(plain(level), None, TARGET)) for level in range(3)]
        while not model.batches:
            await asyncio.sleep(0.001)
        first.cancel()
        gone.set()
        async with asyncio.timeout(PATIENT_S):
            return await asyncio.gather(*others, return_exceptions=True)

    found = asyncio.run(ask())
    assert model.batches == [3]
    if fails:
        assert [type(each) for each in found] == [ZeroDivisionError] * 2
    else:
        assert [float(step.value[0]) for step in found] == [1004.0, 1008.0]


def test_too_many_that_wait_are_refused_at_once() -> None:
    async def ask() -> list[object]:
        batcher = Batcher(Sums(0.05), Limits(waiting=3, batch=2), ignore)
        return await asyncio.gather(*(batcher.step(plain(1), None, TARGET) for _ in range(5)), return_exceptions=True)

    found = asyncio.run(ask())
    refused = [step for step in found if isinstance(step, Fault)]
    assert [fault.code for fault in refused] == ["overloaded", "overloaded"]


def test_a_model_that_fails_fails_its_batch_alone() -> None:
    class Moody(Sums):
        def step(self, seen, start, history, target):
            if seen.max() == 13:
                raise ZeroDivisionError
            return super().step(seen, start, history, target)

    async def ask() -> list[object]:
        batcher = Batcher(Moody(), Limits(batch=1), ignore)
        return await asyncio.gather(
            *(batcher.step(plain(level), None, TARGET) for level in (12, 13, 14)), return_exceptions=True
        )

    found = asyncio.run(ask())
    assert isinstance(found[1], ZeroDivisionError)
    assert [float(found[index].value[0]) for index in (0, 2)] == [1048.0, 1056.0]
    with pytest.raises(ZeroDivisionError):
        raise found[1]
