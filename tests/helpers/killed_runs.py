"""Training that is killed again and again: `python -m killed_runs FOLDER PRESET KILLS SEED`, run by test_kill.py.

A process that has imported torch once forks a child for every attempt. The child trains, or resumes, with a checkpoint
after every update, and tells of every update that it begins; at a random moment it gets SIGKILL. A child that runs far
past the moment, on a quick machine, waits for its kill. What is left after the last kill is resumed to the end.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import torch

from clearway.learn import train
from clearway.learn.figures import Figures
from clearway.learn.presets import PRESETS
from clearway.learn.train import RunRequest
from clearway.learn.trainer import Trainer
from helpers.small_runs import small_learner, small_request

UPDATES = 500
LONGEST_DELAY_S = 0.06  # after the chosen update has begun: it may be over by then, and its files being written
MOST_CHOSEN = 5  # updates that begin before the kill is due
MOST_PAST = 4  # updates that begin after the chosen one, before a child waits for its kill


def request(preset: str) -> RunRequest:
    """What is trained."""
    learner = small_learner(PRESETS[preset], frames=80 * UPDATES)
    return replace(small_request(), learner=learner)


def child(folder: Path, preset: str, told: int, most_updates: int) -> None:
    """Train in this process until it ends or has to wait; a byte goes to the file `told` before every update."""
    train.SECONDS_BETWEEN_CHECKPOINTS = 0.0
    whole = Trainer.update
    begun = 0

    def update(trainer: Trainer) -> Figures:
        nonlocal begun
        begun += 1
        if begun > most_updates:
            signal.pause()
        os.write(told, b".")
        return whole(trainer)

    Trainer.update = update
    train.train(request(preset), folder, resume=True)


def attempt(folder: Path, preset: str, kill_after: tuple[int, float] | None) -> int:
    """Train in a process of its own and return how it ended, as waitpid has it.

    kill_after: updates begun, and seconds after that; None lets it come to its end.
    """
    hear, told = os.pipe()
    process = os.fork()
    if process == 0:
        os.close(hear)
        try:
            child(folder, preset, told, UPDATES if kill_after is None else kill_after[0] + MOST_PAST)
        except BaseException as error:  # whatever it is, it must not run on as a second parent
            print(f"child: {error!r}", file=sys.stderr, flush=True)
            os._exit(1)
        os._exit(0)
    os.close(told)
    if kill_after is not None:
        updates, delay = kill_after
        for _ in range(updates):
            os.read(hear, 1)
        time.sleep(delay)
        os.kill(process, signal.SIGKILL)
    _, status = os.waitpid(process, 0)
    os.close(hear)
    return status


def main() -> None:
    folder, preset, kills, seed = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as warming_up:  # what is imported on the way is imported once, not by all
        train.train(small_request(learner=small_learner(PRESETS[preset], frames=80)), Path(warming_up))
    assert kills * (MOST_CHOSEN + MOST_PAST) < UPDATES, "an attempt may come to the end"
    moments = random.Random(seed)
    for number in range(kills):
        status = attempt(folder, preset, (moments.randint(0, MOST_CHOSEN), moments.uniform(0, LONGEST_DELAY_S)))
        assert os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGKILL, f"kill {number} came too late"
        found = sorted(path.name for path in (folder / "checkpoints").glob("*"))
        print(number, *found, flush=True)
    assert attempt(folder, preset, None) == 0


if __name__ == "__main__":
    main()
