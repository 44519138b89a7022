"""`clearway serve`."""

import os
import re
import signal
import socket
import subprocess
import sys
from dataclasses import replace

import pytest

from clearway.serve.client import Client
from clearway.serve.tokens import Tokens
from helpers.sums import Sums, plain


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("nowhere.onnx",), ("nowhere.onnx", "cannot be read")),
        (("FOLDER",), ("no run here",)),
        (("x.onnx", "--sessions", "0"), ("sessions is 0",)),
        (("x.onnx", "--idle-s", "15"), ("sessions expire after 15 s",)),
        (("x.onnx", "--deadline-s", "nan"), ("deadline_s is nan",)),
        (("x.onnx", "--idle-s", "inf"), ("idle_s is inf", "Give a smaller number")),
        (("x.onnx", "--trusted-proxy", "10.0.0.0/8"), ("--trusted-proxy '10.0.0.0/8'", "not a name or a network")),
    ],
    ids=lambda value: " ".join(value),
)
def test_services_that_cannot_be(clearway, tmp_path, words, parts):
    assert clearway("serve", *(tmp_path if word == "FOLDER" else word for word in words)).refusal(*parts)


@pytest.mark.parametrize("token", ["short", "with a space in it", "ümlaut-ümlaut-ümlaut"])
def test_tokens_that_are_too_weak_or_cannot_be_sent(clearway, monkeypatch, token):
    monkeypatch.setenv("CLEARWAY_TOKEN", token)
    line = clearway("serve", "x.onnx").refusal("CLEARWAY_TOKEN", "at least 16 plain letters")
    assert token not in line


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("--port", "70000"), "--port is 70000"),
        (("--replicas", "17"), "--replicas is 17, expected 1 to 16"),
        (("--host", "192.0.2.1"), "192.0.2.1"),
        (("--host", "no such host"), "--host no such host --port 0: "),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_addresses_that_cannot_be(clearway, monkeypatch, words, part):
    monkeypatch.setattr("clearway.serve.run.open_agent", lambda source, scene, threads: Sums())
    assert clearway("serve", "x.onnx", *words).refusal(part)


@pytest.fixture
def served(monkeypatch) -> list[Tokens]:
    """Tokens of the services that would have run."""
    tokens: list[Tokens] = []
    monkeypatch.setattr("clearway.serve.run.open_agent", lambda source, scene, threads: Sums())
    monkeypatch.setattr("clearway.serve.run.run_service", lambda agent, listener, given, limits: tokens.append(given))
    return tokens


def test_a_random_token_is_said_also_where_the_variable_is_empty(clearway, monkeypatch, served):
    for own in ("", "a-token-of-one-s-own"):
        monkeypatch.setenv("CLEARWAY_TOKEN", own)
        answer = clearway("serve", "x.onnx")
        assert answer.code == 0
        said = re.search(r"token: (\S+)", answer.err)
        assert (said is not None) == (own == "")
        assert served[-1].owner_of(said[1] if said else own) == "default"


def test_tokens_of_a_file_are_not_said(clearway, served, tmp_path):
    (tmp_path / "tokens").write_text("robot " + "r" * 20)
    (tmp_path / "tokens").chmod(0o600)
    answer = clearway("serve", "x.onnx", "--tokens", tmp_path / "tokens")
    assert answer.code == 0 and "token" not in answer.err
    assert served[-1].owner_of("r" * 20) == "robot"
    assert clearway("serve", "x.onnx", "--tokens", tmp_path).refusal("cannot be read")


def test_before_others_it_needs_a_token_of_one_s_own_and_warns_without_tls(clearway, monkeypatch, served):
    monkeypatch.delenv("CLEARWAY_TOKEN", raising=False)
    assert clearway("serve", "x.onnx", "--host", "0.0.0.0").refusal("--host 0.0.0.0", "Set CLEARWAY_TOKEN")
    assert not served
    monkeypatch.setenv("CLEARWAY_TOKEN", "a-token-of-one-s-own")
    assert "WARNING: NOT ENCRYPTED" in clearway("serve", "x.onnx", "--host", "0.0.0.0").err
    assert "WARNING" not in clearway("serve", "x.onnx").err
    assert clearway("serve", "x.onnx", "--tls-cert", "x.pem").refusal("go together")
    assert "without a token: http://127.0.0.1:" in clearway("serve", "x.onnx", "--health-port", "0").err


def test_health_and_figures_are_for_this_machine_unless_it_is_said(clearway, monkeypatch, served):
    """They were open, without a token, to whoever reached the service."""
    monkeypatch.setenv("CLEARWAY_TOKEN", "a-token-of-one-s-own")
    hosts = []

    def run(agent, network, *others):
        hosts.append(network.health.getsockname()[0])

    monkeypatch.setattr("clearway.serve.run.run_service", run)
    everywhere = ("serve", "x.onnx", "--host", "0.0.0.0", "--health-port", "0")
    assert "without a token: http://127.0.0.1:" in clearway(*everywhere).err
    assert "without a token: http://0.0.0.0:" in clearway(*everywhere, "--health-host", "0.0.0.0").err
    assert hosts == ["127.0.0.1", "0.0.0.0"]
    clearway("serve", "x.onnx", "--health-host", "0.0.0.0").refusal("--health-host is 0.0.0.0", "no --health-port")
    clearway("serve", "x.onnx", "--health-port", "-1").refusal("--health-port is -1")
    clearway("serve", "x.onnx", "--health-port", "0", "--health-host", " ").refusal("--health-host is empty")


@pytest.mark.skipif(sys.platform != "linux", reason="needs a second loopback address")
def test_one_port_at_two_addresses_is_not_for_health_too(clearway, monkeypatch, served):
    """All of the service would count as its port for health, figures without a token among it."""
    monkeypatch.setenv("CLEARWAY_TOKEN", "a-token-of-one-s-own")
    with socket.create_server(("127.0.0.2", 0)) as free:
        port = free.getsockname()[1]
    both = ("--host", "127.0.0.2", "--port", port, "--health-port", port)
    assert clearway("serve", "x.onnx", *both).refusal(f"--health-port is {port}, as --port is")


def test_a_file_that_says_nothing_of_arrivals_is_told_of(clearway, monkeypatch, served):
    line = "arrived is null in all answers: an earlier clearway exported this file. Export it again"
    assert line in clearway("serve", "x.onnx").err.replace("\n", " ")

    class Telling(Sums):
        card = replace(Sums.card, settings={"arrival": {"threshold": 0.8, "numbers": 2}})

    monkeypatch.setattr("clearway.serve.run.open_agent", lambda source, scene, threads: Telling())
    assert "arrived" not in clearway("serve", "x.onnx").err


@pytest.mark.parametrize(("host", "shown"), [("::1", "[::1]"), ("localhost", "localhost")])
def test_addresses_are_printed_as_a_browser_takes_them(clearway, served, host, shown):
    try:
        socket.create_server((host, 0), family=socket.AF_INET6 if ":" in host else socket.AF_INET).close()
    except OSError:
        pytest.skip(f"this machine has no {host}")
    assert re.search(rf"http://{re.escape(shown)}:\d+\n", clearway("serve", "x.onnx", "--host", host).err)


PROGRAM = """
import clearway.serve.run
from clearway.cli.main import main
from helpers.sums import Sums

clearway.serve.run.open_agent = lambda source, scene, threads: Sums()
main(["serve", "x.onnx"])
"""


def test_a_service_says_where_it_is_and_ends_when_told_to():
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "COLUMNS": "200"}
    environment.pop("CLEARWAY_TOKEN", None)
    words, pipe = [sys.executable, "-c", PROGRAM], subprocess.PIPE
    with subprocess.Popen(words, env=environment, stdout=pipe, stderr=pipe, text=True) as process:
        assert process.stderr is not None
        url = re.fullmatch(r"scene attic: (http://127\.0\.0\.1:\d+)\n", process.stderr.readline())[1]
        token = re.fullmatch(r"token: (\S{32})\n", process.stderr.readline())[1]
        assert process.stderr.readline().startswith("arrived is null in all answers")
        with Client(url, token) as client, client.session(selection="argmax") as session:
            session.set_target(plain(1))
            assert session.act(plain(1)).value == 1004
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (0, "", "")
