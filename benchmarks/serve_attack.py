"""What hostile pictures from clients with a token cost the others: seconds of `act` without and with the attack.

    python benchmarks/serve_attack.py generalist              # a minute; or a file, or a run folder

The service runs as a process of its own with a token for the others and two for the attackers. The others step at a
robot's pace. The attackers, in a process of their own, send so many hostile pictures a second whatever becomes of them,
each token in sessions of its own: JPEG files of 300,000 scans, of as many scans as are taken, and WebP files of the
largest size. Without and with the attack take turns, so that whatever else the machine does hits both alike. All share
the processor.
"""

from __future__ import annotations

import argparse
import asyncio
import io
import json
import multiprocessing
import os
import re
import secrets
import signal
import tempfile
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager, contextmanager, suppress
from pathlib import Path

import httpx
import numpy as np
from PIL import Image
from serving import served

from clearway.children import end_with_parent

ANSWER_S = 60
TOKENS = {name: secrets.token_urlsafe(24) for name in ("robots", "stranger", "other-stranger")}
SIDE = 1440
ROBOTS = {"authorization": f"Bearer {TOKENS['robots']}", "content-type": "image/jpeg"}
Step = Callable[[bytes], Awaitable[None]]
"""Sends a picture and waits for the action. Raises AssertionError where it is refused."""
Stepping = Callable[[httpx.AsyncClient, str, str], AbstractAsyncContextManager[Step]]
"""How the session at a path of the service at an address steps."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("agent", help="a file that clearway export wrote, a run folder, or generalist")
    parser.add_argument("--seconds", type=float, default=15.0, help="without, and with the attack, each time")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--robots", type=int, default=4, help="clients, each with a session")
    parser.add_argument("--every-s", type=float, default=0.5, help="between the steps of a robot")
    parser.add_argument("--attack-per-s", type=float, default=10.0, help="hostile pictures a second")
    parser.add_argument("--record", type=Path, help="a file for all seconds and counts, as JSON")
    options = parser.parse_args(arguments)
    hostile = hostile_pictures()
    found: dict[bool, list[float]] = {False: [], True: []}
    with served_to_robots(options.agent) as (url, _):
        for _ in range(options.rounds):
            for attacked in (False, True):
                with attacking(url, hostile, options.attack_per_s if attacked else 0):
                    found[attacked] += asyncio.run(walked(url, options.robots, options.every_s, options.seconds))
        figures = counted(url)
    print("| | acts | p50 ms | p99 ms | longest ms |\n| --- | --- | --- | --- | --- |")
    for attacked, name in ((False, "without"), (True, f"{options.attack_per_s:g} hostile pictures a second")):
        p50, p99, most = (1000 * float(np.quantile(found[attacked], share)) for share in (0.5, 0.99, 1))
        print(f"| {name} | {len(found[attacked])} | {p50:.0f} | {p99:.0f} | {most:.0f} |")
    print(f"99th percentile: {np.quantile(found[True], 0.99) / np.quantile(found[False], 0.99):.2f} times")
    print("\n".join(f"{name} {count:g}" for name, count in figures.items()))
    if options.record is not None:
        seconds = {name: [round(each, 4) for each in found[name == "attacked"]] for name in ("without", "attacked")}
        told = {"seconds": seconds, "attack_per_s": options.attack_per_s, "robots": options.robots, "counted": figures}
        options.record.write_text(json.dumps(told) + "\n", encoding="utf-8")


def counted(url: str) -> dict[str, float]:
    """What a service says it has counted of answers, refusals and decoders."""
    text = httpx.get(f"{url}/metrics", headers=ROBOTS, timeout=ANSWER_S).text
    found = re.findall(r"^clearway_((?:replaced_decoders|faults_total|requests_total)\S*) (.*)$", text, re.MULTILINE)
    return {name: float(count) for name, count in found}


def hostile_pictures() -> list[bytes]:
    """Files within the limits of size that take long to decode."""
    noise = np.random.default_rng(0).integers(0, 256, (SIDE, SIDE, 3), np.uint8)
    flat, loud, webp = io.BytesIO(), io.BytesIO(), io.BytesIO()
    Image.new("RGB", (SIDE, SIDE)).save(flat, "JPEG", progressive=True)
    Image.fromarray(noise).save(loud, "JPEG", quality=60, progressive=True)
    Image.fromarray(noise).save(webp, "WEBP", quality=90, method=0)
    return [rescanned(flat.getvalue(), 300_000), rescanned(loud.getvalue(), 90), webp.getvalue()]


def rescanned(content: bytes, more: int, most_bytes: int = (4 << 20) - 1024) -> bytes:
    """A progressive JPEG whose last scan comes again, so often or as the size allows."""
    last = content[content.rindex(b"\xff\xda") : content.rindex(b"\xff\xd9")]
    more = min(more, (most_bytes - len(content)) // len(last))
    return content.removesuffix(b"\xff\xd9") + last * more + b"\xff\xd9"


@contextmanager
def served_to_robots(agent: str) -> Iterator[tuple[str, int]]:
    """A service with the tokens of the robots and of the strangers."""
    with tempfile.TemporaryDirectory() as folder:
        tokens = Path(folder) / "tokens"
        tokens.write_text("".join(f"{name} {token}\n" for name, token in TOKENS.items()), encoding="utf-8")
        tokens.chmod(0o600)
        with served(agent, "--tokens", str(tokens)) as found:
            yield found


@contextmanager
def attacking(url: str, hostile: list[bytes], per_s: float) -> Iterator[None]:
    """So many hostile pictures a second meanwhile, from a process of its own."""
    if not per_s:
        yield
        return
    process = multiprocessing.get_context("spawn").Process(
        target=attack, args=(url, TOKENS, hostile, per_s, os.getpid())
    )
    process.start()
    time.sleep(3)  # until it has begun
    try:
        yield
    finally:
        os.kill(process.pid or 0, signal.SIGTERM)
        process.join()


def attack(url: str, tokens: dict[str, str], hostile: list[bytes], per_s: float, parent: int) -> None:
    """Send pictures at a steady rate until ended."""
    end_with_parent(parent)

    async def forever() -> None:
        strangers = [token for name, token in tokens.items() if name != "robots"]
        async with httpx.AsyncClient(base_url=url, timeout=ANSWER_S, limits=httpx.Limits(max_connections=200)) as http:
            paths = [(token, await opened(http, token, None)) for token in strangers for _ in range(4)]
            under_way = set()
            for number in range(10**9):
                token, path = paths[number % len(paths)]
                task = asyncio.create_task(sent(http, token, path, hostile[number % len(hostile)]))
                under_way.add(task)
                task.add_done_callback(under_way.discard)
                await asyncio.sleep(1 / per_s)

    asyncio.run(forever())


async def sent(http: httpx.AsyncClient, token: str, path: str, content: bytes) -> None:
    """One hostile picture."""
    kind = "image/webp" if content.startswith(b"RIFF") else "image/jpeg"
    headers = {"authorization": f"Bearer {token}", "content-type": kind}
    with suppress(httpx.HTTPError):  # the service may refuse it as it likes
        await http.put(f"{path}/target", content=content, headers=headers)


async def opened(http: httpx.AsyncClient, token: str, target: bytes | None) -> str:
    """The path of a new session, with a target if there is one."""
    headers = {"authorization": f"Bearer {token}"}
    answer = await http.post("/sessions", json={}, headers=headers)
    path = f"/sessions/{answer.raise_for_status().json()['session_id']}"
    if target is not None:
        more = {**headers, "content-type": "image/jpeg"}
        (await http.put(f"{path}/target", content=target, headers=more)).raise_for_status()
    return path


def robot_pictures() -> list[bytes]:
    """What robots see, as JPEG files of 400 x 300 pixels."""
    pictures = np.random.default_rng(0).integers(40, 216, (8, 6, 8, 3), np.uint8).repeat(50, axis=1).repeat(50, axis=2)
    files = []
    for picture in pictures:
        Image.fromarray(picture).save(file := io.BytesIO(), "JPEG", quality=85)
        files.append(file.getvalue())
    return files


@asynccontextmanager
async def by_requests(http: httpx.AsyncClient, url: str, path: str) -> AsyncIterator[Step]:
    """Steps of a session by requests."""

    async def step(picture: bytes) -> None:
        answer = await http.post(f"{path}/steps", content=picture, headers=ROBOTS)
        assert answer.status_code == 200, f"a robot was refused: {answer.status_code} {answer.text}"

    yield step


async def walked(
    url: str, robots: int, every_s: float, seconds: float, stepping: Stepping = by_requests
) -> list[float]:
    """Seconds that each act took of robots that step now and then."""
    files, until = robot_pictures(), time.monotonic() + seconds

    async def walk(number: int, http: httpx.AsyncClient) -> list[float]:
        path, found = await opened(http, TOKENS["robots"], files[number % 8]), list[float]()
        await asyncio.sleep(number * every_s / robots)
        async with stepping(http, url, path) as step:
            while (begun := time.monotonic()) < until:
                await step(files[len(found) % 8])
                found.append(time.monotonic() - begun)
                await asyncio.sleep(max(every_s - found[-1], 0))
        await http.delete(path, headers=ROBOTS)
        return found

    async with httpx.AsyncClient(base_url=url, timeout=ANSWER_S) as http:
        times = await asyncio.gather(*(walk(number, http) for number in range(robots)))
    return [each for robot in times for each in robot]


if __name__ == "__main__":
    main()
