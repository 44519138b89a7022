"""Processes of a Ray cluster do one task together, placed and watched by Ray; all start again where one is lost.

What each does is the same as on one machine (`crew.done_by`). They meet at a store of the process that started them.
All nodes see the task's folder and the files that it reads under the same paths, and have the same versions.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from typing import Any

import torch

from clearway.errors import ClearwayError, RunError
from clearway.learn.crew import INTERFACE, INTERRUPTED, PATIENCE, RESTARTS, Place, Task, done_by, given_up
from clearway.learn.interruption import interruption
from clearway.learn.peers import LostPeer
from clearway.learn.provenance import package_versions
from clearway.ray_cluster import connected
from clearway.remote.records import take_records
from clearway.spread.messages import from_message, to_message

ROOM_S = 30.0  # for the cluster to find room for all workers
GRACE_S = 60.0  # for workers to end when they are told to: they save a checkpoint first
MISSING_S = 5.0  # for workers that miss another to end by themselves
LOOKS_EVERY_S = 0.5
SAME = ("python", "clearway", "torch", "numpy")  # versions that all nodes agree in


def launched_on_ray(task: Task, workers: int, address: str) -> list[str | None]:
    """What `crew.done_by` gave in each process.

    Args:
        task: what each is to do.
        workers: how many.
        address: of the cluster, see `ray_cluster.connected`.

    Raises:
        RunError: Ray or the cluster cannot be reached, has no room, or workers were lost more than `RESTARTS` times.
    """
    with connected(address, workers * task.threads) as ray, interruption(of_several=True) as interrupted:
        message = ray.put(to_message(task))
        for restarts in range(RESTARTS + 1):
            crew = _Crew(ray, message, task, workers, restarts)
            try:
                with task.watched() as look:
                    outcomes = crew.outcomes(interrupted, look)
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

        self.ray, self.lost = ray, "no reason is known"
        resources = {"CPU": task.threads} | ({"GPU": 1} if torch.device(task.device).type == "cuda" else {})
        self.room = ray.util.placement_group([resources] * workers, strategy="SPREAD")
        if not self.room.wait(ROOM_S):
            ray.util.remove_placement_group(self.room)
            told = " and ".join(f"{count} {name}" for name, count in resources.items())
            problem = f"the Ray cluster has no room for {workers} workers of {told} each within {ROOM_S:.0f} s"
            raise RunError(f"{problem}. Give fewer --workers or --threads, or add nodes")
        self.store = dist.TCPStore("0.0.0.0", 0, is_master=True, wait_for_workers=False, timeout=PATIENCE)
        meets = ray.util.get_node_ip_address(), self.store.port
        options = {"num_cpus": task.threads, "num_gpus": resources.get("GPU", 0), "max_retries": 0}
        remote = ray.remote(max_calls=1, **options)(_worker)  # a process meets the others once
        self.under_way = []
        for rank in range(workers):
            placed = PlacementGroupSchedulingStrategy(self.room, placement_group_bundle_index=rank)
            place = Place(rank, workers, 0, restarts)
            started = remote.options(scheduling_strategy=placed)
            self.under_way.append(started.remote([message], place, meets, _versions(package_versions())))

    def outcomes(self, interrupted: Any, look: Callable[[], None]) -> list[str | None] | None:
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
                    raised = isinstance(error, self.ray.exceptions.RayTaskError)  # with the worker's whole traceback
                    self.lost = str(error).strip().splitlines()[-1 if raised else 0]
                    return None
                if found[reference] not in (None, INTERRUPTED):  # its words; the others may be waiting for it
                    return [found[reference]]
            look()
            if interrupted.is_set() and not told_to_stop:
                told_to_stop, deadline = True, time.monotonic() + GRACE_S
                for reference in left:
                    self.ray.cancel(reference, force=False)
            if time.monotonic() > deadline:
                return [INTERRUPTED]
        return [found[reference] for reference in self.under_way]

    def end(self) -> None:
        """End those that are left, and give their room back.

        Where another was lost they are just ending by themselves, and Ray 2.60 dies of a task that is cancelled while
        its answer comes ("Tried to complete task that was not pending", see its issue 54846). All are waited for.
        """
        count = len(self.under_way)
        _, left = self.ray.wait(self.under_way, num_returns=count, timeout=MISSING_S)
        for reference in left:
            self.ray.cancel(reference, force=True)
        self.ray.wait(self.under_way, num_returns=count, timeout=GRACE_S)
        self.ray.util.remove_placement_group(self.room)


def _versions(found: Mapping[str, str]) -> dict[str, str]:
    return {name: found[name] for name in SAME}


def _worker(message: list[Any], place: Place, meets: tuple[str, int], versions: Mapping[str, str]) -> str | None:
    """Do the task in a process of a node; returns what `done_by` does."""
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
    try:
        take_records(task.records)
    except ClearwayError as error:
        return f"{error}, on the Ray node {ray.util.get_node_ip_address()}"
    os.environ.pop(INTERFACE, None)
    try:
        store = dist.TCPStore(*meets, is_master=False, timeout=PATIENCE)
    except RuntimeError as error:
        raise LostPeer(str(error)) from error
    return done_by(task, place, store)
