"""The settings of a run as a file: `clearway train --config RUN/run.yaml --out ANOTHER` repeats the run.

Nothing is left to defaults that another version, or the scenes, could change: the algorithm's settings stand there one
by one, and the targets by their numbers. Keys are the options of `clearway train`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from clearway.errors import ClearwayError
from clearway.learn.algorithms import ALGORITHMS
from clearway.learn.run_folder import SETTINGS_FILE, RunFolder
from clearway.learn.run_record import RunRecord
from clearway.regular_files import read_text
from clearway.reward import REWARDS, Reward
from clearway.settings_file import MAX_BYTES, read_settings, write_settings

OPTION = "frames"  # the setting of every algorithm that is an option of its own
OWN_OPTIONS = ("feature_basis", "goals")  # those of our algorithms; another's of these names is another setting
HEAD = "The settings of this run. To repeat it: clearway train --config run.yaml --out ANOTHER_FOLDER"

LENGTHENED = "But it was lengthened from"


def leave_settings(folder: Path, reward: Mapping[str, Any] | None, **further: object) -> None:
    """Write a run's settings into its folder, where it can be repeated from files and words alone.

    Args:
        folder: of a run that has begun.
        reward: the reward as options, see `reward_options`; None: by no words.
        further: other options, such as threads; those that are None, False or empty are left out.
    """
    record = RunFolder(folder).read_record()
    if reward is None or any(scene.path is None for scene in record.scenes):
        return
    path = folder / SETTINGS_FILE
    head = "\n".join([HEAD, *_lengthened(path, record.learner.frames)])
    write_settings(path, {**_of_record(record), **reward, **_given(further)}, head)


def reward_options(reward: str | Reward) -> dict[str, Any] | None:
    """A reward as options: its name, and the parameters in which it differs; None where these do not say it."""
    if isinstance(reward, str):
        return {"reward": reward}
    name = reward.name.partition(",")[0]
    if name not in REWARDS:
        return None
    known = REWARDS[name].parameters
    changed = {key: value for key, value in reward.parameters.items() if known.get(key) != value}
    try:
        same = REWARDS[name].with_changes(clip=None, **changed).terms == reward.terms
    except ClearwayError:
        return None
    return {"reward": name, **changed} if same else None


def _lengthened(path: Path, frames: int) -> list[str]:
    """Lines on what a run was lengthened from, by the settings that it has left before."""
    if not path.exists():
        return []
    try:
        before = read_settings(path).get("frames")
        lines = read_text(path, MAX_BYTES).splitlines()
    except (ClearwayError, OSError):
        return []
    told = [line.removeprefix("# ") for line in lines if line.startswith(f"# {LENGTHENED}")]
    if isinstance(before, int) and before < frames:
        told.append(f"{LENGTHENED} {before:,} frames: a run of {frames:,} frames at once differs")
    return told


def _of_record(record: RunRecord) -> dict[str, Any]:
    """What a run's record says, as options."""
    learner, name = asdict(record.learner), record.learner.algorithm
    options = (OPTION, *OWN_OPTIONS) if name in ALGORITHMS else (OPTION,)
    own = {option: learner.pop(option) for option in options if option in learner}
    return {
        "files": [scene.path for scene in record.scenes],
        "targets": {scene.name: list(scene.targets) for scene in record.scenes},
        "algorithm": name,
        **own,
        "set": learner,
        "seed": record.seed,
        "zones": record.zone_level,
        "device": str(record.hardware.get("device", "cpu")),
        "feature_store": str(record.hardware.get("feature_store", "memory")),
    }


def _given(options: Mapping[str, object]) -> dict[str, object]:
    """Options that say something; several words as a list."""
    said = {
        name: value
        for name, value in options.items()
        if value is not None and value is not False and value not in ((), "")
    }
    return {name: list(value) if isinstance(value, tuple | list) else value for name, value in said.items()}
