"""`clearway demo`."""

from __future__ import annotations

import shlex
import shutil
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from clearway.cli.arguments import check_seeds
from clearway.cli.console import print_json, say, stdout_console


@dataclass(frozen=True)
class Demo:
    """See it all at once: build a bathroom, train both rewards, evaluate, and make a page of pictures.

    Example: clearway demo --out demo
    """

    out: Path = Path("demo")
    """Folder for the scene, the two runs, the pictures and index.html; a new demo replaces an older one there."""
    seed: int = 0
    """Of the agents; the room is the default bathroom."""
    frames: int = 600_000
    """Training frames of each agent."""
    room_seed: int = 0
    """Of a room in which the generalist, which comes with clearway, walks before anything is trained."""
    encoder: str = "auto"
    """As for clearway scenes build."""
    all: bool = False
    """Print a row for each way of acting, and for the exact optima; by default for both agents, a random walk and
    shortest paths. evaluation.md in the folder holds all."""
    json: bool = False
    """Print the evaluations as JSON instead of a table."""

    def run(self) -> None:
        """Run the demo."""
        from clearway.examples.contrast import contrast
        from clearway.experiments.demo import DemoRequest, run_demo
        from clearway.viz.demo_page import make_demo_page

        check_seeds(seed=self.seed, room_seed=self.room_seed)
        request = DemoRequest(self.out, self.seed, self.frames, self.encoder, self.room_seed)
        with TemporaryDirectory() as folder:
            opening = contrast(Path(folder))  # before minutes of training, should it fail
            result = run_demo(request, show_progress=True)
            shutil.copytree(folder, result.out, dirs_exist_ok=True)
        page = make_demo_page(result, self._command(), opening)
        if self.json:
            print_json([evaluation.to_json() for evaluation in result.evaluations])
            return
        from clearway.evaluation.tables import rich_tables

        rest = f"--all, or {result.out / 'evaluation.md'}"
        stdout_console().print(rich_tables(result.evaluations, ["average"], every=self.all, rest=rest))
        say(f"open {page}")

    def _command(self) -> str:
        words = ["clearway", "demo", "--out", str(self.out), "--seed", str(self.seed)]
        return shlex.join(
            [*words, "--frames", str(self.frames), "--encoder", self.encoder, "--room-seed", str(self.room_seed)]
        )
