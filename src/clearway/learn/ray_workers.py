"""Processes of a Ray cluster train one agent: placed and watched by Ray, started again where one or its node is lost.

What each does is the same as on one machine (`workers.trained`). They meet at a store of the process that started them.
All nodes see the run folder and the scene files under the same paths, and have the same versions.
"""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import torch

from clearway.errors import RunError
from clearway.learn.interruption import interruption
from clearway.learn.peers import LostPeer
from clearway.learn.progress import progress_view
from clearway.learn.provenance import package_versions
from clearway.learn.run_folder import RunFolder
from clearway.learn.workers import INTERRUPTED, PATIENCE, RESTARTS, Place, Task, given_up, trained
from clearway.ray_cluster import connected
from clearway.spread.messages import from_message, to_message

if TYPE_CHECKING:
    from clearway.learn.progress import ProgressView

ROOM_S = 30.0  # for the cluster to find room for all workers
GRACE_S = 60.0  # for workers to end when they are told to: they save a checkpoint first
LOOKS_EVERY_S = 0.5
SAME = ("python", "clearway", "torch", "numpy")  # versions that all nodes agree in


def launched_on_ray(task: Task, workers: int, address: str) -> list[str | None]:
    """What `workers.trained` gave in each process.

    Args:
        task: what each is to do.
        workers: how many.
        address: of the cluster, see `ray_cluster.connected`.

    Raises:
        RunError: Ray or the cluster cannot be reached, has no room, or workers were lost more than `RESTARTS` times.
    """
    with connected(address, workers * task.threads) as ray, interruption() as interrupted:
        message = ray.put(to_message(task))
        for restarts in range(RESTARTS + 1):
            crew = _Crew(ray, message, task, workers, restarts)
            try:
                with progress_view(task.request.learner.frames, task.show_progress) as view:
                    outcomes = crew.outcomes(interrupted, view)
            finally:
                crew.end()
            if outcomes is not None:
                return outcomes
        raise given_up(task, crew.lost)


class _Crew:
    """All workers, started together once."""

    def __init__(self, ray: Any, message: Any, task: Task, workers: int, restarts: int) -> None:
        import torch.distributed as dist
        from ray.util.scheduling_strategies import PlacementGroupSchedulingStrategy

        self.ray, self.task, self.lost = ray, task, "no reason is known"
        resources = {"CPU": task.threads} | ({"GPU": 1} if torch.device(task.request.device).type == "cuda" else {})
        self.room = ray.util.placement_group([resources] * workers, strategy="SPREAD")
        if not self.room.wait(ROOM_S):
            ray.util.remove_placement_group(self.room)
            told = " and ".join(f"{count} {name}" for name, count in resources.items())
            problem = f"the Ray cluster has no room for {workers} workers of {told} each within {ROOM_S:.0f} s"
            raise RunError(f"{problem}. Give fewer --workers or --threads, or add nodes")
        self.store = dist.TCPStore("0.0.0.0", 0, is_master=True, wait_for_workers=False, timeout=PATIENCE)
        meets = ray.util.get_node_ip_address(), self.store.port
        remote = ray.remote(num_cpus=task.threads, num_gpus=resources.get("GPU", 0), max_retries=0)(_worker)
        self.under_way = []
        for rank in range(workers):
            placed = PlacementGroupSchedulingStrategy(self.room, placement_group_bundle_index=rank)
            place = Place(rank, workers, 0, restarts)
            started = remote.options(scheduling_strategy=placed)
            self.under_way.append(started.remote([message], place, meets, _versions(package_versions())))

    def outcomes(self, interrupted: Any, view: ProgressView) -> list[str | None] | None:
        """What each gave; None where one was lost."""
        left, found, told_to_stop, deadline = list(self.under_way), {}, False, float("inf")
        while left:
            done, left = self.ray.wait(left, num_returns=1, timeout=LOOKS_EVERY_S)
            for reference in done:
                try:
                    found[reference] = self.ray.get(reference)
                except self.ray.exceptions.TaskCancelledError:
                    found[reference] = INTERRUPTED
                except (LostPeer, self.ray.exceptions.RayError) as error:
                    self.lost = str(error).strip().splitlines()[0]
                    return None
                if found[reference] not in (None, INTERRUPTED):  # its words; the others may be waiting for it
                    return [found[reference]]
            self._show(view)
            if interrupted.is_set() and not told_to_stop:
                told_to_stop, deadline = True, time.monotonic() + GRACE_S
                for reference in left:
                    self.ray.cancel(reference, force=False)
            if time.monotonic() > deadline:
                return [INTERRUPTED]
        return [found[reference] for reference in self.under_way]

    def _show(self, view: ProgressView) -> None:
        """How far training has come, by its last row of metrics; nothing where they cannot be read now."""
        if not self.task.show_progress:
            return
        with suppress(RunError):  # the next look may see more; the training itself goes on
            if rows := RunFolder(self.task.out).metrics():
                targets = sum(len(states) for states in self.task.request.targets.values())
                view.show(int(rows[-1]["frames"]), int(rows[-1]["solved_targets"]), targets)

    def end(self) -> None:
        """End those that are left, and give their room back."""
        for reference in self.under_way:
            self.ray.cancel(reference, force=True)
        self.ray.wait(self.under_way, num_returns=len(self.under_way), timeout=GRACE_S)
        self.ray.util.remove_placement_group(self.room)


def _versions(found: Mapping[str, str]) -> dict[str, str]:
    return {name: found[name] for name in SAME}


def _worker(message: list[Any], place: Place, meets: tuple[str, int], versions: Mapping[str, str]) -> str | None:
    """Train in a process of a node; returns what `trained` does."""
    import ray
    import torch.distributed as dist

    own = _versions(package_versions())
    other = [f"{name} {own[name]} instead of {versions[name]}" for name in SAME if own[name] != versions[name]]
    if other:
        node = ray.util.get_node_ip_address()
        return f"the Ray node {node} has {', '.join(other)}. Install the same there"
    task: Task = from_message(ray.get(message[0]))
    if not task.out.is_dir():
        return (
            f"{task.out}: not there on the Ray node {ray.util.get_node_ip_address()}. Give an --out that all nodes see"
        )
    os.environ.pop("GLOO_SOCKET_IFNAME", None)
    try:
        store = dist.TCPStore(*meets, is_master=False, timeout=PATIENCE)
    except RuntimeError as error:
        raise LostPeer(str(error)) from error
    return trained(task, place, store)
