"""What a graph of a few hundred bytes can ask for is bounded while it runs, in memory and in time."""

import time

import numpy as np
import pytest
from onnx import TensorProto, helper, numpy_helper

from clearway.deploy import onnx_session
from clearway.deploy.onnx_session import BoundedSession
from clearway.errors import DeployError

X = helper.make_tensor_value_info("x", TensorProto.FLOAT, ["n"])
Y = helper.make_tensor_value_info("y", TensorProto.FLOAT, None)
GIVEN = {"x": np.ones(1, np.float32)}


def session(*nodes: tuple, shape: tuple[int, ...] = (1,)) -> BoundedSession:
    """A graph of x and of a shape, by nodes (operator, inputs, output, attributes)."""
    made = [helper.make_node(kind, inputs, [output], **attributes) for kind, inputs, output, attributes in nodes]
    size = numpy_helper.from_array(np.array(shape, np.int64), "shape")
    graph = helper.make_graph(made, "graph", [X], [Y], initializer=[size])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    return BoundedSession(model.SerializeToString(), "agent.onnx", 1)


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


def test_a_call_ends_when_its_time_is_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(onnx_session, "TIME_LIMIT_S", 0.3)
    products = [("Expand", ["x", "shape"], "c0", {})]
    products += [("MatMul", [f"c{k}"] * 2, f"c{k + 1}", {}) for k in range(3000)]
    opened = session(*products, ("Identity", ["c3000"], "y", {}), shape=(500, 500))
    begun = time.monotonic()
    with pytest.raises(DeployError, match=r"terminate.*its limits: 0\.3 s and"):
        opened.run(["y"], GIVEN)
    assert time.monotonic() - begun < 10


def test_a_sound_graph_runs_and_a_wrong_output_is_one_line() -> None:
    opened = session(*doubled(3))
    np.testing.assert_array_equal(opened.run(["y"], GIVEN)[0], np.ones(8))
    with pytest.raises(DeployError, match=r"agent\.onnx: its graph cannot be run"):
        opened.run(["z"], GIVEN)


def test_what_is_no_graph_is_one_line() -> None:
    with pytest.raises(DeployError, match=r"^agent\.onnx: onnxruntime .* cannot run it \(.*\)\. Upgrade it$"):
        BoundedSession(b"\x08\x63", "agent.onnx", 1)
