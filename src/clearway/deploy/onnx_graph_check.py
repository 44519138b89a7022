"""What an ONNX file may ask of onnxruntime, looked at in its bytes before that sees them.

A seal tells that a file is as it was exported, not by whom. So no file may name other files, operators of other
libraries, functions of its own, or loops, whose time no size of the file bounds. What it asks for otherwise is bounded
while it runs: see `onnx_session`.

Messages and field numbers: onnx.proto3 of ONNX 1.18, https://github.com/onnx/onnx/blob/main/onnx/onnx.proto3
"""

from __future__ import annotations

from collections.abc import Iterator

DOMAINS = ("", "ai.onnx")
ENDLESS = ("Loop", "Scan", "SequenceMap")
MAX_DEPTH = 32  # of graphs in graphs
MOST_FIELDS = 1_000_000  # looked at, a second or two; the generalist has some thousands
INSIDE = {
    "model": {7: "graph", 25: "function"},
    "graph": {1: "node", 5: "tensor", 15: "sparse tensor"},
    "node": {5: "attribute"},
    "attribute": {5: "tensor", 6: "graph", 10: "tensor", 11: "graph", 22: "sparse tensor", 23: "sparse tensor"},
    "sparse tensor": {1: "tensor", 2: "tensor"},
}
"""The messages in a message, by the numbers of their fields."""
OPERATOR, DOMAIN = 4, 7  # of a node
EXTERNAL_DATA, DATA_LOCATION = 13, 14  # of a tensor
KEY_BITS = 32  # of a field's number and kind
VARINT, FIXED_64, BYTES, FIXED_32 = 0, 1, 2, 5  # kinds of fields


def problem_of(content: bytes) -> str | None:
    """What a file asks for and may not; None where there is nothing.

    Raises:
        ValueError: it is no message of protobuf.
    """
    return next(_problems(memoryview(content), "model", 0, iter(range(MOST_FIELDS))), None)


def _problems(message: memoryview, kind: str, depth: int, left: Iterator[int]) -> Iterator[str]:
    """What a message asks for and may not; `left`: an item for each field that may still be looked at."""
    if depth > 3 * MAX_DEPTH:  # a graph, its node, the node's attribute
        yield f"graphs more than {MAX_DEPTH} deep"
        return
    for number, value in _fields(message):
        if next(left, None) is None:
            yield f"more than {MOST_FIELDS:,} parts"
            return
        inside = INSIDE.get(kind, {}).get(number)
        if kind == "tensor" and (number == EXTERNAL_DATA or (number == DATA_LOCATION and value != 0)):
            yield "values in another file"
        elif kind == "node" and number in (OPERATOR, DOMAIN):
            word = bytes(_as_bytes(value)).decode(errors="replace")
            if number == DOMAIN and word not in DOMAINS:
                yield f"operators of the domain {word[:80]!r}"
            if number == OPERATOR and word in ENDLESS:
                yield f"the operator {word}"
        elif inside == "function":
            yield "functions of its own"
        elif inside is not None:
            yield from _problems(_as_bytes(value), inside, depth + 1, left)


def _as_bytes(value: int | memoryview) -> memoryview:
    if isinstance(value, int):
        raise ValueError("a number in place of a message")
    return value


def _fields(message: memoryview) -> Iterator[tuple[int, int | memoryview]]:
    """The fields of a message by their numbers; those of a fixed length are numbers."""
    place = 0
    while place < len(message):
        key, place = _varint(message, place)
        if key >= 1 << KEY_BITS:  # others leave the rest of its bits out, and take it for another field
            raise ValueError("a field of no number")
        number, kind = key >> 3, key & 7
        if kind == VARINT:
            value, place = _varint(message, place)
            yield number, value
            continue
        length = {FIXED_64: 8, FIXED_32: 4}.get(kind)
        if kind == BYTES:
            length, place = _varint(message, place)
        if length is None or place + length > len(message):
            raise ValueError("a field that is cut off, or of no kind")
        part = message[place : place + length]
        place += length
        yield number, part if kind == BYTES else int.from_bytes(part, "little")


def _varint(message: memoryview, place: int) -> tuple[int, int]:
    """A number, and the place after it."""
    value = 0
    for shift in range(0, 70, 7):
        if place >= len(message):
            break
        byte = message[place]
        value, place = value | (byte & 127) << shift, place + 1
        if byte < 128:
            return value, place
    raise ValueError("a number that is cut off")
