"""The service as a process of its own."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from clearway.serve.client import Client
from helpers.serving import ENVIRONMENT, TOKEN

PATIENT_S = 60  # for what must happen, on a busy machine
PROGRAM = """
import json, sys
from pathlib import Path
from clearway.serve.hangup import rotating
from clearway.serve.limits import Limits
from functools import partial
from clearway.serve.access_log import to_stderr
from clearway.serve.replicas import run_replicas
from clearway.serve.run import Network, run_service
from clearway.serve.tokens import read_tokens
from clearway.web.local import listening, port_of
from helpers.serving import TOKENS
from helpers.sums import Sums

asked = json.loads(sys.argv[1])
listener, health = listening(0), listening(0) if asked.pop("health", False) else None
print(port_of(listener), port_of(health) if health else 0, flush=True)
certificate, key = asked.pop("tls", (None, None))
proxy, log = asked.pop("proxy", None), asked.pop("log", None) and to_stderr
network = Network(listener, health, certificate and Path(certificate), key and Path(key), proxy, log)
path = asked.pop("tokens", None)
tokens = read_tokens(Path(path)) if path else TOKENS
replicas, agent = asked.pop("replicas", 1), partial(Sums, asked.pop("seconds", 0))
if replicas > 1:
    run_replicas(agent, network, tokens, path and Path(path), Limits(**asked), replicas)
else:
    with rotating(tokens, path and Path(path)):
        run_service(agent(), network, tokens, Limits(**asked))
print("ended", flush=True)
"""


class Running:
    """A service in a process."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        assert process.stdout is not None
        self.process = process
        self.port, self.health_port = map(int, process.stdout.readline().split())
        self.url = f"http://127.0.0.1:{self.port}"

    def connected(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.port), timeout=PATIENT_S)

    def replicas(self) -> list[int]:
        """Process ids of the replicas that run now, by what they are called with."""
        words = ["ps", "-A", "-ww", "-o", "pid=", "-o", "ppid=", "-o", "args="]
        told = subprocess.run(words, capture_output=True, text=True, check=True).stdout
        rows = [line.split(None, 2) for line in told.splitlines()]
        return [int(own) for own, parent, *said in rows if int(parent) == self.process.pid and "spawn_main" in said[0]]

    def client(self) -> Client:
        return Client(self.url, TOKEN, timeout_s=PATIENT_S)


@contextmanager
def running(**settings: object) -> Iterator[Running]:
    words = [sys.executable, "-c", PROGRAM, json.dumps(settings)]
    pipe = subprocess.PIPE
    with subprocess.Popen(words, env=ENVIRONMENT, stdout=pipe, stderr=pipe, text=True) as process:
        try:
            yield Running(process)
        finally:
            process.kill()
