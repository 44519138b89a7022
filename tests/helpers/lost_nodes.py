"""SIGKILL for a node of a Ray cluster while a command works on it: `python -m helpers.lost_nodes FOLDER [NAME ...]`.

A cluster of this machine has three nodes of one processor. Once one of them has been busy for a while it is killed with
all of its processes. A line a command tells what came of it, beside the same command without Ray.
"""

from __future__ import annotations

import hashlib
import os
import secrets
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clearway.learn.checkpoint import newest_checkpoint, read_network
from clearway.learn.run_folder import RunFolder
from helpers.spread_parts import parent_of, runs
from helpers.spreading import folder_of, generated, model, photographs, plan, rooms, unencoded

NODES, BUSY_S, PATIENCE_S = 3, 2.0, 300.0
TASKS = (b"ray::_done_on_node", b"ray::_worker")  # what a worker of ours is called while it does something
SMALL = ["--frames", "20000", "--learners", "paper"]
PPO = ["--frames", "60000", "--set", "envs=20", "rollout_steps=8", "width=16"]

COMMANDS: dict[str, Callable[[Path], list[str]]] = {
    "scenes encode": lambda folder: ["scenes", "encode", *unencoded(folder), "--encoder", "clearway"],
    "scenes build": lambda folder: ["scenes", "build", "--room", "bathroom"],
    "scenes generate": lambda folder: ["scenes", "generate", "--count", "6"],
    "scenes views": lambda folder: ["scenes", "views", generated(folder), "--poses", "1500"],
    "scenes import mjcf": lambda folder: ["scenes", "import", "mjcf", model(folder)],
    "scenes import floor-plan": lambda folder: ["scenes", "import", "floor-plan", plan(folder)],
    "scenes import images": lambda folder: ["scenes", "import", "images", photographs(folder), "--step", "0.5"],
    "train": lambda folder: ["train", *rooms(folder), *PPO, "--threads", "1", "--workers", "2"],
    "reproduce": lambda folder: [
        *("reproduce", "fig5", "--budget", "smoke", "--scenes", folder_of(rooms(folder))),
        *SMALL,
    ],
}
"""What makes a command's words in a folder, without those of Ray and of where it writes."""


@dataclass(frozen=True)
class Outcome:
    """What came of a command: whether a node was killed, its exit code, standard error, seconds, what it made."""

    killed: bool
    code: int
    errors: str
    seconds: float
    made: dict[str, str]


def begun(words: list[str], folder: Path, out: str) -> subprocess.Popen[str]:
    """A command, under way."""
    command = [sys.executable, "-m", "clearway", *words, "--out", str(folder / out)]
    environment = os.environ | {"CLEARWAY_CACHE": str(folder / f"cache of {out}")}
    return subprocess.Popen(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, cwd=folder
    )


def outcome(words: list[str], folder: Path, out: str, kill: Callable[[], bool]) -> Outcome:
    """Of a command, during which `kill` is called until it has killed."""
    start, killed = time.monotonic(), False
    with begun(words, folder, out) as process:
        while process.poll() is None and not killed and time.monotonic() - start < PATIENCE_S:
            killed = kill()
            time.sleep(0.05)
        try:
            _, errors = process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            raise
    seconds = time.monotonic() - start
    return Outcome(killed, process.returncode, errors.strip(), seconds, made_in(folder / out))


def made_in(out: Path) -> dict[str, str]:
    """Digests of the scene files, views and networks in a folder, by name."""
    found = {str(path.relative_to(out)): digest(path.read_bytes()) for path in sorted(out.rglob("*.h5"))}
    for record in sorted(out.rglob("run.json")):
        network = read_network(newest_checkpoint(RunFolder(record.parent).checkpoints))
        weights = b"".join(tensor.numpy().tobytes() for _, tensor in sorted(network.items()))
        found[str(record.parent.relative_to(out))] = digest(weights)
    return found


def digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:12]


class Nodes:
    """A cluster, and who kills a busy node of it."""

    def __init__(self) -> None:
        from ray.cluster_utils import Cluster

        self.cluster: Any = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "include_dashboard": False})
        self.nodes: list[Any] = []
        self.busy_since: dict[Any, float] = {}

    def fill(self) -> None:
        """Let it have all of its nodes."""
        self.busy_since.clear()
        while len(self.nodes) < NODES:
            self.nodes.append(self.cluster.add_node(num_cpus=1))

    def kill(self) -> bool:
        """Kill a node that has been busy for a while; whether there was one."""
        for node in self.nodes:
            if not self._is_busy(node):
                continue
            if time.monotonic() - self.busy_since.setdefault(node, time.monotonic()) >= BUSY_S:
                self.cluster.remove_node(node, allow_graceful=False)
                self.nodes.remove(node)
                return True
        return False

    def _is_busy(self, node: Any) -> bool:
        raylet = node.all_processes["raylet"][0].process.pid
        found = (int(path.name) for path in Path("/proc").glob("[0-9]*"))
        return any(parent_of(pid) == raylet and any(runs(pid, task) for task in TASKS) for pid in found)


def told(name: str, here: Outcome, there: Outcome) -> str:
    """A line of the table."""
    same = "the same" if there.made == here.made and here.made else f"{there.made} instead of {here.made}"
    last = there.errors.splitlines()[-1] if there.code else ""
    return f"| `{name}` | {here.seconds:.0f} | {there.seconds:.0f} | {there.killed} | {there.code} | {same} | {last} |"


def main() -> None:
    """Try the commands one after the other; ends with 1 where one did not come to the same."""
    root, names = Path(sys.argv[1]), sys.argv[2:] or list(COMMANDS)
    os.environ.update(RAY_USAGE_STATS_ENABLED="0", RAY_AUTH_MODE="token", RAY_AUTH_TOKEN=secrets.token_hex(16))
    os.environ.update(PYTHONPATH=os.pathsep.join(filter(None, sys.path)), CLEARWAY_CACHE=str(root / "cache of nodes"))
    nodes, wrong = Nodes(), 0
    try:
        print("| command | here, s | on Ray, s | killed | exit code | made | said |\n|---|---|---|---|---|---|---|")
        for name in names:
            folder = root / name.replace(" ", "-")
            folder.mkdir(parents=True)
            nodes.fill()
            words = COMMANDS[name](folder)
            here = outcome(words, folder, "here", lambda: True)
            there = outcome([*words, "--ray", nodes.cluster.address], folder, "there", nodes.kill)
            print(told(name, here, there), flush=True)
            wrong += not (there.killed and there.code == 0 and there.made == here.made)
    finally:
        nodes.cluster.shutdown()
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
