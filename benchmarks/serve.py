"""How fast `clearway serve` answers: latency and requests a second against concurrency, and the model's share of it.

    python benchmarks/serve.py bathroom.onnx                 # four minutes; or a run folder
    python benchmarks/serve.py bathroom.onnx --seconds 3     # a first look

The service runs as a process of its own; as many clients as the column says ask it over HTTP on the loopback interface,
each in a session of its own, with the next picture as soon as an answer has come. Pictures are 400 x 300 JPEG files of
noise with large patches. The model's share is the time that batches took in encoder and policy, as the service itself
counts it, by the time that passed: 100 % means that it did nothing but wait for the model. The clients share the
processor with the service. All numbers of clients are gone through several times, so that whatever else the machine
does hits all alike; of each, the round with the median of requests a second is printed.

Before, the backends: processor time a picture of the whole agent, one thread, the least of several repeats.
"""

from __future__ import annotations

import argparse
import asyncio
import io
import re
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import httpx
import numpy as np
from PIL import Image
from serving import served

from clearway.agents.agent import Agent
from clearway.deploy.navigator import open_agent
from clearway.deploy.onnx_file import OnnxAgent, read_onnx
from clearway.scenes.sensors import RGB

SIZE = (300, 400)
TOKEN = "a-token-for-the-benchmark"
ANSWER_S = 120


class Row(NamedTuple):
    """Requests a second, latency, pictures a batch, and the model's share of the time."""

    per_s: float
    p50_ms: float
    p99_ms: float
    batch: float
    share: float


def main(arguments: Sequence[str] | None = None) -> None:
    """Print both tables as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("agent", type=Path, help="a file that clearway export wrote, or a run folder")
    parser.add_argument("--run", type=Path, help="the run folder of the file, to compare with PyTorch")
    parser.add_argument("--clients", type=int, nargs="+", default=[1, 2, 4, 8, 16, 32])
    parser.add_argument("--seconds", type=float, default=10.0, help="for each number of clients and round")
    parser.add_argument("--rounds", type=int, default=3, help="through all numbers of clients; their median is printed")
    options = parser.parse_args(arguments)
    if options.run:
        backends = {"PyTorch": open_agent(options.run), "onnxruntime": OnnxAgent(read_onnx(options.agent, threads=1))}
        print_backends(backends)
    with served(str(options.agent), environment={"CLEARWAY_TOKEN": TOKEN}) as (url, _):
        print("| clients | requests/s | p50 ms | p99 ms | pictures a batch | model's share |")
        print("| --- | --- | --- | --- | --- | --- |")
        found: dict[int, list[Row]] = {clients: [] for clients in options.clients}
        for _ in range(options.rounds):
            for clients in options.clients:
                found[clients].append(asyncio.run(measured(url, clients, options.seconds)))
        for clients, rows in found.items():
            row = sorted(rows)[len(rows) // 2]
            figures = f"{row.per_s:.1f} | {row.p50_ms:.0f} | {row.p99_ms:.0f} | {row.batch:.1f} | {row.share:.0%}"
            print(f"| {clients} | {figures} |")


def print_backends(backends: Mapping[str, Agent], batches: Sequence[int] = (1, 4, 16), repeats: int = 7) -> None:
    """Processor time of the whole agent, milliseconds a picture."""
    import torch

    torch.set_num_threads(1)
    print(f"| pictures a batch | {' | '.join(f'{name} ms' for name in backends)} |")
    print(f"| --- {'| --- ' * len(backends)}|")
    for count in batches:
        best = dict.fromkeys(backends, float("inf"))
        for _ in range(repeats):
            for name, agent in backends.items():
                seen = {RGB: pictures(count)}
                memory = agent.reset(seen, np.arange(count))
                begun = time.process_time()
                agent.act(seen, memory)
                best[name] = min(best[name], (time.process_time() - begun) / count)
        print(f"| {count} | {' | '.join(f'{1000 * seconds:.1f}' for seconds in best.values())} |")
    print()


def pictures(count: int) -> np.ndarray:
    """Patches of colour with noise on them, (count, height, width, 3) uint8."""
    rng = np.random.default_rng(0)
    patches = rng.integers(40, 216, (count, SIZE[0] // 50, SIZE[1] // 50, 3)).repeat(50, axis=1).repeat(50, axis=2)
    return (patches + rng.integers(-8, 9, patches.shape)).astype(np.uint8)


def jpeg(picture: np.ndarray) -> bytes:
    """A picture as a file's content."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=85)
    return file.getvalue()


async def measured(url: str, clients: int, seconds: float) -> Row:
    """Ask with so many clients for so long."""
    headers = {"authorization": f"Bearer {TOKEN}", "content-type": "image/jpeg"}
    room = httpx.Limits(max_connections=clients)
    files = [jpeg(picture) for picture in pictures(8)]
    async with httpx.AsyncClient(base_url=url, headers=headers, timeout=ANSWER_S, limits=room) as http:
        sessions = await asyncio.gather(*(opened(http, files[0]) for _ in range(clients)))
        before, begun = await model_figures(http), time.perf_counter()
        latencies = await asyncio.gather(*(walked(http, path, files, begun + seconds) for path in sessions))
        passed, after = time.perf_counter() - begun, await model_figures(http)
        for path in sessions:
            await http.delete(path)
    spent, batches, seen = (later - earlier for later, earlier in zip(after, before, strict=True))
    every = np.sort(np.concatenate([np.array(each) for each in latencies])) * 1000
    p50, p99 = np.quantile(every, [0.5, 0.99])
    return Row(len(every) / passed, float(p50), float(p99), seen / batches, spent / passed)


async def opened(http: httpx.AsyncClient, target: bytes) -> str:
    """The path of a new session with a target."""
    answer = await http.post("/sessions", json={}, headers={"content-type": "application/json"})
    path = f"/sessions/{answer.raise_for_status().json()['session_id']}"
    (await http.put(f"{path}/target", content=target)).raise_for_status()
    return path


async def walked(http: httpx.AsyncClient, path: str, files: Sequence[bytes], until: float) -> list[float]:
    """Seconds that each step of a session took."""
    found: list[float] = []
    while (begun := time.perf_counter()) < until:
        answer = await http.post(f"{path}/steps", content=files[len(found) % len(files)])
        answer.raise_for_status()
        found.append(time.perf_counter() - begun)
    return found


async def model_figures(http: httpx.AsyncClient) -> tuple[float, float, float]:
    """Seconds in the model, batches and pictures so far."""
    text = (await http.get("/metrics")).raise_for_status().text
    names = ("clearway_model_seconds_sum", "clearway_model_seconds_count", "clearway_batch_pictures_sum")
    spent, batches, seen = (float(re.search(rf"^{name} (\S+)$", text, re.MULTILINE)[1]) for name in names)  # type: ignore[index]
    return spent, batches, seen


if __name__ == "__main__":
    main()
