"""A seal says that a file is whole, not that it is harmless: what it asks of onnxruntime is looked at first."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from clearway.deploy import onnx_file, onnx_graph_check
from clearway.deploy.onnx_file import CHECKSUM_KEY, NO_DIGEST, read_onnx, sealed
from clearway.deploy.onnx_graph_check import problem_of
from clearway.errors import DeployError

X, Y = (helper.make_tensor_value_info(name, TensorProto.FLOAT, [1]) for name in "xy")


def model(*nodes: onnx.NodeProto, initializer: tuple = (), functions: tuple = (), domains: tuple = ("",)) -> bytes:
    graph = helper.make_graph(list(nodes), "graph", [X], [Y], initializer=list(initializer))
    imports = [helper.make_opsetid(domain, 17 if domain == "" else 1) for domain in domains]
    made = helper.make_model(graph, opset_imports=imports, functions=list(functions))
    helper.set_model_props(made, {CHECKSUM_KEY: NO_DIGEST.decode()})
    return sealed(made.SerializeToString())


def body() -> onnx.GraphProto:
    """Of a loop that never ends by itself."""
    values = [helper.make_tensor_value_info("i", TensorProto.INT64, []), *bools("keep")]
    return helper.make_graph([helper.make_node("Identity", ["keep"], ["on"])], "body", values, bools("on"))


def bools(name: str) -> list[onnx.ValueInfoProto]:
    return [helper.make_tensor_value_info(name, TensorProto.BOOL, [])]


def in_branches(node: onnx.NodeProto, depth: int) -> onnx.NodeProto:
    for _ in range(depth):
        graph = helper.make_graph([node], "branch", [], [Y])
        node = helper.make_node("If", ["x"], ["y"], then_branch=graph, else_branch=graph)
    return node


def elsewhere(location: str) -> onnx.TensorProto:
    tensor = numpy_helper.from_array(np.zeros(1, np.float32), "x0")
    tensor.ClearField("raw_data")
    tensor.data_location = TensorProto.EXTERNAL
    entry = tensor.external_data.add()
    entry.key, entry.value = "location", location
    return tensor


LOOP = helper.make_node("Loop", ["", "x"], ["y"], body=body())
ADD = helper.make_node("Add", ["x", "x"], ["y"])
TWICE = helper.make_function("own", "Twice", ["x"], ["y"], [ADD], [helper.make_opsetid("", 17)])
HOSTILE = {
    "a loop": (model(LOOP), "the operator Loop"),
    "a loop in branches": (model(in_branches(LOOP, 1)), "the operator Loop"),
    "a custom operator": (model(helper.make_node("Run", ["x"], ["y"], domain="evil"), domains=("", "evil")), "'evil'"),
    "an operator of onnxruntime's own": (
        model(helper.make_node("Gelu", ["x"], ["y"], domain="com.microsoft"), domains=("", "com.microsoft")),
        "'com.microsoft'",
    ),
    "values in another file": (model(ADD, initializer=(elsewhere("/etc/passwd"),)), "values in another file"),
    "a constant in another file": (
        model(helper.make_node("Constant", [], ["y"], value=elsewhere("secret"))),
        "values in another file",
    ),
    "functions": (model(ADD, functions=(TWICE,), domains=("", "own")), "functions of its own"),
}


@pytest.mark.parametrize("name", list(HOSTILE))
def test_a_hostile_graph_with_a_valid_seal_never_reaches_onnxruntime(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content, says = HOSTILE[name]
    monkeypatch.setattr(onnx_file, "BoundedSession", lambda *given: pytest.fail("a session was made"))
    path = tmp_path / "agent.onnx"
    path.write_bytes(content)
    with pytest.raises(
        DeployError, match=rf"agent\.onnx: asks for .*{says}.* no exported agent does\. Export it again"
    ):
        read_onnx(path)


def test_a_plain_graph_is_no_problem() -> None:
    assert problem_of(model(ADD)) is None
    assert problem_of(model(in_branches(ADD, 2))) is None


def test_graphs_in_graphs_are_followed_only_so_deep() -> None:
    def nested(depth: int) -> bytes:
        """Fields of a graph, a node and an attribute in each other."""
        message = b""
        for number in [6, 5, 1] * depth:
            message = bytes([number << 3 | 2]) + _length(len(message)) + message
        return b"\x3a" + _length(len(message)) + message

    assert problem_of(nested(20)) is None
    assert problem_of(nested(2000)) == "graphs more than 32 deep"


def test_fields_beyond_number_are_not_gone_through(monkeypatch: pytest.MonkeyPatch) -> None:
    graph = b"\x0a\x00" * 60  # nodes of nothing
    whole = b"\x3a" + _length(len(graph)) + graph
    monkeypatch.setattr(onnx_graph_check, "MOST_FIELDS", 61)
    assert problem_of(whole) is None
    monkeypatch.setattr(onnx_graph_check, "MOST_FIELDS", 60)
    assert problem_of(whole) == "more than 60 parts"


def _length(value: int) -> bytes:
    found = b""
    while value > 127:
        found, value = found + bytes([value & 127 | 128]), value >> 7
    return found + bytes([value])


def test_a_field_s_number_has_no_bits_that_others_leave_out() -> None:
    """Protobuf takes 32 bits of a field's number and kind: with a higher one set, it would still see a graph."""
    whole = model(LOOP)
    place = whole.index(b"\x3a")  # the graph
    with pytest.raises(ValueError, match="a field of no number"):
        problem_of(whole[:place] + b"\xba\x80\x80\x80\x10" + whole[place + 1 :])


def test_what_is_no_message_is_told_in_one_line(tmp_path: Path) -> None:
    whole = model(ADD)
    for hurt in (whole[:-3], b"\xff" * 20 + whole, b"\x3b" + whole, b"\x38\x01" + whole):
        with pytest.raises(ValueError, match=r"a field|a number"):
            problem_of(hurt)
