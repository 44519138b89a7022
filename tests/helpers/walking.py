"""Sessions that walk while a service's replicas die."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import numpy as np

import clearway
from clearway.serve.client import Client
from helpers.running import PATIENT_S
from helpers.sums import Sums, plain

LEAST_STEPS = 8


def walk(
    connected: Callable[[], Client],
    number: int,
    opened: threading.Barrier,
    ends: threading.Event,
    told: list[object],
) -> None:
    """Episodes of one session, each answer held against a navigator's own; adds how many steps, or what went wrong."""
    try:
        navigator, rng, steps = clearway.Navigator(Sums(), seed=number), np.random.default_rng(number), 0
        with connected() as client, client.session(seed=number) as session:
            opened.wait(PATIENT_S)
            while steps < LEAST_STEPS or not ends.is_set():
                if steps % 7 == 0:
                    for walker in (session, navigator):
                        walker.set_target(plain(number))
                level = int(rng.integers(256))
                expected, found = navigator.act(plain(level)), session.act(plain(level))
                assert found[::2] == expected[::2]
                steps += 1
        told.append(steps)
    except BaseException as fault:
        told.append(fault)


def until(holds: Callable[[], object], seconds: float = PATIENT_S) -> None:
    deadline = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.05)
