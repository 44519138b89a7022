"""What it costs that an exported agent's graph runs in a process of its own, beside the same graph in this process.

    clearway export generalist --out generalist.onnx
    python benchmarks/onnx_process.py generalist.onnx

The parts of the generalist's graph, on one thread: the least and the median of so many calls, one way after the other;
then the resident memory of this process, which holds the graph too, and of the other.
"""

from __future__ import annotations

import argparse
import os
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import onnxruntime
from family import family, resident_mib

from clearway.deploy.onnx_file import read_onnx

PARTS = ("a picture of 160 x 120", "the places around one", "64 pairs", "512 pairs")


def asked_of(part: str, features: int) -> tuple[str, dict[str, np.ndarray]]:
    """The output that a part is told by, and the inputs."""
    random, nothing = np.random.default_rng(0), np.zeros((0, features), np.float32)
    given: dict[str, np.ndarray] = {}
    given |= {"picture": np.zeros((0, 4, 4, 3), np.uint8), "seen": nothing, "first": nothing, "second": nothing}
    if part == PARTS[0]:
        return "features", given | {"picture": random.integers(0, 256, (1, 120, 160, 3), np.uint8)}
    if part == PARTS[1]:
        return "stands", given | {"seen": random.random((1, features), np.float32)}
    rows = random.random((2, int(part.split()[0]), features), np.float32)
    return "whereabouts", given | {"first": rows[0], "second": rows[1]}


def ms(work: Callable[[], object]) -> float:
    """Milliseconds that it takes."""
    begun = time.perf_counter()
    work()
    return (time.perf_counter() - begun) * 1000


def main() -> None:
    """Print the table as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path, help="an exported generalist")
    parser.add_argument("--calls", type=int, default=150, help="of each part, each way")
    options = parser.parse_args()
    settings = onnxruntime.SessionOptions()
    settings.intra_op_num_threads = 1
    here = onnxruntime.InferenceSession(str(options.file), settings, providers=["CPUExecutionProvider"])
    opening = time.perf_counter()
    file = read_onnx(options.file, threads=1)
    print(f"opened in {time.perf_counter() - opening:.2f} s\n")
    print("| | in this process, ms: least, median | in its own |\n| --- | --- | --- |")
    for part in PARTS:
        output, given = asked_of(part, file.card.feature_count)
        ways = (lambda: here.run([output], given), lambda: file.session.run([output], given))  # noqa: B023 - run at once
        assert all(np.allclose(one, other, atol=1e-5) for one, other in zip(*(way() for way in ways), strict=True))
        times = [[ms(way) for _ in range(options.calls)] for way in ways]
        told = [f"{min(each):.2f}, {statistics.median(each):.2f}" for each in times]
        print(f"| {part} | {' | '.join(told)} |")
    own, *others = [resident_mib(pid) for pid in family(os.getpid())]
    print(f"\n{own:.0f} MiB here, {sum(others):.0f} MiB there")


if __name__ == "__main__":
    main()
