"""Sessions open, expire and are counted."""

import asyncio

import pytest

from clearway.errors import DeployError
from clearway.serve.faults import Fault
from clearway.serve.limits import Limits
from clearway.serve.sessions import Sessions
from clearway.serve.shares import Places
from helpers.serving import OWNER


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


def places(most: int) -> Places:
    return Places(most, lambda: {OWNER})


def test_a_session_expires_once_nobody_has_used_it_for_long_enough() -> None:
    clock = Clock()
    sessions = Sessions(Limits(idle_s=60), places(1000), clock)
    first, second = asyncio.run(sessions.open(OWNER, "argmax", None)), asyncio.run(sessions.open(OWNER, "sampled", 3))
    clock.now += 59
    assert asyncio.run(sessions.get(first.id, OWNER)) is first  # its time begins anew
    clock.now += 1
    assert len(sessions) == 1
    with pytest.raises(Fault, match="expired") as caught:
        asyncio.run(sessions.get(second.id, OWNER))
    assert (caught.value.code, caught.value.status) == ("no_such_session", 404)
    clock.now += 58
    assert asyncio.run(sessions.get(first.id, OWNER)) is first
    clock.now += 60
    assert len(sessions) == 0


def test_no_more_sessions_than_allowed_and_room_again_when_one_goes() -> None:
    clock = Clock()
    sessions = Sessions(Limits(idle_s=60), places(2), clock)
    first = asyncio.run(sessions.open(OWNER, "sampled", None))
    clock.now += 30
    asyncio.run(sessions.open(OWNER, "sampled", None))
    with pytest.raises(Fault, match="2 sessions are open") as caught:
        asyncio.run(sessions.open(OWNER, "sampled", None))
    assert (caught.value.code, caught.value.status) == ("too_many_sessions", 429)
    asyncio.run(sessions.close(first.id, OWNER))
    asyncio.run(sessions.open(OWNER, "sampled", None))
    assert sessions.full
    clock.now += 60
    assert not sessions.full
    with pytest.raises(Fault):
        asyncio.run(sessions.close(first.id, OWNER))


def test_names_of_sessions_cannot_be_guessed() -> None:
    sessions = Sessions(Limits(), places(1000))
    own = asyncio.run(sessions.open(OWNER, "sampled", None))
    for ask in (sessions.get, sessions.close):
        with pytest.raises(Fault, match="no such session"):
            asyncio.run(ask(own.id, "another"))
    assert asyncio.run(sessions.get(own.id, OWNER)) is own
    names = {asyncio.run(sessions.open(OWNER, "sampled", None)).id for _ in range(200)}
    assert len(names) == 200
    assert {len(name) for name in names} == {22}  # 128 bits


@pytest.mark.parametrize(
    ("settings", "part"),
    [
        ({"sessions": 0}, "sessions is 0"),
        ({"deadline_s": -1.0}, "deadline_s is -1.0"),
        ({"idle_s": float("nan")}, "idle_s is nan"),
        ({"idle_s": float("inf")}, "idle_s is inf, expected a finite number"),
        ({"idle_s": 20.0, "deadline_s": 10.0}, "sessions expire after 20 s and requests may take 10 s"),
    ],
)
def test_limits_that_cannot_be(settings, part) -> None:
    with pytest.raises(DeployError, match=part):
        Limits(**settings)
