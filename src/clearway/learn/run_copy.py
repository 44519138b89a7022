"""The copy of a run in an object store: brought up to date after each checkpoint, and gone on with from there.

A checkpoint's manifest is put last and removed first, and one without a manifest is none: a checkpoint there is whole
or not at all, whatever is killed when. Metrics are put before it, since rows beyond a checkpoint are dropped, and
`run.json` after it, without which there is no run.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import threading
import warnings
from collections.abc import Sequence
from pathlib import Path

from clearway.errors import ClearwayError, RunError
from clearway.files import check_free, folder_written_whole
from clearway.learn.checkpoint import KEPT, MANIFEST_FILE, NETWORK_FILE, TRAINING_FILE, checkpoints, frames_in, is_name
from clearway.learn.run_folder import (
    CHECKPOINTS,
    COPIED,
    METRICS_FILE,
    RUN_FILE,
    SETTINGS_FILE,
    RunFolder,
    check_goes_on,
)
from clearway.learn.run_record import RunRecord
from clearway.remote.address import address_of
from clearway.remote.store import WRITABLE, Store

PROBE = "may-be-removed"  # a file's name
FILES = (NETWORK_FILE, TRAINING_FILE, MANIFEST_FILE)


class RunCopy:
    """A run's copy.

    Args:
        address: of its folder, such as s3://bucket/run.

    Raises:
        ClearwayError: it is no address that can be written to, or the package for it is not installed.
    """

    def __init__(self, address: str) -> None:
        known = address_of(address)
        if known is None or known.partition(":")[0] not in WRITABLE:
            schemes = " or ".join(f"{scheme}://" for scheme in WRITABLE)
            raise RunError(
                f"copy_to={address:.80}: expected an address of {schemes}. Give one, such as s3://bucket/run"
            )
        self.address, self.store = known.rstrip("/"), Store(known)

    def check_fits(self, folder: RunFolder) -> None:
        """Refuse to copy a run over another one, or over one that has come further elsewhere.

        Raises:
            ClearwayError: the store holds such a run, or cannot be read.
        """
        if not self.holds_a_run:
            return
        ours = folder.read_record()
        if not self._record().with_frames(ours.learner.frames).same_experiment(ours):
            raise RunError(f"{self.address}: holds another experiment than {folder.path}. Give another --copy-to")
        here = [path.name for path in checkpoints(folder.checkpoints)]
        if (there := self._checkpoints()) and (not here or there[-1] > here[-1]):
            problem = f"{self.address}: has come further than {folder.path}, to {there[-1]}"
            raise RunError(f"{problem}. Go on from it with an empty --out, or give another --copy-to")

    def check_goes_on(self, folder: Path, record: RunRecord) -> None:
        """Refuse what would be refused once the run was fetched: to fetch it, or to go on with it. Nothing is fetched.

        Raises:
            ClearwayError: the folder holds something, the run cannot become one of `record`, or the store cannot be
                read.
        """
        if self.holds_a_run:
            check_free(folder)
            check_goes_on(self._record(), record, self._trained_frames, self.address, "--copy-to")

    def _record(self) -> RunRecord:
        """Of the run there."""
        with tempfile.TemporaryDirectory() as part:
            self._fetch(Path(part), RUN_FILE)
            return RunFolder(Path(part)).read_record()

    def _trained_frames(self) -> int:
        """Frames of the newest whole checkpoint; 0 without one."""
        return max(map(frames_in, self._checkpoints()), default=0)

    def check_writable(self) -> None:
        """Write a file and remove it, before hours of training. Raises ClearwayError where that cannot be done."""
        with tempfile.NamedTemporaryFile() as probe:
            self.store.upload(Path(probe.name), self._place(PROBE))
        self.store.remove(self._place(PROBE))

    @property
    def holds_a_run(self) -> bool:
        """Whether there is one to go on with. Raises ClearwayError where the store cannot be asked."""
        return RUN_FILE in self.store.names(self.address)

    def update(self, folder: Path) -> None:
        """Make the copy agree with a run folder.

        Raises:
            ClearwayError: the store cannot be written to; what it holds can still be gone on with.
        """
        names = self._names()
        there, here = self._whole(names), {path.name: path for path in checkpoints(folder / CHECKPOINTS)}
        self._put(folder, METRICS_FILE, SETTINGS_FILE)
        for name in sorted(set(here) - set(there)):
            for part in FILES:
                self.store.upload(here[name] / part, self._place(CHECKPOINTS, name, part))
        self._put(folder, RUN_FILE)
        kept = sorted({*there, *here})[-KEPT:]
        for old in sorted({*names, *here}.difference(kept)):  # what is in part there was cut off
            for part in reversed(FILES):
                self.store.remove(self._place(CHECKPOINTS, old, part))

    def restore(self, folder: Path) -> bool:
        """Fetch the run into a folder that is not there or empty, whole or not at all; False where there is no copy.

        Raises:
            ClearwayError: the store cannot be read, or the folder holds something.
        """
        names = self.store.names(self.address)
        if RUN_FILE not in names:
            return False
        with folder_written_whole(folder) as part:
            for name in self._checkpoints():
                (part / CHECKPOINTS / name).mkdir(parents=True)
                for file in FILES:
                    self._fetch(part, CHECKPOINTS, name, file)
            for file in (METRICS_FILE, SETTINGS_FILE, RUN_FILE):
                if file in names:
                    self._fetch(part, file)
        return True

    def _put(self, folder: Path, *names: str) -> None:
        """Those that there are."""
        for name in names:
            if (folder / name).exists():
                self.store.upload(folder / name, self._place(name))

    def _fetch(self, folder: Path, *parts: str) -> None:
        self.store.download(self.store.file(self._place(*parts)), folder.joinpath(*parts))

    def _checkpoints(self) -> list[str]:
        """Names of those that are whole, ascending."""
        return self._whole(self._names())

    def _names(self) -> list[str]:
        """Of all, also of those that are there in part, ascending."""
        return list(filter(is_name, self.store.names(self._place(CHECKPOINTS))))

    def _whole(self, names: Sequence[str]) -> list[str]:
        return [name for name in names if MANIFEST_FILE in self.store.names(self._place(CHECKPOINTS, name))]

    def _place(self, *parts: str) -> str:
        return "/".join((self.address, *parts))


class CopyingMeanwhile:
    """Copies that are made by a thread while training goes on; a checkpoint that comes during one is left out.

    Args:
        copy: where to.
    """

    def __init__(self, copy: RunCopy) -> None:
        self.copy = copy
        self._thread: threading.Thread | None = None
        self._fault: ClearwayError | OSError | None = None

    def begin(self, folder: Path) -> None:
        """Copy a run folder as it is now, unless a copy is under way.

        Warns:
            UserWarning: this copy or the one before failed; training goes on, and the next checkpoint is copied again.
        """
        if self._thread is not None and self._thread.is_alive():
            return
        self.wait()
        try:
            part = Path(tempfile.mkdtemp(prefix=COPIED, dir=folder))
        except OSError as fault:
            self._warn(fault)
            return
        try:
            _snapshot(folder, part)
        except OSError as fault:
            shutil.rmtree(part, ignore_errors=True)
            self._warn(fault)
            return
        self._thread = threading.Thread(target=self._update, args=(part,), daemon=True)
        self._thread.start()

    def wait(self) -> None:
        """Wait until no copy is under way. Warns as `begin`."""
        if self._thread is not None:
            self._thread.join()
        fault, self._fault, self._thread = self._fault, None, None
        if fault is not None:
            self._warn(fault)

    def _warn(self, fault: Exception) -> None:
        warnings.warn(f"not copied: {fault}. The run itself is whole where it is trained", stacklevel=4)

    def _update(self, part: Path) -> None:
        try:
            self.copy.update(part)
        except (ClearwayError, OSError) as fault:
            self._fault = fault
        finally:
            shutil.rmtree(part, ignore_errors=True)


def _snapshot(folder: Path, part: Path) -> None:
    """Keep what is copied of a run as it is now, whatever training removes: checkpoints under a second name."""
    if (folder / CHECKPOINTS).exists():
        shutil.copytree(folder / CHECKPOINTS, part / CHECKPOINTS, copy_function=_linked)
    for name in (METRICS_FILE, SETTINGS_FILE, RUN_FILE):
        if (folder / name).exists():
            shutil.copyfile(folder / name, part / name)


def _linked(source: str, copy: str) -> None:
    try:
        os.link(source, copy)
    except OSError:  # the file system knows no second names
        shutil.copyfile(source, copy)
