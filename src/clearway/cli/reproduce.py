"""`clearway reproduce` and `clearway report`."""

from __future__ import annotations

import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from clearway.choices import BudgetName, LearnerName, RoomName
from clearway.cli.arguments import check_seeds, scene_files
from clearway.cli.console import print_json, say
from clearway.errors import ClearwayError
from clearway.remote.address import addresses_without_secrets

if TYPE_CHECKING:
    from clearway.experiments.reproduce import Reproduction


@dataclass(frozen=True)
class Reproduce:
    """Redo the paper's tables and figures, with seeds, intervals and exact optima, and judge its claims.

    What is complete in --out is kept, so the same command goes on where it was stopped.

    Example: clearway reproduce all --budget smoke
    """

    names: Annotated[tuple[str, ...], tyro.conf.Positional]
    """Some of table1, fig3, fig4, table2, table3, fig5, fig6, analysis, memory, quality, zones-or-step, shuffles,
    step-size, clipping, zone-time, zone-levels, ablations, across-rooms, perturbed, off-grid, rewards; all: each of
    these; or those of installed packages (clearway plugins)."""
    out: Path = Path("reproduction")
    """Folder of scenes, runs and the report."""
    budget: BudgetName = "smoke"
    """smoke: minutes, to see that it runs. paper: the paper's frames and five seeds, many hours."""
    scenes: Path | None = None
    """Folder of scene files with features, such as the published dumps, instead of the default rooms."""
    rooms: tuple[RoomName, ...] | None = None
    """Which of the default rooms; by default as the budget says."""
    frames: int | None = None
    """Training frames of every learner; by default as the budget says."""
    encoder: str = "auto"
    """For the default rooms, as for clearway scenes build; the published figures were made with random-resnet50."""
    seeds: int | None = None
    """Agents of each kind; by default as the budget says."""
    first_seed: int = 0
    """Of the agents: --seeds 5 --first-seed 5 trains those of seeds 5 to 9, which an answer in hand has not seen."""
    learners: tuple[LearnerName, ...] = ("paper", "default")
    """paper: the paper's settings, synchronous; paper-a3c: asynchronous, far slower; default: the recipe."""
    rewards: tuple[str, ...] = ()
    """Of the experiment rewards, the first against each other one: names as of clearway train --reward, also your own
    as package.module:name; by default shortest, bump, collision-aware. With five seeds three at most."""
    set: tuple[str, ...] = ()
    """Single settings of every learner, for example --set lr_start=0.002 (all: docs/learning.md)."""
    workers: int | None = None
    """Runs side by side; by default one a core, as far as memory allows. A Ray cluster has its own count."""
    threads: int = 1
    """Threads of each run. Results repeat bit for bit at one number of threads."""
    ray: str | None = None
    """Run on Ray: local, auto (a cluster found here) or a cluster's address; --out must be shared by its nodes."""
    json: bool = False
    """Print the report as JSON."""

    def run(self) -> None:
        """Run what is missing, write the report, say where it is."""
        from clearway.rooms.build import check_mujoco

        check_mujoco()
        from clearway.experiments.catalogue import EXPERIMENTS, in_order
        from clearway.experiments.reproduce import ReproduceRequest, reproduce

        check_seeds(first_seed=self.first_seed)
        if not self.names:
            raise ClearwayError(f"no experiment named. Name some of {', '.join(EXPERIMENTS)}, or all")
        names = in_order({*self.names, *(EXPERIMENTS if "all" in self.names else ())} - {"all"})
        request = ReproduceRequest(
            names=names,
            out=self.out,
            budget=self.budget,
            dumps=scene_files((self.scenes,)) if self.scenes else (),
            rooms=self.rooms,
            frames=self.frames,
            encoder=self.encoder,
            seeds=self.seeds,
            first_seed=self.first_seed,
            learners=list(dict.fromkeys(self.learners)),
            rewards=self.rewards or None,
            changes=self.set,
            workers=self.workers,
            threads=self.threads,
            ray=self.ray,
            commands=(shlex.join(["clearway", *map(addresses_without_secrets, sys.argv[1:])]),),
        )
        _write(reproduce(request, show_progress=True, tell=say), self.out, self.json)


@dataclass(frozen=True)
class Report:
    """Write the report of a reproduction anew, from what is complete by now.

    Example: clearway report reproduction
    """

    folder: Annotated[Path, tyro.conf.Positional] = Path("reproduction")
    """The folder that clearway reproduce writes to; it may be at work."""
    json: bool = False
    """Print the report as JSON."""

    def run(self) -> None:
        """Write the report, say where it is."""
        from clearway.rooms.build import check_mujoco

        check_mujoco()
        from clearway.experiments.reproduce import gather

        _write(gather(self.folder), self.folder, self.json)


def _write(found: Reproduction, out: Path, as_json: bool) -> None:
    """Write the report into a folder and say where it is, or print it."""
    from clearway.files import read_json
    from clearway.viz.report import JSON, MARKDOWN
    from clearway.viz.reproduction_report import write_reproduction

    page = write_reproduction(found)
    if as_json:
        print_json(read_json(out / JSON))
    say(f"report: {page} and {out / MARKDOWN}")
