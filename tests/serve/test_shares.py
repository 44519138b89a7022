"""Who has used the least comes next."""

import asyncio

import pytest

from clearway.serve.shares import HALF_LIFE_S, FairTurns, Places, Shares


def test_what_was_used_counts_half_after_a_while() -> None:
    now = [0.0]
    shares = Shares(lambda: now[0])
    shares.add("me", 4.0)
    now[0] = 2 * HALF_LIFE_S
    assert shares.used("me") == pytest.approx(1.0) and shares.used("you") == 0.0
    shares.add("me", 1.0)
    assert shares.used("me") == pytest.approx(2.0)


def test_turns_go_to_who_has_used_least_and_are_not_lost_to_who_gave_up() -> None:
    shares, order = Shares(), []
    shares.add("greedy", 5.0)

    async def ask() -> None:
        turns = FairTurns(1, shares)

        async def one(owner: str) -> None:
            async with turns.turn(owner):
                order.append(owner)
                await asyncio.sleep(0.001)

        first = asyncio.create_task(one("first"))
        await asyncio.sleep(0)
        greedy = [asyncio.create_task(one("greedy")) for _ in range(3)]
        modest = asyncio.create_task(one("modest"))
        await asyncio.sleep(0)
        greedy[0].cancel()
        await asyncio.gather(first, modest, *greedy[1:])
        async with asyncio.timeout(5):
            await one("last")

    asyncio.run(ask())
    assert order == ["first", "modest", "greedy", "greedy", "last"]


def test_whoever_is_alone_may_have_every_place() -> None:
    places = Places(7, lambda: {"me"})
    assert all(places.take("me") for _ in range(7)) and not places.take("me")
    places.free("me", 7)
    assert places.taken == 0 and places.take("me", 7)


@pytest.mark.parametrize("count", [2, 3, 5, 9, 60, 100])
def test_however_many_are_greedy_everybody_else_finds_a_part(count) -> None:
    """Four of five names once took all there was."""
    names = [f"name-{number}" for number in range(count)]
    places = Places(100, lambda: names)
    for greedy in names[:-1]:
        while places.take(greedy):
            pass
    kept = max(50 // count, 1)
    assert max(map(places.held, names)) <= 100 // min(count, 4)
    assert places.taken == 100 - kept or count <= 4  # the greedy have taken what is not kept
    assert all(places.take(names[-1]) for _ in range(kept))


def test_places_follow_the_names_and_are_kept_for_no_others() -> None:
    names = {"first", "second"}
    places = Places(8, lambda: names)
    assert places.take("first", 4) and not places.take("first") and not places.take("stranger", 3)
    assert places.take("stranger", 2) and not places.take("stranger") and places.take("second", 2)
    assert places.taken == 8 and not places.take("second")
    names = {"second"}
    places.free("first", 4)
    assert places.take("second", 4)


def test_who_has_used_little_need_not_wait_for_those_who_have_used_much() -> None:
    """Two attackers once kept every turn, each as long as it could."""
    shares, order = Shares(), []
    shares.add("modest", 0.1)
    for greedy in ("first", "second"):
        shares.add(greedy, 5.0)

    async def ask() -> None:
        turns, over = FairTurns(3, shares), asyncio.Event()

        async def one(owner: str) -> None:
            async with turns.turn(owner):
                order.append(owner)
                await over.wait()

        greedy = [asyncio.create_task(one(owner)) for owner in ("first", "second", "first", "second")]
        await asyncio.sleep(0)
        modest = asyncio.create_task(one("modest"))
        for _ in range(3):
            await asyncio.sleep(0)
        assert order == ["first", "second", "modest"]
        over.set()
        await asyncio.gather(*greedy, modest)

    asyncio.run(ask())
    assert len(order) == 5
