"""The service on Ray Serve: replicas are killed under load, sessions go on. Needs the extra `ray-serve`."""

from __future__ import annotations

import os
import random
import signal
import threading
import time
from functools import partial
from pathlib import Path

import httpx
import pytest

from clearway.serve.client import Client
from clearway.serve.limits import Limits
from helpers.holders import holders
from helpers.on_ray import MARKS, cluster_here
from helpers.running import PATIENT_S
from helpers.serving import TOKEN, TOKENS
from helpers.sums import Sums
from helpers.walking import until, walk

pytest.importorskip("grpc_reflection", reason="Ray Serve is not installed: pip install 'clearway[ray-serve]'")
pytestmark = MARKS
SESSIONS, KILLS = 6, 4


def test_replicas_die_under_load_and_no_session_is_lost_nor_a_step_walked_twice(tmp_path: Path, monkeypatch) -> None:
    from ray import serve

    from clearway.serve.on_ray import application_of
    from clearway.web.local import listening, port_of

    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path))
    with listening(0) as free:
        port = port_of(free)
    url = f"http://127.0.0.1:{port}"
    connected = partial(Client, url, TOKEN, PATIENT_S)
    with cluster_here(4):
        serve.start(http_options={"port": port})
        serve.run(application_of(partial(Sums, 0.002), TOKENS, Limits(), 2))
        (folder,) = tmp_path.glob("ray-serve/*")
        told: list[object] = []
        opened, ends, dice = threading.Barrier(SESSIONS + 1), threading.Event(), random.Random(5)
        walkers = [
            threading.Thread(target=walk, args=(connected, number, opened, ends, told)) for number in range(SESSIONS)
        ]
        for walker in walkers:
            walker.start()
        opened.wait(PATIENT_S)
        for _ in range(KILLS):
            until(lambda: len(holders(folder)) == 2)
            time.sleep(1 + dice.random())
            os.kill(dice.choice(holders(folder)), signal.SIGKILL)
        ends.set()
        for walker in walkers:
            walker.join()
        print(told)
        assert len(told) == SESSIONS and all(isinstance(steps, int) for steps in told), told
        assert httpx.get(f"{url}/agent", timeout=PATIENT_S).status_code == 401
        serve.shutdown()
