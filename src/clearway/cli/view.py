"""`clearway view` and `clearway scenes view`."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from clearway.cli.arguments import check_at_least, scene_files
from clearway.cli.console import say, stderr_console
from clearway.cli.generate import chosen_room
from clearway.errors import ClearwayError
from clearway.files import check_free

if TYPE_CHECKING:
    from clearway.view.stage import Stage

MOST_RUNS = 2


@dataclass(frozen=True)
class ViewRuns:
    """Watch an agent in the browser, or two side by side from the same start; drive, and race it.

    Example: clearway view --example
    """

    folders: Annotated[tuple[Path, ...], tyro.conf.Positional] = ()
    """One run folder, or two; or generalist, which comes with clearway, and scene files or folders that it has never
    seen."""
    agent: Literal["generalist"] | None = None
    """The same as the word generalist in front."""
    example: bool = False
    """Open what comes along: two trained agents in a bathroom, or, with generalist, the generalist there."""
    room: int | None = None
    """Seed of a room for the generalist, made at once: kitchen, living room, bedroom and bathroom in turn."""
    tour: int = 0
    """Steps in which the generalist looks around in a scene before its episodes there."""
    scenes: tuple[Path, ...] = ()
    """Scene files or folders, where they are no longer where they were at training."""
    episode: str = ""
    """The link of an episode to replay; the part from its # on is enough."""
    port: int = 0
    """Where the page is served on this machine; 0 for any free port."""
    open: bool = False
    """Open the browser too."""
    save: Path | None = None
    """Write a page with recorded episodes into this new folder, and serve nothing."""
    episodes: int | None = None
    """With --save: episodes from drawn starts to each target, by default 3; that of --episode comes first."""

    def run(self) -> None:
        """Serve the page until interrupted, or save it."""
        if self.save is None and self.episodes is not None:
            raise ClearwayError("--episodes: is for a saved page. Give its folder with --save, or leave it out")
        check_at_least(1, episodes=self.episodes)
        if self.save is not None:
            check_free(self.save)
            for name, given in {"port": self.port, "open": self.open}.items():
                if given:
                    raise ClearwayError(f"--{name}: a saved page is not served. Leave out --{name} or --save")
        stage, opening = self._stage()
        if self.save is None:
            _show(stage, self.port, self.episode or opening, self.open)
        else:
            _save(stage, self.save, self.episode or opening, self.episodes)

    def _stage(self) -> tuple[Stage, str]:
        """The stage, and the episode to open with where none is given."""
        from clearway.choices import is_generalist

        first = self.folders[:1]
        generalist = bool(self.agent) or any(map(is_generalist, first))
        if self.example:
            return self._example(generalist)
        if generalist:
            return self._generalist(self.folders if self.agent else self.folders[1:]), ""
        from clearway.view.stage import run_stage

        if self.room is not None:
            raise ClearwayError("--room: goes with the generalist, the only one that knows any room. Put it in front")
        if self.tour:
            raise ClearwayError("--tour: agents of runs keep no map. Leave it out, or view generalist")
        if not 1 <= len(self.folders) <= MOST_RUNS:
            told = f"{len(self.folders)} run folders, one or two can be shown. Name one or two"
            raise ClearwayError(told if self.folders else f"{told}, or see what comes along: clearway view --example")
        return run_stage(self.folders, scene_files(self.scenes) if self.scenes else None), ""

    def _example(self, generalist: bool) -> tuple[Stage, str]:
        from clearway.examples.stage import example_stage, generalist_example

        named = self.folders if self.agent or not generalist else self.folders[1:]
        for name, given in {"a run or scene": named, "--scenes": self.scenes, "--room": self.room is not None}.items():
            if given:
                raise ClearwayError(f"--example: has its own agents and scene, and {name} was given too. Leave one out")
        check_at_least(0, tour=self.tour)
        if generalist:
            return generalist_example(self.tour), ""
        if self.tour:
            raise ClearwayError("--tour: agents of runs keep no map. Leave it out, or view generalist")
        return example_stage()

    def _generalist(self, files: tuple[Path, ...]) -> Stage:
        from clearway.api.scenes import load_scenes
        from clearway.view.generalist import generalist_stage

        check_at_least(0, tour=self.tour)
        files += self.scenes
        if (self.room is None) == (not files):
            raise ClearwayError("the generalist walks in a scene. Name scene files behind it, or give --room SEED")
        scenes = load_scenes(scene_files(files)) if self.room is None else [chosen_room(self.room)]
        return generalist_stage(scenes, self.tour)


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


def _save(stage: Stage, folder: Path, first: str, episodes: int | None) -> None:
    """Save the page, and say where it is and how large."""
    from clearway.view.saved import EPISODES, save_page

    size = save_page(stage, folder, first=first, episodes=episodes or EPISODES)
    say(f"{folder / 'index.html'}: {size.episodes} episodes, {size.files} files, {size.megabytes:.1f} MB. Open it")


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
