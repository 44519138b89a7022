"""What a graph of a few hundred bytes can ask for is bounded while it runs, in memory and in time."""

import os
import re
import signal
import subprocess
import sys
import threading
import time
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest
from onnx import TensorProto, ValueInfoProto, helper, numpy_helper

from clearway.deploy import onnx_session
from clearway.deploy.onnx_session import BoundedSession
from clearway.errors import DeployError
from helpers.spread_parts import parent_of, runs

X = helper.make_tensor_value_info("x", TensorProto.FLOAT, ["n"])
Y = helper.make_tensor_value_info("y", TensorProto.FLOAT, None)
GIVEN = {"x": np.ones(1, np.float32)}


def session(*nodes: tuple, shape: tuple[int, ...] = (1,), typed: bool = True) -> BoundedSession:
    """A graph of x and of a shape, by nodes (operator, inputs, output, attributes)."""
    made = [helper.make_node(kind, inputs, [output], **attributes) for kind, inputs, output, attributes in nodes]
    size = numpy_helper.from_array(np.array(shape, np.int64), "shape")
    graph = helper.make_graph(made, "graph", [X], [Y if typed else ValueInfoProto(name="y")], initializer=[size])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    return BoundedSession(model.SerializeToString(), "agent.onnx", 1)


def children() -> list[int]:
    """Running processes of `onnx_worker` that this one has started."""
    found = [int(path.name) for path in Path("/proc").glob("[0-9]*")]
    return [pid for pid in found if parent_of(pid) == os.getpid() and runs(pid, b"clearway.deploy.onnx_worker")]


def doubled(times: int) -> list[tuple]:
    names = ["x", *(f"c{k}" for k in range(1, times)), "y"]
    return [("Concat", [names[k]] * 2, names[k + 1], {"axis": 0}) for k in range(times)]


WEIGHT = ("Constant", [], "w", {"value": helper.make_tensor("w", TensorProto.FLOAT, [1], [1.0])})
BOMBS = {
    "a number repeated to 120 GB": [("Expand", ["x", "shape"], "y", {})],
    "forty times doubled": doubled(40),
    "constants alone": [WEIGHT, ("Expand", ["w", "shape"], "e", {}), ("Add", ["x", "e"], "y", {})],
    "a product of two vectors": [
        ("Expand", ["x", "shape"], "e", {}),
        ("Transpose", ["e"], "t", {}),
        ("MatMul", ["e", "t"], "y", {}),
    ],
}


SLOW = "forty times doubled"  # fills the memory that it may have
NAMES = [pytest.param(name, marks=pytest.mark.slow) if name == SLOW else name for name in BOMBS]


@pytest.mark.parametrize("name", NAMES)
def test_no_graph_takes_more_memory_than_the_limit(name: str) -> None:
    shape = (1 << 28, 1) if "product" in name else (300_000, 100_000)
    opened = session(*BOMBS[name], shape=shape)  # nothing of it runs before it is asked
    begun = time.monotonic()
    with pytest.raises(
        DeployError, match=r"^agent\.onnx: its graph cannot be run \(.*; its limits: 60 s and 4 GiB\)\. Export"
    ):
        opened.run(["y"], GIVEN)
    assert time.monotonic() - begun < 30


def squared() -> BoundedSession:
    """The square of a matrix (n, n) of ones, by x (n,): n ** 3 products, by one operator."""
    column, row = ("Unsqueeze", ["x", "shape"], "c", {}), ("Transpose", ["c"], "r", {})
    return session(column, row, ("MatMul", ["c", "r"], "s", {}), ("MatMul", ["s", "s"], "y", {}))


def ones(count: int) -> dict[str, np.ndarray]:
    return {"x": np.ones(count, np.float32)}


def test_one_operator_is_ended_when_its_time_is_over_and_the_next_call_is_answered(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    opened = squared()
    np.testing.assert_array_equal(opened.run(["y"], ones(2))[0], np.full((2, 2), 2))
    monkeypatch.setattr(onnx_session, "TIME_LIMIT_S", 0.3)
    begun = time.monotonic()
    with pytest.raises(DeployError, match=r"cannot be run \(not over after 0\.3 s; its limits: 0\.3 s and 4 GiB\)"):
        opened.run(["y"], ones(12_000))  # takes minutes
    assert time.monotonic() - begun < 5
    monkeypatch.undo()
    np.testing.assert_array_equal(opened.run(["y"], ones(3))[0], np.full((3, 3), 3))


def test_a_process_that_ends_by_itself_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    opened = squared()
    (process,) = children()
    killer = threading.Timer(0.3, os.kill, (process, signal.SIGSEGV))
    killer.start()
    with pytest.raises(DeployError, match=r"^agent\.onnx: its graph cannot be run \(its process ended with signal SIG"):
        opened.run(["y"], ones(12_000))
    killer.join()
    assert len(opened.run(["y"], ones(2))) == 1


@pytest.mark.skipif(sys.platform != "linux", reason="a process's limits are told by /proc")
def test_the_process_can_open_nothing_and_its_memory_is_bounded() -> None:
    opened = squared()
    (process,) = children()
    told = Path(f"/proc/{process}/limits").read_text()
    assert re.search(r"^Max open files +0 +0 ", told, re.MULTILINE)
    (most,) = re.findall(r"^Max address space +(\d+) ", told, re.MULTILINE)
    assert int(most) >= onnx_session.ADDRESS_LIMIT_BYTES
    assert len(opened.run(["y"], ones(2))) == 1


def test_a_process_ends_with_its_session() -> None:
    opened = squared()
    assert len(children()) == 1
    del opened
    end = time.monotonic() + 5
    while children():
        assert time.monotonic() < end
        time.sleep(0.01)


COPIED = """
import os, numpy
from test_onnx_session import children, ones, squared
opened = squared()
before = children()
if (copy := os.fork()) == 0:
    os._exit(0 if opened.run(["y"], ones(2))[0].shape == (2, 2) and len(children()) == 1 else 1)
assert os.waitstatus_to_exitcode(os.waitpid(copy, 0)[1]) == 0
assert children() == before and opened.run(["y"], ones(3))[0].shape == (3, 3)
"""


COPIED_UNDER_WAY = """
import os, signal, sys, threading, time
from test_onnx_session import ones, squared
opened, told = squared(), []
asking = threading.Thread(target=lambda: told.append(opened.run(["y"], ones(4000))[0].shape))
asking.start()
until = time.monotonic() + 60
while not opened._lock.locked():
    assert time.monotonic() < until
    time.sleep(0.001)
if (copy := os.fork()) == 0:
    signal.alarm(20)
    sys.exit(0 if opened.run(["y"], ones(2))[0].shape == (2, 2) else 1)  # which closes what it has of its parent
assert asking.is_alive()
assert os.waitstatus_to_exitcode(os.waitpid(copy, 0)[1]) == 0
asking.join()
assert told == [(4000, 4000)]
"""


@pytest.mark.slow
@pytest.mark.parametrize("statements", [COPIED, COPIED_UNDER_WAY], ids=["idle", "while a thread waits for an answer"])
def test_a_copy_of_a_process_has_its_own(statements: str) -> None:
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    words, environment = [sys.executable, "-W", "ignore", "-c", statements], {**os.environ, "PYTHONPATH": path}
    found = subprocess.run(words, env=environment, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stderr


def test_a_call_that_is_interrupted_does_not_answer_the_next_one(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    opened = squared()
    monkeypatch.setattr(onnx_session, "read_message", interrupted)
    with pytest.raises(KeyboardInterrupt):
        opened.run(["y"], ones(2))
    monkeypatch.undo()
    assert opened.run(["y"], ones(3))[0].shape == (3, 3)


def test_what_a_graph_gives_is_bounded_and_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(DeployError, match=r"its output y is no array of numbers"):
        session(("Cast", ["x"], "y", {"to": TensorProto.STRING}), typed=False).run(["y"], ones(2))
    opened = squared()
    monkeypatch.setattr(onnx_session, "MESSAGE_LIMIT_BYTES", 1000)
    with pytest.raises(DeployError, match=r"has arrays of 1600 bytes, numbers and at most 1000 were expected"):
        opened.run(["y"], ones(20))


def test_a_sound_graph_runs_and_a_wrong_output_is_one_line() -> None:
    opened = session(*doubled(3))
    np.testing.assert_array_equal(opened.run(["y"], GIVEN)[0], np.ones(8))
    with pytest.raises(DeployError, match=r"agent\.onnx: its graph cannot be run"):
        opened.run(["z"], GIVEN)


def test_what_is_no_graph_is_one_line() -> None:
    with pytest.raises(DeployError, match=r"^agent\.onnx: onnxruntime .* cannot run it \(.*\)\. Upgrade it$"):
        BoundedSession(b"\x08\x63", "agent.onnx", 1)


def test_onnxruntime_may_come_by_another_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """As onnxruntime-gpu does, for one."""
    by_name = metadata.Distribution.from_name

    def hidden(name: str) -> metadata.Distribution:
        if name == "onnxruntime":
            raise metadata.PackageNotFoundError(name)
        return by_name(name)

    monkeypatch.setattr(metadata.Distribution, "from_name", hidden)
    assert squared().run(["y"], ones(2))[0].shape == (2, 2)


def test_onnxruntime_that_is_not_installed_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(DeployError, match=r"^agent\.onnx: needs onnxruntime\. Install it"):
        squared()


def test_a_system_without_a_place_for_a_thread_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    opened = squared()
    monkeypatch.setattr(threading.Thread, "start", full)
    for ask in (squared, lambda: opened.run(["y"], ones(2))):
        with pytest.raises(
            DeployError, match=r"^agent\.onnx: no process can be started for it \(can't start new thread\)"
        ):
            ask()
    monkeypatch.undo()
    assert opened.run(["y"], ones(2))[0].shape == (2, 2)
