"""The command line, called in process, and a dump that other code wrote."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import pytest

from clearway.cli.main import main
from helpers.small_pictures import shrink_pictures

WIDTH, DEPTH = 6, 3  # cells of the dump's room
ISLAND = (9, 9)  # a cell out of reach, such as bedroom_04 has
HEADINGS = (270, 0, 90, 180)  # of the four states of a cell, in this order
AHEAD = {0: (0, 1), 90: (1, 0), 180: (0, -1), 270: (-1, 0)}


@dataclass(frozen=True)
class Answer:
    """What a command left: its exit code, standard output and standard error."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> object:
        """Standard output as JSON, which knows no NaN."""

        def refuse(word: str) -> None:
            raise ValueError(f"{word} is not JSON")

        return json.loads(self.out, parse_constant=refuse)

    def refusal(self, *parts: str) -> str:
        """The one line of a refusal, in which all `parts` occur."""
        assert self.code == 2, self
        assert self.out == ""
        (line,) = self.err.splitlines()
        assert line.startswith("error: ")
        for part in parts:
            assert part in line
        return line


def call(*words: object) -> Answer:
    """Run `clearway` with these words."""
    out, err = io.StringIO(), io.StringIO()
    code = 0
    line = [str(word) for word in words]
    with redirect_stdout(out), redirect_stderr(err), pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["clearway", *line])
        try:
            main(line)
        except SystemExit as leaving:
            assert isinstance(leaving.code, int)
            code = leaving.code
    return Answer(code, out.getvalue(), err.getvalue())


@pytest.fixture(scope="session")
def clearway() -> Callable[..., Answer]:
    return call


@pytest.fixture(autouse=True, scope="session")
def _alone(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A cache of our own, and tables wide enough not to break words."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CLEARWAY_CACHE", str(tmp_path_factory.mktemp("cache")))
        patch.setenv("COLUMNS", "200")
        yield


@pytest.fixture(autouse=True, scope="module")
def _small_pictures() -> Iterator[None]:
    """Not for the session: tests of pictures may come after these in the same process."""
    with pytest.MonkeyPatch.context() as patch:
        shrink_pictures(patch)
        yield


def dump_graph(cells: list[tuple[int, int]]) -> np.ndarray:
    """Next state by forward, right, left, backward; -1 where blocked. State 4 * cell + place in `HEADINGS`."""
    graph = np.full((4 * len(cells), 4), -1)
    for index, (x, z) in enumerate(cells):
        for place, heading in enumerate(HEADINGS):
            dx, dz = AHEAD[heading]
            state = 4 * index + place
            graph[state, 1] = 4 * index + HEADINGS.index((heading + 90) % 360)
            graph[state, 2] = 4 * index + HEADINGS.index((heading - 90) % 360)
            for action, cell in ((0, (x + dx, z + dz)), (3, (x - dx, z - dz))):
                if cell in cells:
                    graph[state, action] = 4 * cells.index(cell) + place
    return graph


def steps_between(graph: np.ndarray, unreachable: int) -> np.ndarray:
    """Shortest paths by breadth-first search, written down once more."""
    table = np.full((len(graph), len(graph)), unreachable)
    for start in range(len(graph)):
        front, steps = {start}, 0
        while front:
            for state in front:
                table[start, state] = steps
            onward = {int(state) for state in graph[sorted(front)].ravel() if state >= 0}
            front, steps = {state for state in onward if table[start, state] == unreachable}, steps + 1
    return table


def write_dump(
    path: Path, *, feature_axis: int = 10, unreachable: int = -1, change: Callable[[h5py.File], object] | None = None
) -> Path:
    """A `thor_v1` file as the published ones look: plain datasets, 18 cells in a rectangle, one out of reach."""
    cells = [(x, z) for z in range(DEPTH) for x in range(WIDTH)] + [ISLAND]
    rng = np.random.default_rng(5)
    graph = dump_graph(cells)
    count = len(graph)
    path.parent.mkdir(exist_ok=True)
    with h5py.File(path, "w") as file:
        file["graph"] = graph.astype(np.int32)
        file["location"] = (np.repeat(cells, 4, axis=0) * 0.5 - 2).astype(np.float32)
        file["rotation"] = np.tile(HEADINGS, len(cells)).astype(np.float32)
        file["shortest_path_distance"] = steps_between(graph, unreachable).astype(np.float32)
        file["resnet_feature"] = rng.random((count, feature_axis, 24), np.float32)
        file["observation"] = rng.integers(0, 256, (count, 12, 16, 3), np.uint8)
        if change is not None:
            change(file)
    return path


@pytest.fixture(scope="session")
def dump() -> Callable[..., Path]:
    return write_dump


SMALL = ("--frames", 640, "--set", "envs=20", "rollout_steps=8", "width=16", "clip_rewards=true")


@pytest.fixture(scope="session")
def small() -> tuple[object, ...]:
    """Words for a training of an instant."""
    return SMALL


@dataclass(frozen=True)
class Trained:
    """A run on an imported dump."""

    scene: Path
    run: Path


@pytest.fixture(scope="session")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Trained:
    folder = tmp_path_factory.mktemp("trained")
    source = write_dump(folder / "dumps" / "bathroom_02.h5")
    assert call("scenes", "import", "thor-v1", source, "--out", folder / "scenes").code == 0
    scene, run = folder / "scenes" / "bathroom_02.h5", folder / "run"
    answer = call("train", scene, "--out", run, "--alpha", "-0.02", "--gamma", "-1.5e-2", *SMALL)
    assert answer.code == 0, answer
    return Trained(scene, run)
