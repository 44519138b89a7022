"""Training by several workers: frames/s beside one process, bytes and seconds of communication, and a model of both.

    python benchmarks/scaling.py                        # 1 and 2 workers, 2, 20 and 200 scenes; some minutes
    python benchmarks/scaling.py --scenes 20 --links    # as root: also over slow links, in network namespaces
    python benchmarks/scaling.py --scenes 2 --set envs_by=scenes    # other settings of the learner

Scenes are generated rooms with 2,048 made-up features a state, 400 environments in all; more than 20 scenes share a
head. Repeats of one process with two threads, and of one and two workers of a thread each, take turns in one run.

The model. An update of n workers takes

    s = compute / n + messages (overhead + hops latency) + bytes (copying + 2 (n - 1) / n / bandwidth)

with hops = 2 (n - 1) of a ring that adds up, n - 1 of one that gathers. Compute is one worker's update; overhead and
copying are fitted to messages of 1 and of 4 million numbers between two workers of this machine; latency and bandwidth
are those that TCP has on the link. Nothing is fitted to the runs over slow links, against which it is checked. It knows
of no worker that has more to do than others, and of no switch that all share.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from limited_network import DEVICE, limited_network, measured

from clearway.learn.provenance import hardware, package_versions

WORKER = Path(__file__).with_name("scaling_worker.py")
LINKS = ((1000.0, 0.2), (100.0, 5.0))  # Mbit/s, ms one way
LARGE = 4_194_304  # numbers of the first layer's gradient
MACHINES = (4, 16, 64, 256)
SENT = {"float32": 1.0, "bfloat16": 0.5}  # and the share of the bytes
NETWORKS = {"10 Gbit/s, 0.05 ms": (10_000.0, 0.05), "1 Gbit/s, 0.2 ms": LINKS[0], "100 Mbit/s, 5 ms": LINKS[1]}


class Workers:
    """Processes that train one agent together, or one that trains alone.

    Args:
        scenes: how many they train on.
        count: of processes.
        threads: of each.
        settings: of the learner, changed.
        prefixes: what is put before the command of each.
    """

    def __init__(
        self,
        scenes: int,
        count: int,
        threads: int = 1,
        settings: dict[str, object] | None = None,
        prefixes: Sequence[list[str]] = (),
    ) -> None:
        self.folder = tempfile.TemporaryDirectory()
        store, device = str(Path(self.folder.name, "store")), DEVICE if prefixes else "lo"
        common = ["--scenes", scenes, "--workers", count, "--threads", threads, "--store", store]
        command = [sys.executable, str(WORKER), *map(str, common), "--set", json.dumps(settings or {})]
        self.processes = [
            subprocess.Popen(
                [
                    *(prefixes[rank] if prefixes else []),
                    "env",
                    f"GLOO_SOCKET_IFNAME={device}",
                    *command,
                    "--rank",
                    str(rank),
                ],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
            for rank in range(count)
        ]
        for process in self.processes:
            self._answer(process)  # it is ready

    def ask(self, what: str, number: int) -> list[dict[str, float]]:
        """What every process answers."""
        for process in self.processes:
            assert process.stdin is not None
            process.stdin.write(f"{what} {number}\n")
            process.stdin.flush()
        return [self._answer(process) for process in self.processes]

    def close(self) -> None:
        """End them."""
        for process in self.processes:
            process.communicate()
        self.folder.cleanup()

    @staticmethod
    def _answer(process: subprocess.Popen[str]) -> dict[str, float]:
        assert process.stdout is not None
        line = process.stdout.readline()
        if not line:
            raise SystemExit(f"a worker ended with exit code {process.wait()}")
        return json.loads(line)


@contextmanager
def workers(*args: object, **options: object) -> Iterator[Workers]:
    """`Workers` that end with the block."""
    made = Workers(*args, **options)  # type: ignore[arg-type]
    try:
        yield made
    finally:
        made.close()


@dataclass(frozen=True)
class Update:
    """An update of some workers: medians over repeats; bytes of each, `talk_s` of the one that waits least.

    Attributes:
        frames_per_s, s: of all workers.
        messages, gathered, bytes: of which `gathered` add nothing up.
        talk_s: seconds of communication, without waiting for a slower worker.
    """

    frames_per_s: float
    s: float
    messages: float = 0.0
    gathered: float = 0.0
    bytes: float = 0.0
    talk_s: float = 0.0

    @classmethod
    def of(cls, repeats: Sequence[list[dict[str, float]]], updates: int) -> Update:
        """Of what the workers answered in each repeat."""
        longest = [max(worker["s"] for worker in one) for one in repeats]
        rate = statistics.median(one[0]["frames"] / s for one, s in zip(repeats, longest, strict=True))
        talk_s = statistics.median(min(worker["waited_s"] for worker in one) for one in repeats)
        last = repeats[-1][0]
        messages, gathered, size = (last[name] / updates for name in ("messages", "gathered", "bytes"))
        return cls(rate, statistics.median(longest) / updates, messages, gathered, size, talk_s / updates)


@dataclass(frozen=True)
class Model:
    """See the top of this file. Bandwidth is bytes/s, seconds all else."""

    overhead_s: float
    copying_s: float

    def talk_s(self, update: Update, count: int, latency_s: float = 0.0, bytes_per_s: float = float("inf")) -> float:
        """Seconds of communication of an update of so many workers."""
        hops = 2 * (count - 1) * (update.messages - update.gathered) + (count - 1) * update.gathered
        share = 2 * (count - 1) / count
        return (
            update.messages * self.overhead_s + hops * latency_s + update.bytes * (self.copying_s + share / bytes_per_s)
        )


def compared(scenes: int, updates: int, repeats: int, settings: dict[str, object]) -> tuple[dict[str, Update], Model]:
    """One process with two threads, one worker and two workers, turn by turn."""
    with ExitStack() as stack:
        cases = {
            "one process, two threads": stack.enter_context(workers(scenes, 1, 2, settings)),
            "one worker": stack.enter_context(workers(scenes, 1, 1, settings)),
            "two workers": stack.enter_context(workers(scenes, 2, 1, settings)),
        }
        for case in cases.values():
            case.ask("train", 2)
        answers: dict[str, list[list[dict[str, float]]]] = {name: [] for name in cases}
        for _ in range(repeats):
            for name, case in cases.items():
                answers[name].append(case.ask("train", updates))
        times = {
            size: statistics.median(cases["two workers"].ask("send", size)[0]["s"] for _ in range(15))
            for size in (1, LARGE)
        }
    model = Model(times[1], (times[LARGE] - times[1]) / (4 * LARGE))
    return {name: Update.of(found, updates) for name, found in answers.items()}, model


def over_links(scenes: int, updates: int) -> Iterator[tuple[str, float, float, Update]]:
    """Two workers over each link, with the bandwidth (bytes/s) and latency (s) that TCP has on it."""
    for mbit_per_s, latency_ms in LINKS:
        with limited_network(mbit_per_s, latency_ms) as prefixes:
            rate, one_way_ms = measured(prefixes)
            for sent in SENT:
                with workers(scenes, 2, 1, {"sent_gradients": sent}, prefixes) as two:
                    two.ask("train", 1)
                    update = Update.of([two.ask("train", updates) for _ in range(2)], updates)
                yield f"{mbit_per_s:g} Mbit/s, {latency_ms:g} ms | {sent}", rate * 1e6 / 8, one_way_ms / 1e3, update


def print_links(scenes: int, updates: int, compute_s: float, model: Model) -> dict[str, dict[str, float]]:
    """The model beside what was measured; returns both."""
    print(f"\n{scenes} scenes, two workers\n\n| link | sent | TCP's Mbit/s, ms | MB | s an update | model | off by |")
    print("|" + "---|" * 7)
    found = {}
    for name, bytes_per_s, latency_s, one in over_links(scenes, updates):
        modelled = compute_s + model.talk_s(one, 2, latency_s, bytes_per_s)
        shown = (
            f"{bytes_per_s * 8e-6:.0f}, {1e3 * latency_s:.2f} | {one.bytes / 1e6:.1f} | {one.s:.2f} | {modelled:.2f}"
        )
        print(f"| {name} | {shown} | {100 * (modelled / one.s - 1):+.0f} % |", flush=True)
        told = {"modelled_s": modelled, "tcp_bytes_per_s": bytes_per_s, "tcp_latency_s": latency_s}
        found[name] = {**asdict(one), **told}
    return found


def print_machines(compute_s: float, frames: float, update: Update, model: Model) -> None:
    """What the model says of many machines: one batch divided among them, and a batch that grows with them."""
    print(
        "\n400 environments in all: s an update, times as fast; 400 a machine: frames/s, efficiency; what costs most\n"
    )
    print("| network | sent | machines | s | times | frames/s | efficiency | most |\n|" + "---|" * 8)
    for name, (mbit_per_s, latency_ms) in NETWORKS.items():
        for sent, share in SENT.items():
            each = replace(update, bytes=share * update.bytes)
            for count in MACHINES:
                bytes_per_s = mbit_per_s * 1e6 / 8
                talk_s = model.talk_s(each, count, latency_ms / 1e3, bytes_per_s)
                by_bytes_s = model.talk_s(each, count, 0.0, bytes_per_s)
                divided_s, grown_s = compute_s / count + talk_s, compute_s + talk_s
                most = "compute" if talk_s < compute_s else "bytes" if by_bytes_s > talk_s / 2 else "latency"
                shown = f"{divided_s:.2f} | {compute_s / divided_s:.2f} | {frames * count / grown_s:,.0f}"
                print(f"| {name} | {sent} | {count} | {shown} | {100 * compute_s / grown_s:.0f} % | {most} |")


def main() -> None:
    """Measure and print tables in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, nargs="+", default=[2, 20, 200])
    parser.add_argument("--updates", type=int, default=2, help="of a repeat")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--links", action="store_true", help="also over slow links; as root")
    parser.add_argument("--set", nargs="+", default=[], help="settings of the learner, such as envs_by=scenes")
    parser.add_argument("--json", type=Path, help="write all figures here")
    given = parser.parse_args()
    record: dict[str, object] = {"hardware": hardware(), "versions": package_versions()}
    print("| scenes | case | frames/s | s an update | MB | messages | s of communication | model |\n|" + "---|" * 8)
    for scenes in given.scenes:
        updates, model = compared(scenes, given.updates, given.repeats, dict(pair.split("=") for pair in given.set))
        for name, one in updates.items():
            talk = "||||"
            if one.messages:
                modelled = model.talk_s(one, 2)
                talk = f"{one.bytes / 1e6:.1f} | {one.messages:.0f} | {one.talk_s:.3f} | {modelled:.3f} |"
            print(f"| {scenes} | {name} | {one.frames_per_s:,.0f} | {one.s:.3f} | {talk}", flush=True)
        record[f"{scenes} scenes"] = {name: asdict(one) for name, one in updates.items()}
    print(f"\na message costs {1e3 * model.overhead_s:.2f} ms and {1e9 * model.copying_s:.2f} ns a byte here")
    one, two = updates["one worker"], updates["two workers"]
    if given.links:
        record["links"] = print_links(given.scenes[-1], given.updates, two.s - two.talk_s, model)
    print_machines(one.s, one.s * one.frames_per_s, two, model)
    if given.json:
        given.json.write_text(json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
