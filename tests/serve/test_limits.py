"""Limits divided among replicas: together they allow no more than is said, and each name can send a largest body."""

from __future__ import annotations

import pytest

from clearway.serve.limits import MOST_REPLICAS, Limits
from clearway.serve.messages import MESSAGE_BYTES
from clearway.serve.shares import Places

REPLICAS = range(1, MOST_REPLICAS + 1)


@pytest.mark.parametrize("name", ["waiting", "connections", "strangers", "wrong_tokens"])
def test_parts_are_together_the_whole_at_most(name: str) -> None:
    whole = Limits()
    for count in REPLICAS:
        assert 0 < count * getattr(whole.divided(count), name) <= getattr(whole, name)


def test_each_of_many_names_can_send_a_largest_body_to_any_replica() -> None:
    whole, names = Limits(), ("a", "b", "c", "d")
    for count in REPLICAS:
        part = whole.divided(count)
        bodies = Places(part.bodies_bytes, lambda: names)
        for name in names:
            assert bodies.take(name, part.body_bytes + MESSAGE_BYTES)
        assert part.bodies_bytes == max(whole.bodies_bytes // count, 20 << 20)


def test_bytes_of_bodies_are_never_more_than_the_whole_service_has() -> None:
    assert Limits(bodies_bytes=1000).divided(2).bodies_bytes == 1000


@pytest.mark.parametrize(("cores", "replicas", "each"), [(2, 1, 2), (2, 2, 1), (2, 4, 1), (16, 4, 4)])
def test_decoders_are_divided_one_for_each_at_least(cores: int, replicas: int, each: int) -> None:
    assert Limits(decoders=cores).divided(replicas).decoders == each
