"""The demo: build the bathroom, train both rewards, evaluate both beside a random and a shortest-path agent."""

from __future__ import annotations

import shutil
import time
from dataclasses import dataclass, replace
from pathlib import Path

from clearway.errors import ClearwayError
from clearway.evaluation.files import write_evaluations
from clearway.evaluation.runs import evaluate_runs
from clearway.evaluation.showcase import Showcase, showcases
from clearway.evaluation.summary import Evaluation
from clearway.experiments.demo_generalist import FirstWalk, first_walk
from clearway.learn.checkpoint import keep_newest_checkpoint
from clearway.learn.load import TrainedAgent, load_agent, run_world
from clearway.learn.presets import DEFAULT
from clearway.learn.run_folder import RunFolder
from clearway.learn.train import RunRequest, train
from clearway.perception import encode_scenes
from clearway.reward import COLLISION_AWARE, SHORTEST
from clearway.rooms.library import cached_room_scene
from clearway.scenes.scene import Scene
from clearway.scenes.targets import default_targets
from clearway.scenes.thor_v1 import read_scene, write_scene

ROOM = "bathroom"
REWARDS = (COLLISION_AWARE, SHORTEST)
MARK = "demo.json"  # tells a demo's folder from a user's own


@dataclass(frozen=True)
class DemoRequest:
    """What to show.

    Attributes:
        out: folder for everything.
        seed: of the agents.
        frames: training frames of each agent.
        encoder: name of the encoder.
        room_seed: of the room in which the generalist walks before anything is trained.
    """

    out: Path
    seed: int
    frames: int
    encoder: str
    room_seed: int = 0


@dataclass(frozen=True)
class DemoResult:
    """What came of it.

    Attributes:
        out: the folder.
        scene: the bathroom with its features.
        runs: run folder of each agent by the name of its reward.
        evaluations: of both agents (by each way of choosing actions), the random and the shortest-path agent.
        showcase: one episode that both agents walked.
        first: the generalist's episode in a room that it has never entered.
        seconds: of building (with encoding), training, evaluating.
    """

    out: Path
    scene: Scene
    runs: dict[str, RunFolder]
    evaluations: list[Evaluation]
    showcase: Showcase
    first: FirstWalk
    seconds: dict[str, float]


def run_demo(request: DemoRequest, show_progress: bool = False) -> DemoResult:
    """Run the demo in `request.out`, in place of an earlier one there.

    Raises:
        ClearwayError: the folder holds something else, or a part of the demo cannot run here.
    """
    learner = replace(DEFAULT, frames=request.frames)
    _claim(request.out)
    clock = _Clock()
    first = first_walk(request.room_seed, request.seed)
    clock.lap("generalist, in a room of its own")
    room = cached_room_scene(ROOM, progress=show_progress)
    (encoded,) = encode_scenes([room], request.encoder, progress=show_progress)
    _empty(request.out)
    path = request.out / f"{ROOM}.h5"
    write_scene(encoded, path)
    scene = read_scene(path)
    clock.lap("room and features")
    runs = {
        reward.name: train(
            RunRequest(
                scenes=[scene],
                targets={scene.name: default_targets(scene)},
                learner=learner,
                reward=reward,
                seed=request.seed,
                paths={scene.name: path},
            ),
            request.out / "runs" / reward.name,
            show_progress=show_progress,
        )
        for reward in REWARDS
    }
    for run in runs.values():
        keep_newest_checkpoint(run.checkpoints)
    clock.lap("training, both agents")
    agents = {name: load_agent(run.path) for name, run in runs.items()}
    evaluations = evaluate_runs(agents, [scene], seed=request.seed)
    write_evaluations(request.out, [evaluation.to_json() for evaluation in evaluations], evaluations)
    clock.lap("evaluation")
    show = _showcase(agents, scene, request.seed)
    return DemoResult(request.out, scene, runs, evaluations, show, first, dict(clock.seconds))


def _showcase(agents: dict[str, TrainedAgent], scene: Scene, seed: int) -> Showcase:
    record = next(iter(agents.values())).record
    world = run_world(record, [scene])
    return showcases(world, {name: agent.on_poses(world) for name, agent in agents.items()}, seed=seed)[0]


def _claim(folder: Path) -> None:
    """Make the folder, or see that it is empty or an earlier demo's, and leave our mark."""
    if folder.exists() and (not folder.is_dir() or (any(folder.iterdir()) and not (folder / MARK).exists())):
        raise ClearwayError(f"{folder}: exists and is not a demo's folder. Give another one with --out")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / MARK).write_text('{"made_by": "clearway demo"}\n')


def _empty(folder: Path) -> None:
    """Remove what an earlier demo left, all but the mark."""
    for left in folder.iterdir():
        if left.is_dir() and not left.is_symlink():
            shutil.rmtree(left)
        elif left.name != MARK:
            left.unlink()


class _Clock:
    """Seconds of one thing after another."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._since = time.monotonic()

    def lap(self, name: str) -> None:
        now = time.monotonic()
        self.seconds[name], self._since = now - self._since, now
