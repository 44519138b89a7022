"""Trainings of every algorithm, tiny, that are killed at random moments after their first checkpoint and go on.

Each attempt is a fork of this process. It writes a checkpoint after every update; once it has written a new one, it
gets SIGKILL up to `LONGEST_DELAY_S` later. One more kill, which does not count, falls as a training begins. A training
that came to its end before all kills fell is compared, and begun anew for those left.
`python -m helpers.killed_trainings FOLDER NAME KILLS SEED` prints the kills that fell, and whether all bits are those
of a training that nobody has killed.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor

from clearway.agents.generalist import Generalist
from clearway.learn import train
from clearway.learn.adapt import Adapt
from clearway.learn.bc import BC
from clearway.learn.checkpoint import newest_checkpoint, read_network, read_training
from clearway.learn.learner import Learner
from clearway.learn.presets import DEFAULT, PAPER_A2C, PAPER_A3C
from clearway.learn.q_learning import QLearning
from clearway.learn.recurrent import Recurrent
from clearway.learn.run_folder import RunFolder
from clearway.perception.eyes_network import EyesShape
from clearway.pretraining import pretrain as pretraining
from clearway.pretraining.settings import PretrainSettings
from clearway.pretraining.trainer import PretrainRequest
from clearway.views.settings import ViewSettings
from clearway.views.stream import views_in
from helpers.made import corridor_scene, grid_scene
from helpers.made_views import write_made
from helpers.small_eyes import seen_by_eyes, small_generalist
from helpers.small_runs import small_learner, small_request

UPDATES_A_KILL = 9  # of the whole training, more than an attempt gets through before it is killed
LONGEST_DELAY_S = 0.06
PATIENCE_S = 120.0
MOST_TRAININGS = 10  # killed ones; a training that ends before any kill, ten times over, is too short
TIMES = ("seconds", "pictures_per_second", "frames_per_second")
PPO_BY_EYES = {"envs": 16, "rollout_steps": 8, "step_limit": 20, "width": 16, "minibatches": 2}
ADAPT = {"tour_steps": 40, "walks": 2, "walk_steps": 10, "lessons": 1, "mind_walks": 80}
SHAPE = EyesShape((8, 8, 8), token_width=4, description_width=4, hidden_width=8, height_px=32, width_px=32)
NAMES = ("ppo", "a2c", "a3c", "bc", "q-learning", "recurrent", "adapt", "pretrain")


def learner_of(name: str, updates: int) -> Learner:
    """Settings for so many updates."""
    by_eyes = {"frames": 16 * 8 * updates, **PPO_BY_EYES}
    return {
        "ppo": lambda: small_learner(DEFAULT, frames=80 * updates),
        "a2c": lambda: small_learner(PAPER_A2C, frames=80 * updates),
        "a3c": lambda: small_learner(PAPER_A3C, frames=50 * updates, rollout_steps=5),
        "bc": lambda: small_learner(BC(), frames=80 * updates),
        "q-learning": lambda: small_learner(QLearning(), frames=80 * updates),
        "recurrent": lambda: Recurrent(**by_eyes),
        "adapt": lambda: Adapt(**by_eyes, **ADAPT),
    }[name]()


def trainer_of(name: str, folder: Path, updates: int) -> Callable[[Path], object]:
    """What trains into a folder, or goes on there; `folder` is for what it learns from."""
    train.SECONDS_BETWEEN_CHECKPOINTS = pretraining.SECONDS_BETWEEN_CHECKPOINTS = 0.0
    if name == "pretrain":
        kept = ViewSettings(poses=10, takes=2, sensors=("rgb", "depth"), size_px=(32, 32))
        for room in range(3):
            write_made(folder, f"room{room}", kept, seed=room)
        settings = PretrainSettings(pictures=16 * updates, batch=16, together=4, partners=2, shape=SHAPE)
        wanted = PretrainRequest(views_in([folder]), settings)
        return lambda out: pretraining.pretrain(wanted, out, resume=True)
    request = replace(small_request(), learner=learner_of(name, updates))
    if name in ("recurrent", "adapt"):
        scenes = seen_by_eyes(folder / "eyes", corridor_scene(5), grid_scene(1, width=4, depth=3))
        known = small_generalist(folder / "eyes")
        Generalist.shipped = classmethod(lambda cls: known)  # type: ignore[method-assign,assignment]
        request = replace(request, scenes=scenes)
    return lambda out: train.train(request, out, resume=True)


def begun(training: Callable[[Path], object], out: Path) -> int:
    """A process of its own that trains."""
    process = os.fork()
    if process == 0:
        try:
            training(out)
        except BaseException:  # whatever it is, it must not run on as a second parent
            traceback.print_exc()
            os._exit(1)
        os._exit(0)
    return process


def newest(out: Path) -> str:
    """Name of the newest checkpoint; empty where there is none."""
    return max((path.name for path in (out / "checkpoints").glob("frames-*")), default="")


def killed(process: int, out: Path, delay_s: float, *, waits: bool) -> bool:
    """Kill a training some time after it began, or `waits` for its next checkpoint; whether it was still there."""
    before, deadline = newest(out), time.monotonic() + PATIENCE_S
    while waits and newest(out) == before:
        ended, status = os.waitpid(process, os.WNOHANG)
        if ended:
            assert status == 0, "a training failed"
            return False
        assert time.monotonic() < deadline, "no checkpoint"
        time.sleep(0.002)
    time.sleep(delay_s)
    os.kill(process, signal.SIGKILL)
    _, status = os.waitpid(process, 0)
    assert os.WIFSIGNALED(status) or status == 0, "a training failed"
    return os.WIFSIGNALED(status)


def bits_of(out: Path) -> dict[str, Tensor]:
    """Network, optimiser, random streams and statistics at the end."""
    end = newest_checkpoint(out / "checkpoints")
    return {**read_network(end), **read_training(end)}


def files_of(folder: Path) -> set[str]:
    """What lies in a run folder."""
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def figures_of(name: str, out: Path) -> list[dict[str, float]]:
    """The figures on the way, without times; of A3C the episodes alone, since its rows fall where workers pause."""
    rows = RunFolder(out).metrics()
    if name == "a3c":
        return [{"episodes": sum(row["episodes"] for row in rows)}]
    return [{key: value for key, value in row.items() if key not in TIMES} for row in rows]


def kill_to_the_end(training: Callable[[Path], object], out: Path, kills: int, chance: random.Random) -> int:
    """Kill a training up to so many times and let it come to its end; the number of kills that fell before it did."""
    fell = 0
    killed(begun(training, out), out, chance.uniform(0, LONGEST_DELAY_S), waits=False)
    while fell < kills and killed(begun(training, out), out, chance.uniform(0, LONGEST_DELAY_S), waits=True):
        fell += 1
    assert os.waitpid(begun(training, out), 0)[1] == 0
    return fell


def compare(name: str, whole: Path, out: Path) -> None:
    """The training that was killed ended as the whole one did, and left nothing else behind.

    Raises:
        AssertionError: a bit or a figure differs, or there is a file more.
    """
    more = {path for path in files_of(out) - files_of(whole) if not path.startswith("checkpoints/frames-")}
    assert not more, f"{name}: {more} left behind"
    bits, others = bits_of(whole), bits_of(out)
    assert bits.keys() == others.keys(), f"{name}: other tensors"
    different = [key for key in bits if not torch.equal(bits[key], others[key])]
    assert not different, f"{name}: {different} differ"
    assert figures_of(name, whole) == figures_of(name, out), f"{name}: other figures"


def tried(name: str, folder: Path, kills: int, seed: int) -> int:
    """Kill trainings until so many kills fell, let each come to its end, and compare; the number of kills that fell.

    Raises:
        AssertionError: a bit differs, or a training failed.
    """
    torch.set_num_threads(1)
    folder.mkdir(parents=True)
    training, chance = trainer_of(name, folder, UPDATES_A_KILL * (kills + 1)), random.Random(seed)
    whole = folder / "whole"
    assert os.waitpid(begun(training, whole), 0)[1] == 0
    fell = 0
    for attempt in range(MOST_TRAININGS):
        if fell < kills:
            out = folder / f"killed-{attempt}"
            fell += kill_to_the_end(training, out, kills - fell, chance)
            compare(name, whole, out)
    return fell


def main() -> None:
    folder, name, kills, seed = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
    begin = time.monotonic()
    fell = tried(name, folder, kills, seed)
    print(f"{name:<12} {fell:>4} kills, all bits equal, {time.monotonic() - begin:.0f} s", flush=True)


if __name__ == "__main__":
    main()
