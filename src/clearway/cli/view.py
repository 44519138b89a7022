"""`clearway view` and `clearway scenes view`."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from clearway.cli.arguments import scene_files
from clearway.cli.console import stderr_console
from clearway.errors import ClearwayError

if TYPE_CHECKING:
    from clearway.view.stage import Stage

MOST_RUNS = 2


@dataclass(frozen=True)
class ViewRuns:
    """Watch an agent in the browser, or two side by side from the same start; drive, and race it.

    Example: clearway view runs/collision-aware runs/shortest
    """

    folders: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """One run folder, or two."""
    scenes: tuple[Path, ...] = ()
    """Scene files or folders, where they are no longer where they were at training."""
    episode: str = ""
    """The link of an episode to replay; the part from its # on is enough."""
    port: int = 0
    """Where the page is served on this machine; 0 for any free port."""
    open: bool = False
    """Open the browser too."""

    def run(self) -> None:
        """Serve the page until interrupted."""
        from clearway.view.stage import run_stage

        if not 1 <= len(self.folders) <= MOST_RUNS:
            raise ClearwayError(f"{len(self.folders)} run folders, one or two can be shown. Name one or two")
        stage = run_stage(self.folders, scene_files(self.scenes) if self.scenes else None)
        _show(stage, self.port, self.episode, self.open)


@dataclass(frozen=True)
class ViewScene:
    """Walk through a scene in the browser, without an agent.

    Example: clearway scenes view bathroom.h5
    """

    file: Annotated[Path, tyro.conf.Positional]
    """The scene file."""
    port: int = 0
    """Where the page is served on this machine; 0 for any free port."""
    open: bool = False
    """Open the browser too."""

    def run(self) -> None:
        """Serve the page until interrupted."""
        from clearway.scenes.thor_v1 import read_scene
        from clearway.view.stage import scene_stage

        path, *others = scene_files([self.file])
        if others:
            raise ClearwayError(f"{self.file}: a folder of {1 + len(others)} scene files. Name one, such as {path}")
        _show(scene_stage(read_scene(path)), self.port, "", self.open)


def _show(stage: Stage, port: int, episode: str, in_browser: bool) -> None:
    """Serve the viewer, and say where."""
    from clearway.view.episode import read_episode
    from clearway.view.server import make_app
    from clearway.view.viewing import Viewing
    from clearway.web.browser import opened_in_browser
    from clearway.web.guard import guarded, new_token
    from clearway.web.local import listening, port_of, serve

    fragment = ""
    if episode:
        wanted = read_episode(episode)
        Viewing(stage).begin(wanted)  # refuses here what the page would refuse
        fragment = f"#{wanted.query()}"
    listener, token = listening(port), new_token()
    app = guarded(make_app(stage), token, port_of(listener))
    address = f"http://127.0.0.1:{port_of(listener)}/{token}/{fragment}"
    console = stderr_console()
    console.print("clearway view, for this machine's user alone (end with Ctrl+C):", highlight=False)
    print(address, flush=True)
    with opened_in_browser(address) if in_browser else nullcontext():
        serve(app, listener)
