"""The workers of `workers` on a Ray cluster: an actor each. When one is lost, all start again, where there is room.

They meet at a store that the first of them opens. Between nodes there is no password and no encryption.
"""

from __future__ import annotations

import socket
from typing import Any

import torch

from clearway.errors import RunError
from clearway.learn.peers import LostPeer
from clearway.learn.workers import PATIENCE, RESTARTS, Place, Task, given_up, trained
from clearway.ray_cluster import connected

ROOM_S = 60.0  # for the cluster to have room for all workers


def launched_on_ray(task: Task, workers: int, address: str) -> list[str | None]:
    """What `trained` gave at each worker.

    Raises:
        RunError: Ray is not installed, the cluster cannot be reached or has no room, or workers were lost again and
            again.
    """
    with connected(address, workers * task.threads) as ray:
        needs: dict[str, float] = {"CPU": task.threads}
        if torch.device(task.request.device).type == "cuda":
            needs["GPU"] = 1
        group = ray.util.placement_group([needs] * workers, strategy="PACK")
        try:
            if not group.wait(ROOM_S):
                what = " and ".join(f"{count:g} {kind}" for kind, count in needs.items())
                problem = f"--ray {address}: no room for {workers} workers of {what} each within {ROOM_S:.0f} s"
                raise RunError(f"{problem}. Give fewer --workers or --threads, or add nodes")
            return _kept_going(ray, task, workers, group, needs)
        finally:
            ray.util.remove_placement_group(group)


def _kept_going(ray: Any, task: Task, workers: int, group: Any, needs: dict[str, float]) -> list[str | None]:
    """The outcomes of the first try in which no worker is lost."""
    task_there = ray.put(task)
    reason = ""
    for restarts in range(RESTARTS + 1):
        actors = [
            ray.remote(_Worker)
            .options(
                num_cpus=needs["CPU"],
                num_gpus=needs.get("GPU", 0),
                scheduling_strategy=ray.util.scheduling_strategies.PlacementGroupSchedulingStrategy(group, bundle),
            )
            .remote()
            for bundle in range(workers)
        ]
        try:
            port = ray.get(actors[0].opens_store.remote())
            host = ray.get(actors[0].host.remote())
            places = [Place(rank, workers, 0, restarts) for rank in range(workers)]
            return ray.get([a.train.remote(task_there, p, host, port) for a, p in zip(actors, places, strict=True)])
        except ray.exceptions.RayTaskError as error:
            if not isinstance(error.cause, LostPeer):
                raise
            reason = str(error.cause)
        except ray.exceptions.RayError as error:
            reason = str(error).strip().splitlines()[0]
        finally:
            for actor in actors:
                ray.kill(actor)
    raise given_up(task, reason)


class _Worker:
    """A process of a node."""

    def host(self) -> str:
        """Where this node is reached by the others."""
        import ray

        return str(ray.util.get_node_ip_address())

    def opens_store(self) -> int:
        """Open the store where all meet; returns its port."""
        import torch.distributed as dist

        with socket.socket() as free:
            free.bind(("", 0))
            port = int(free.getsockname()[1])
        self.store = dist.TCPStore("0.0.0.0", port, is_master=True, wait_for_workers=False, timeout=PATIENCE)
        return port

    def train(self, task: Task, place: Place, host: str, port: int) -> str | None:
        """What `trained` gives."""
        import torch.distributed as dist

        try:
            store = dist.TCPStore(host, port, is_master=False, timeout=PATIENCE)
        except RuntimeError as error:
            raise LostPeer(f"worker {place.rank} does not reach {host}:{port} ({error})") from error
        return trained(task, place, store)
