"""A run folder: what was asked for, how it went, and its checkpoints.

run.json         the learner (algorithm and its own settings), reward, seed, zone level, scenes with their targets and
                 digests, versions, hardware, command
run.yaml         the same as options of clearway train, to repeat it (`api.run_settings`)
metrics.jsonl    one row of figures a line (docs/metrics.md)
checkpoints/     see `checkpoint`
milestones/N/    the agent after N frames, where it was asked for: a checkpoint to act from, not to train on from
"""

from __future__ import annotations

import json
import os
import shutil
import warnings
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from clearway.choices import GENERALIST
from clearway.errors import ClearwayError, PluginError, RunError, reason_of
from clearway.files import parse_json, read_json, written_whole
from clearway.learn.checkpoint import newest_checkpoint, read_progress
from clearway.learn.kinds import fits
from clearway.learn.run_record import RunRecord, maker, record_from
from clearway.regular_files import read_bytes, read_text
from clearway.spelling import did_you_mean
from clearway.version import __version__

FORMAT_VERSION = 2
MAX_METRICS_BYTES = 1024**3
RUN_FILE, METRICS_FILE, CHECKPOINTS, MILESTONES = "run.json", "metrics.jsonl", "checkpoints", "milestones"
LOCK_FILE = ".lock"
COPIED = ".copied-"  # begins the name of what is being copied elsewhere
SETTINGS_FILE = "run.yaml"  # what repeats the run


class RunFolder:
    """The files of one run.

    Args:
        path: the folder; made when the run starts.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.checkpoints = path / CHECKPOINTS
        self.metrics_path = path / METRICS_FILE

    def milestone(self, frames: int) -> Path:
        """Where the checkpoint of the agent after so many frames is kept."""
        return self.path / MILESTONES / str(frames)

    @property
    def exists(self) -> bool:
        """A run was started here."""
        return (self.path / RUN_FILE).exists()

    @contextmanager
    def held(self) -> Iterator[None]:
        """Keep other processes from training in this folder, and remove what one that was killed left unfinished.

        Raises:
            RunError: another process trains here, or the folder cannot be made or written to.
        """
        with self._locked():
            self.clear_parts()
            yield

    def check_not_held(self) -> None:
        """Raise RunError where another process trains here. Nothing is left behind."""
        if (self.path / LOCK_FILE).exists():  # else nobody does, and to lock would make it
            with self._locked():
                pass

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """Have the folder's lock. Raises as `held`."""
        from filelock import FileLock, Timeout

        lock = FileLock(self.path / LOCK_FILE, timeout=0)
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            lock.acquire()
        except Timeout as error:
            raise RunError(f"{self.path}: another process trains here. Wait for it, or give another --out") from error
        except OSError as error:
            raise RunError(f"{self.path}: not a folder to write to ({error}). Choose another with --out") from error
        try:
            yield
        finally:
            lock.release()

    def clear_parts(self) -> None:
        """Remove what a process that was killed left unfinished."""
        for name in (RUN_FILE, METRICS_FILE, SETTINGS_FILE):
            for part in self.path.glob(f".{name}.*.part"):
                part.unlink()
        for part in self.path.glob(f"{COPIED}*"):
            shutil.rmtree(part)

    @contextmanager
    def begun(self, record: RunRecord, resume: bool) -> Iterator[list[str] | None]:
        """As `begin`; where the run begins, and fails before its first checkpoint, what it wrote is removed again."""
        fresh, before = not self.exists, {path.name for path in self.path.iterdir()}
        other_bits = self.begin(record, resume)
        try:
            yield other_bits
        except Exception:
            if fresh and not any(self.checkpoints.glob("frames-*")):
                self.forget(before, RUN_FILE)
            raise

    def forget(self, before: Collection[str], record: str) -> None:
        """Remove a training and its record, of that name, but for what was there before; the folder, if it is empty."""
        for name in {record, METRICS_FILE, SETTINGS_FILE}.difference(before):
            (self.path / name).unlink(missing_ok=True)
        for name in {CHECKPOINTS, MILESTONES}.difference(before):
            shutil.rmtree(self.path / name, ignore_errors=True)
        if not any(path.name != LOCK_FILE for path in self.path.iterdir()):
            shutil.rmtree(self.path, ignore_errors=True)

    def begin(self, record: RunRecord, resume: bool) -> list[str] | None:
        """Begin a run here, or find one to go on with.

        Returns:
            None for a run that begins; else `RunRecord.other_bits` of the one to go on with.

        Raises:
            RunError: as of `check_begin`.
        """
        before = self.check_begin(record, resume)
        if before is None:
            self.write_record(record)
            return None
        if not before.same_experiment(record):
            before = self._lengthened(before, record.learner.frames)
        if not any(self.checkpoints.glob("frames-*")):
            self.write_record(record)  # nothing is left of what was done elsewhere
            self.forget_metrics_after(-1)
            return None
        return before.other_bits(record)

    def check_begin(self, record: RunRecord, resume: bool) -> RunRecord | None:
        """Refuse what `begin` would. Nothing is written.

        Returns:
            The record of the run here to go on with; None where one begins.

        Raises:
            RunError: the folder holds a run already (and resume is off), or another experiment, or a run that was to
                have other frames, and is not finished or has trained so many already.
        """
        if not (self.exists and resume):
            self.check_free()
            return None
        before = self.read_record()
        check_goes_on(before, record, self.trained_frames, str(self.path), "--out")
        return before

    def check_place(self) -> None:
        """Raise RunError where there can be no folder: a file is there, or on the way, or nothing can be written."""
        try:
            place = next(place for place in (self.path, *self.path.parents) if place.exists())
            usable = place.is_dir() and os.access(place, os.W_OK | os.X_OK)
            problem = f"{place} cannot be written to" if place.is_dir() else f"{place} is a file"
        except OSError as error:
            usable, problem = False, str(error)
        if not usable:
            raise RunError(f"{self.path}: not a folder to write to ({problem}). Choose another with --out")

    def check_free(self) -> None:
        """Raise RunError where no run can begin: one is here already, or what is left of one."""
        if self.exists:
            raise RunError(f"{self.path}: holds a run already. Give --resume to go on with it, or another --out")
        for left in (self.metrics_path, self.checkpoints):
            if left.exists():
                raise RunError(f"{self.path}: holds {left.name} but no {RUN_FILE}. Empty it, or give another --out")

    def _lengthened(self, before: RunRecord, frames: int) -> RunRecord:
        """Have a finished run go on to more frames.

        Warns:
            UserWarning: its schedules go on as those of so many frames.
        """
        told = f"{self.path}: was finished after {self.trained_frames():,} frames, and goes on to {frames:,}"
        warnings.warn(f"{told}; results will not be those of one training so long", stacklevel=4)
        longer = before.with_frames(frames)
        self.write_record(longer)
        return longer

    def trained_frames(self) -> int:
        """Frames of the newest checkpoint that is whole; 0 where there is none.

        Raises:
            RunError: none of the checkpoints is whole.
        """
        any_there = any(self.checkpoints.glob("frames-*"))
        return read_progress(newest_checkpoint(self.checkpoints)).frames if any_there else 0

    def write_record(self, record: RunRecord) -> None:
        """Write run.json."""
        content = {"format_version": FORMAT_VERSION, **record.to_json()}
        with written_whole(self.path / RUN_FILE) as part:
            part.write_text(json.dumps(content, indent=2) + "\n")

    def read_record(self) -> RunRecord:
        """Read run.json.

        Raises:
            RunError: there is no run here, or it is damaged, or a newer clearway wrote it.
        """
        path = self.path / RUN_FILE
        try:
            content = read_json(path)
            found = int(content["format_version"])
        except (FileNotFoundError, NotADirectoryError) as error:
            meant = did_you_mean(self.path.name, [GENERALIST])
            told = f"{self.path}: no run here ({RUN_FILE} is missing).{meant} Name a folder that clearway train made"
            raise RunError(told) from error
        except (OSError, ValueError, KeyError, TypeError, OverflowError) as error:
            raise RunError(f"{path}: not readable ({reason_of(error)}). Restore it or train again") from error
        if found > FORMAT_VERSION:
            raise RunError(f"{path}: written by a newer clearway (format {found}). Upgrade clearway")
        try:
            return record_from(content, found)
        except PluginError as error:
            raise RunError(f"{path}: {error}") from error
        except (KeyError, TypeError, AttributeError, OverflowError, ClearwayError) as error:
            reason, remedy = str(error).rstrip(".")[:300], "Restore it or train again"
            by = maker(content)
            if by != __version__:
                remedy = f"clearway {by} wrote it, this is {__version__}: use that one, or train again"
            raise RunError(f"{path}: a setting is missing or unknown ({reason}). {remedy}") from error

    def metrics(self) -> list[dict[str, float]]:
        """All rows of metrics.jsonl; a last line that was cut off is left out.

        Raises:
            RunError: a line is not JSON, or no row of figures.
        """
        if not self.metrics_path.exists():
            return []
        try:
            lines = read_bytes(self.metrics_path, MAX_METRICS_BYTES).splitlines(keepends=True)
        except OSError as error:
            raise RunError(
                f"{self.metrics_path}: not readable ({reason_of(error)}). Restore it or train again"
            ) from error
        return [self._row(number, line) for number, line in enumerate(lines, 1) if line.endswith(b"\n")]

    def _row(self, number: int, line: bytes) -> dict[str, float]:
        where = f"{self.metrics_path}, line {number}"
        try:
            row = parse_json(line.decode("utf-8"))
        except ValueError as error:
            raise RunError(f"{where}: not JSON ({error}). Remove the line") from error
        if not isinstance(row, dict) or not isinstance(row.get("frames"), int) or "seconds" not in row:
            raise RunError(f"{where}: no row of figures with its frames and seconds. Remove the line")
        for name, value in row.items():
            if not fits(value, float):
                raise RunError(f"{where}: {name} is {value!r:.40}, expected a finite number. Remove the line")
        return row

    def forget_metrics_after(self, frames: int) -> None:
        """Drop rows that training will write again when it resumes from a checkpoint at `frames`."""
        rows = [row for row in self.metrics() if row["frames"] <= frames]
        text = "".join(json.dumps(row) + "\n" for row in rows)
        if not self.metrics_path.exists() or read_text(self.metrics_path, MAX_METRICS_BYTES) != text:
            with written_whole(self.metrics_path) as part:
                part.write_text(text)


def check_goes_on(before: RunRecord, record: RunRecord, trained: Callable[[], int], place: str, option: str) -> None:
    """Refuse to go on with a run where a training of `record` is none that it can become.

    Args:
        before: of the run.
        record: of what is asked for.
        trained: frames of the run's newest checkpoint; 0 without one.
        place: where the run is.
        option: names another place.

    Raises:
        RunError: it is another experiment, if only by the code of its reward's terms; or it was to have other frames,
            and is not finished or has trained so many already.
    """
    begun, frames = before.learner.frames, record.learner.frames
    if changed := before.changed_terms(record):
        problem = f"{place}: the code of {changed[0]}, a term of its reward, has changed since the run began"
        raise RunError(f"{problem}. Undo the change, or give another {option}")
    if not before.with_frames(frames).same_experiment(record):
        problem = f"{place}: holds another experiment (see its {RUN_FILE})"
        raise RunError(f"{problem}. Give the same settings, or another {option}")
    if not before.same_experiment(record) and ((done := trained()) < begun or frames <= done):
        problem = f"{place}: was started for {begun} frames, and its schedules end there"
        remedy = f"Give --frames {begun}" if done < begun else f"Give --frames {begun}, more than {done}"
        raise RunError(f"{problem}. {remedy}, or another {option}")
