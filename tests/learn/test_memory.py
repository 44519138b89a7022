"""Memory that runs out in training, by limits of the system itself: one line, and the last checkpoint goes on."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from clearway.learn.checkpoint import newest_checkpoint, read_network, read_progress, read_training
from clearway.learn.run_folder import RunFolder
from clearway.scenes.thor_v1 import write_scene
from helpers.made import grid_scene
from helpers.small_runs import equal_bits

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="Linux bounds memory so")]

LIMIT_BYTES = 2 << 30  # of a cgroup; a training begins with 0.5 GiB
FRAMES, UPDATE_FRAMES, FULL_AFTER = 2_000, 400, 3
TRAINING = """
import sys
from pathlib import Path
import torch
from clearway.cli.main import main
from clearway.learn import train
from clearway.learn.trainer import Trainer

train.SECONDS_BETWEEN_CHECKPOINTS = 0.0
update = Trainer.update

def until_full(trainer):
    if trainer.updates == {full_after}:
        {full}
    return update(trainer)

Trainer.update = until_full
sys.exit(main(sys.argv[1:]))
"""
BOUNDED = "import resource; used = int(Path('/proc/self/statm').read_text().split()[0]) * resource.getpagesize(); "
BOUNDED += "resource.setrlimit(resource.RLIMIT_AS, (used, used))"  # this process gets no more than it has
GROWING = "trainer.kept = [torch.ones(1 << 26) for _ in range(100)]"  # 25 GiB


@pytest.fixture
def cgroup() -> Iterator[Path]:
    """A cgroup of our own with a limit of memory; skips where the system lets us make none."""
    folder = Path("/sys/fs/cgroup/memory" if Path("/sys/fs/cgroup/memory").is_dir() else "/sys/fs/cgroup")
    own = folder / f"clearway-test-{os.getpid()}"
    try:
        own.mkdir()
        limit = next(own / name for name in ("memory.max", "memory.limit_in_bytes") if (own / name).exists())
        limit.write_text(str(LIMIT_BYTES))
    except (OSError, StopIteration):
        if own.exists():
            own.rmdir()
        pytest.skip("no cgroup can be made here")
    yield own
    own.rmdir()


def trained(scene: Path, out: Path, full: str | None, begin: str = "") -> subprocess.CompletedProcess[str]:
    """`clearway train` in a process of its own; `full` is run in it after some updates, `begin` first of all."""
    code = begin + TRAINING.format(full_after=FULL_AFTER if full else -1, full=full or "pass")
    small = ["--frames", str(FRAMES), "--set", "envs=40", "rollout_steps=10", "width=256", "--threads", "1"]
    words = [sys.executable, "-c", code, "train", str(scene), "--out", str(out), "--resume", *small]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "MALLOC_MMAP_THRESHOLD_": "65536"}
    return subprocess.run(words, capture_output=True, text=True, env=environment, timeout=300, check=False)


def check_goes_on(scene: Path, out: Path) -> None:
    """What is left is whole, and ends in the bits of a training that had memory enough."""
    assert read_progress(newest_checkpoint(RunFolder(out).checkpoints)).frames == FULL_AFTER * UPDATE_FRAMES
    whole = out.with_name("whole")
    for folder in (out, whole):
        done = trained(scene, folder, None)
        assert done.returncode == 0, done.stderr
    ends = [newest_checkpoint(RunFolder(folder).checkpoints) for folder in (out, whole)]
    assert equal_bits(*[read_network(end) for end in ends])
    assert equal_bits(*[read_training(end) for end in ends])


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "room.h5"
    write_scene(grid_scene(0, width=6, depth=6, feature_count=256), path)
    return path


def test_a_limit_of_address_space_is_one_line_and_the_run_goes_on(scene: Path, tmp_path: Path) -> None:
    done = trained(scene, tmp_path / "run", BOUNDED)
    last = done.stderr.splitlines()[-1]
    assert done.returncode == 2, done.stderr
    assert last.startswith("error: not enough memory (") and "a training goes on with --resume" in last
    assert "Traceback" not in done.stderr
    check_goes_on(scene, tmp_path / "run")


def test_what_the_system_kills_for_its_memory_goes_on(scene: Path, tmp_path: Path, cgroup: Path) -> None:
    enter = f"import os; open({str(cgroup / 'cgroup.procs')!r}, 'w').write(str(os.getpid()))\n"
    done = trained(scene, tmp_path / "run", GROWING, begin=enter)
    assert done.returncode == -signal.SIGKILL, done.stderr
    check_goes_on(scene, tmp_path / "run")
