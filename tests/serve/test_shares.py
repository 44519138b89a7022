"""Who has used the least comes next."""

import asyncio

import pytest

from clearway.serve.shares import HALF_LIFE_S, FairTurns, Shares


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
