"""The service behind nginx, as the documents have it; where nginx is installed."""

from __future__ import annotations

import json
import re
import shutil
import signal
import socket
import ssl
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import numpy as np
import pytest
from websockets.sync.client import connect

from helpers.certificates import certified
from helpers.running import PATIENT_S, Running, running
from helpers.serving import OWNER, TOKEN, grey

ROOT = Path(__file__).parents[2]
GLOBAL = """daemon off; master_process off; pid {folder}/pid; error_log stderr warn; events {{}}
http {{ access_log off; client_body_temp_path {folder}/body; proxy_temp_path {folder}/proxy;
fastcgi_temp_path {folder}/f; uwsgi_temp_path {folder}/u; scgi_temp_path {folder}/s;
{server} }}"""


@contextmanager
def proxied(service: Running, folder: Path) -> Iterator[tuple[int, ssl.SSLContext]]:
    """Nginx with the documents' lines before a service; its port, and who trusts its certificate."""
    if (nginx := shutil.which("nginx")) is None:
        pytest.skip("nginx is not installed")
    certificate, key = certified(folder)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    (server,) = re.findall(r"```nginx\n(.*?)```", (ROOT / "docs/deploy.md").read_text(encoding="utf-8"), re.DOTALL)
    for before, after in (("8443", port), ("cert.pem", certificate), ("key.pem", key), (":8000", f":{service.port}")):
        assert before in server
        server = server.replace(before, str(after))
    (folder / "nginx.conf").write_text(GLOBAL.format(folder=folder, server=server), encoding="utf-8")
    with subprocess.Popen([nginx, "-e", "stderr", "-p", str(folder), "-c", str(folder / "nginx.conf")]) as process:
        try:
            until = time.monotonic() + PATIENT_S
            while time.monotonic() < until:
                try:
                    socket.create_connection(("127.0.0.1", port)).close()
                    break
                except ConnectionRefusedError:
                    time.sleep(0.05)
            yield port, ssl.create_default_context(cafile=str(certificate))
        finally:
            process.terminate()


def test_behind_a_proxy_everybody_is_told_apart_and_nobody_can_pretend(tmp_path) -> None:
    bearing = {"authorization": f"Bearer {TOKEN}"}
    with (
        running(proxy="127.0.0.1", wrong_tokens=3, log=True) as service,
        proxied(service, tmp_path) as (port, trusting),
    ):
        url = f"https://127.0.0.1:{port}"

        def client(address: str) -> httpx.Client:
            way = httpx.HTTPTransport(verify=trusting, local_address=address)
            return httpx.Client(base_url=url, transport=way, timeout=PATIENT_S)

        with client("127.0.0.2") as mine, client("127.0.0.3") as other:
            session = mine.post("/sessions", json={"selection": "argmax"}, headers=bearing).json()["session_id"]
            kind = {**bearing, "content-type": "image/png"}
            assert mine.put(f"/sessions/{session}/target", content=grey(1), headers=kind).status_code == 204
            assert mine.post(f"/sessions/{session}/steps", content=grey(2), headers=kind).json()["value"] == 1008
            stream = f"wss://127.0.0.1:{port}/sessions/{session}/stream"
            with connect(stream, additional_headers=bearing, ssl=trusting) as socket_:
                socket_.send(grey(3))
                assert json.loads(socket_.recv(timeout=PATIENT_S))["step"] == 2
            large = np.random.default_rng(0).bytes(3 << 20)
            assert mine.put(f"/sessions/{session}/target", content=large, headers=kind).status_code == 415
            pretended = [{"authorization": "Bearer wrong", "x-forwarded-for": f"192.0.2.{last}"} for last in range(4)]
            assert [mine.get("/agent", headers=each).status_code for each in pretended] == [401, 401, 401, 429]
            assert other.get("/agent", headers=pretended[0]).status_code == 401
        service.process.send_signal(signal.SIGTERM)
        _, err = service.process.communicate(timeout=PATIENT_S)
    said = [json.loads(line) for line in err.splitlines()]
    assert {each["address"] for each in said if each["owner"] == OWNER} <= {"127.0.0.2", "127.0.0.1"}
    assert {each["address"] for each in said if each["owner"] is None} == {"127.0.0.2", "127.0.0.3"}
