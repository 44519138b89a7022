"""A process that runs one ONNX graph: arrays in by its standard input, arrays or a fault out by its standard output.

It is bounded in memory, can open no file once it has begun, and is killed when a call takes too long: see
`onnx_session`. A message is `LENGTH` of a line of JSON, that line, and the bytes of the arrays that it tells of. The
first one holds the file, and is answered with its metadata; all others name inputs and outputs.
"""

from __future__ import annotations

import json
import math
import operator
import os
import struct
import sys
from collections.abc import Iterable
from typing import Any, BinaryIO

import numpy as np

from clearway.children import limit, open_nothing_more

LENGTH = struct.Struct("<I")
MOST_LINE_BYTES = 1 << 20
NUMBERS = "biuf"  # kinds of arrays that are sent
REASON_LENGTH = 300


def write_message(stream: BinaryIO, about: dict[str, Any], arrays: Iterable[np.ndarray] = ()) -> None:
    """Send a message. Raises OSError where the other side has ended."""
    sent = list(arrays)
    line = json.dumps({**about, "arrays": [[array.dtype.str, array.shape] for array in sent]}).encode()
    _write_all(stream, memoryview(LENGTH.pack(len(line)) + line))
    for array in sent:
        if array.size:
            _write_all(stream, array.ravel().view(np.uint8).data)
    stream.flush()


def read_message(stream: BinaryIO, most_bytes: int) -> tuple[dict[str, Any], list[np.ndarray]]:
    """A message, and its arrays.

    Args:
        stream: what it comes by.
        most_bytes: of its arrays together.

    Raises:
        EOFError: the other side has ended.
        ValueError: it is none, or is longer.
    """
    (length,) = LENGTH.unpack(_whole(stream, bytearray(LENGTH.size)))
    if length > MOST_LINE_BYTES:
        raise ValueError(f"a message begins with {length} bytes, at most {MOST_LINE_BYTES} were expected")
    try:
        about = json.loads(_whole(stream, bytearray(length)))
        shapes = [(np.dtype(kind), tuple(map(operator.index, shape))) for kind, shape in about.pop("arrays")]
        size = sum(kind.itemsize * math.prod(shape) for kind, shape in shapes)
    except (TypeError, KeyError, AttributeError, RecursionError) as fault:
        raise ValueError(f"a message begins with what is none ({fault})") from fault
    if size > most_bytes or any(kind.kind not in NUMBERS for kind, _ in shapes):
        raise ValueError(f"a message has arrays of {size} bytes, numbers and at most {most_bytes} were expected")
    arrays = [np.empty(shape, kind) for kind, shape in shapes]
    for array in arrays:
        if array.size:
            _whole(stream, array.reshape(-1).view(np.uint8))
    return about, arrays


def _write_all(stream: BinaryIO, left: memoryview) -> None:
    """Without a buffer, a stream may take a part."""
    while left:
        left = left[stream.write(left) :]


def _whole(stream: BinaryIO, room: Any) -> Any:
    """The room, filled; without a buffer, a stream may give a part."""
    left = memoryview(room)
    while left:
        if not (count := stream.readinto(left)):  # type: ignore[attr-defined]
            raise EOFError
        left = left[count:]
    return room


def main() -> None:
    """Answer until the other side closes. The argument is JSON: address_bytes, memory_bytes, message_bytes, threads."""
    job = json.loads(sys.argv[1])
    given, told = sys.stdin.buffer, os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what onnxruntime prints must not mix with the answers
    limit(memory_bytes=job["address_bytes"])
    _, (content,) = read_message(given, job["message_bytes"])
    try:
        session, metadata = _opened(content.tobytes(), job["memory_bytes"], job["threads"])
    except Exception as fault:  # onnxruntime's own errors share no other base
        write_message(told, {"fault": _said(fault)})
        return
    del content
    write_message(told, {"metadata": metadata})
    while True:
        try:
            asked, arrays = read_message(given, job["message_bytes"])
        except EOFError:
            return
        try:
            outputs = _outputs(session, asked["outputs"], dict(zip(asked["inputs"], arrays, strict=True)))
        except Exception as fault:  # as above
            write_message(told, {"fault": _said(fault)})
        else:
            write_message(told, {}, outputs)


def _opened(content: bytes, memory_bytes: int, threads: int | None) -> tuple[Any, dict[str, str]]:
    """The graph, ready to run, and the file's metadata."""
    import onnxruntime as ort

    options = ort.SessionOptions()
    options.intra_op_num_threads = threads or 0
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")  # idle threads leave the processor
    options.add_session_config_entry("session.use_env_allocators", "1")
    options.add_session_config_entry("session.load_model_format", "ONNX")  # no other, whatever its first bytes say
    kind = ort.OrtMemoryInfo("Cpu", ort.OrtAllocatorType.ORT_ARENA_ALLOCATOR, 0, ort.OrtMemType.DEFAULT)
    ort.create_and_register_allocator(kind, ort.OrtArenaCfg(memory_bytes, -1, -1, -1))
    open_nothing_more()
    wanted: dict[str, Any] = {"providers": ["CPUExecutionProvider"]}
    wanted["disabled_optimizers"] = ["ConstantFolding"]  # would run parts of the graph while it is opened
    session = ort.InferenceSession(content, options, **wanted)
    return session, dict(session.get_modelmeta().custom_metadata_map)


def _outputs(session: Any, names: list[str], given: dict[str, np.ndarray]) -> list[np.ndarray]:
    import onnxruntime

    run = onnxruntime.RunOptions()
    run.log_severity_level = 4
    outputs = session.run(names, given, run)
    for name, output in zip(names, outputs, strict=True):
        if not isinstance(output, np.ndarray) or output.dtype.kind not in NUMBERS:
            raise ValueError(f"its output {name} is no array of numbers")
    return outputs


def _said(fault: Exception) -> str:
    return " ".join(str(fault).split())[:REASON_LENGTH] or type(fault).__name__


if __name__ == "__main__":
    main()
