"""Two network namespaces of this machine, joined by a link of a given bandwidth and latency; needs root and iproute2.

    python benchmarks/limited_network.py 1000 0.2     # Mbit/s and ms one way: what TCP makes of such a link

Where the kernel has no `netem`, nothing of Linux delays packets. So the link is this process: each namespace has a TUN
device, and every packet that one of them sends is given to the other when the link would have passed it on, after the
packets before it, its own length over the bandwidth, and the latency. No packet is lost.
"""

from __future__ import annotations

import argparse
import fcntl
import os
import select
import socket
import struct
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 0x0001, 0x1000  # linux/if_tun.h
NAMES, DEVICE = ("clearway0", "clearway1"), "cw0"
MTU = 16_000  # bytes; with Ethernet's 1,500 this process would be slower than the link
NETWORK = "10.213.77"


class Direction:
    """Packets under way from one device to the other.

    Args:
        source, sink: the devices.
        bytes_per_s, latency_s: of the link.
    """

    def __init__(self, source: int, sink: int, bytes_per_s: float, latency_s: float) -> None:
        self.source, self.sink = source, sink
        self.bytes_per_s, self.latency_s = bytes_per_s, latency_s
        self.under_way: deque[tuple[float, bytes]] = deque()
        self.free_at = 0.0  # when the last packet has left

    def take(self) -> None:
        """Take the packet that is there."""
        packet = os.read(self.source, MTU + 100)
        self.free_at = max(self.free_at, time.perf_counter()) + len(packet) / self.bytes_per_s
        self.under_way.append((self.free_at + self.latency_s, packet))

    def give(self) -> None:
        """Give on what is due."""
        while self.under_way and self.under_way[0][0] <= time.perf_counter():
            os.write(self.sink, self.under_way.popleft()[1])

    def due_s(self) -> float:
        """Seconds until the next packet is due; many where there is none."""
        return self.under_way[0][0] - time.perf_counter() if self.under_way else 1.0


@contextmanager
def limited_network(mbit_per_s: float, latency_ms: float) -> Iterator[tuple[list[str], list[str]]]:
    """What to put before a command, for each of the two namespaces, in which `DEVICE` is the link's end."""
    devices = [_device(f"cwtun{number}") for number in range(2)]
    made: list[str] = []
    stop, passing = threading.Event(), None
    try:
        for number, name in enumerate(NAMES):
            _run("ip", "netns", "add", name)
            made.append(name)
            _run("ip", "link", "set", f"cwtun{number}", "netns", name)
            inside = ("ip", "-n", name)
            _run(*inside, "link", "set", f"cwtun{number}", "name", DEVICE)
            _run(*inside, "addr", "add", f"{NETWORK}.{number + 1}/24", "dev", DEVICE)
            _run(*inside, "link", "set", "lo", "up")
            _run(*inside, "link", "set", DEVICE, "mtu", str(MTU), "up")
        link = (mbit_per_s * 1e6 / 8, latency_ms / 1e3)
        ways = [Direction(devices[a], devices[1 - a], *link) for a in (0, 1)]
        passing = threading.Thread(target=_pass_on, args=(ways, stop))
        passing.start()
        yield (["ip", "netns", "exec", NAMES[0]], ["ip", "netns", "exec", NAMES[1]])
    finally:
        stop.set()
        if passing is not None:
            passing.join()
        for name in made:
            _run("ip", "netns", "del", name)
        for device in devices:
            os.close(device)


def _pass_on(ways: list[Direction], stop: threading.Event) -> None:
    by_source = {way.source: way for way in ways}
    while not stop.is_set():
        wait_s = max(0.0, min(way.due_s() for way in ways))
        ready, _, _ = select.select(list(by_source), [], [], min(wait_s, 0.1))
        for source in ready:
            by_source[source].take()
        for way in ways:
            way.give()


def _device(name: str) -> int:
    device = os.open("/dev/net/tun", os.O_RDWR)
    fcntl.ioctl(device, TUNSETIFF, struct.pack("16sH", name.encode(), IFF_TUN | IFF_NO_PI))
    return device


def _run(*command: str) -> None:
    subprocess.run(command, check=True)


def measured(commands: tuple[list[str], list[str]]) -> tuple[float, float]:
    """Mbit/s of TCP one way, and ms of a small message one way, on a link."""
    there, here = (
        [*command, sys.executable, __file__, role]
        for command, role in zip(commands, ("--answer", "--ask"), strict=True)
    )
    with subprocess.Popen(there, stdout=subprocess.PIPE, text=True) as answering:
        assert answering.stdout is not None
        answering.stdout.readline()  # it listens
        told = subprocess.run(here, check=True, capture_output=True, text=True).stdout.split()
    return float(told[0]), float(told[1])


PORT, SMALL, LARGE = 5201, 200, 32 * 1024**2


def answer() -> None:
    """Send small messages back, and a large one's last byte."""
    with socket.create_server((f"{NETWORK}.1", PORT)) as server:
        print("listening", flush=True)
        link, _ = server.accept()
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for _ in range(SMALL):
            link.sendall(link.recv(1))
        for _ in range(2):
            left = LARGE
            while left:
                left -= len(link.recv(min(left, 1024**2)))
            link.sendall(b"x")


def ask() -> None:
    """Print Mbit/s of the second large message (the first opens TCP's window) and ms of a small one, one way."""
    with socket.create_connection((f"{NETWORK}.1", PORT)) as link:
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        started = time.perf_counter()
        for _ in range(SMALL):
            link.sendall(b"x")
            link.recv(1)
        one_way_s = (time.perf_counter() - started) / SMALL / 2
        for _ in range(2):
            started = time.perf_counter()
            link.sendall(bytes(LARGE))
            link.recv(1)
            seconds = time.perf_counter() - started
    print(LARGE * 8e-6 / (seconds - 2 * one_way_s), 1e3 * one_way_s)


def main() -> None:
    """Make a link and measure it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mbit_per_s", type=float, nargs="?", default=1000)
    parser.add_argument("latency_ms", type=float, nargs="?", default=0.2)
    parser.add_argument("--answer", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--ask", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.answer:
        answer()
    elif given.ask:
        ask()
    else:
        with limited_network(given.mbit_per_s, given.latency_ms) as commands:
            rate, one_way_ms = measured(commands)
        print(f"{rate:.0f} Mbit/s, {one_way_ms:.2f} ms one way")


if __name__ == "__main__":
    main()
