"""`clearway pretrain`."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from clearway.choices import TrackerName
from clearway.cli.console import say


@dataclass(frozen=True)
class Pretrain:
    """Train eyes, the encoder of one's own, on views of many rooms; see clearway scenes views.

    Afterwards --encoder takes the folder's name.

    Example: clearway pretrain views --out eyes --try-on views-validation
    """

    views: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Views with rgb and depth, two takes of each pose: folders or files."""
    out: Path
    """The folder for the eyes."""
    pictures: int = 2_000_000
    """To learn from in all; views that are seen again count again."""
    seed: int = 0
    """Of the first parameters and of all chances."""
    keeping: str | None = None
    """Eyes, clearway or a folder, whose features stay as they are: only what is told from them is taught, for
    example on rooms like your own. By default all is taught, from nothing."""
    try_on: tuple[Path, ...] = ()
    """Views of other rooms, to try the eyes on once they are trained."""
    threads: int | None = None
    """Threads of torch. Results repeat bit for bit at one number of threads."""
    workers: int = 1
    """Processes that train together, each on its part of every batch. The eyes are those of one, up to
    rounding. One that dies is replaced. See docs/scale.md."""
    ray: str | None = None
    """Where these run: local, auto (a cluster found here) or a Ray cluster's address, whose nodes see the same files;
    by default on this machine."""
    device: str = "cpu"
    """cpu or cuda."""
    track: TrackerName | None = None
    """Show figures elsewhere as they come: tensorboard, in --out; wandb, offline unless you are logged in. Needs the
    extra of that name; by default metrics.jsonl in --out alone."""
    resume: bool = False
    """Go on with the training in --out from its newest checkpoint."""
    json: bool = False
    """Print what they can do as JSON."""

    def run(self) -> None:
        """Train, and try."""
        from clearway.api.pretraining import pretrain

        found = pretrain(
            self.views,
            out=self.out,
            pictures=self.pictures,
            seed=self.seed,
            keeping=self.keeping,
            try_on=self.try_on,
            threads=self.threads,
            workers=self.workers,
            ray=self.ray,
            device=self.device,
            resume=self.resume,
            track=self.track,
            show_progress=True,
        )
        figures = {} if found is None else found.to_json()
        if self.json:
            print(json.dumps({"eyes": str(self.out), **figures}, indent=2))
            return
        say(f"{self.out}: eyes trained, for --encoder {self.out}")
        for name, value in figures.items():
            print(f"  {name.replace('_', ' '):16} {value:.3g}")
