"""The memory that runs may share is the machine's, or what its groups leave."""

from pathlib import Path

import pytest

from clearway.experiments.free_memory import free_bytes

GIB = 1024**3


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    """The root of a machine with 9 GiB to give, in no group."""
    (tmp_path / "proc/self").mkdir(parents=True)
    (tmp_path / "proc/meminfo").write_text(f"MemTotal: 99 kB\nHugePages_Total: 0\nMemAvailable: {9 * 1024**2} kB\n")
    (tmp_path / "proc/self/cgroup").write_text("1:cpu:/\n0::/user/run\n")
    return tmp_path


def group(root: Path, name: str, most: str, used: int, cached: int) -> None:
    """A control group with a limit."""
    folder = root / "sys/fs/cgroup" / name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "memory.max").write_text(f"{most}\n")
    (folder / "memory.current").write_text(f"{used}\n")
    (folder / "memory.stat").write_text(f"anon 5\ninactive_file {cached}\n")


def test_without_groups_it_is_the_machine_s(machine: Path) -> None:
    assert free_bytes(machine) == 9 * GIB
    group(machine, "user/run", "max", 3 * GIB, 0)
    assert free_bytes(machine) == 9 * GIB


@pytest.mark.parametrize("name", ["", "user", "user/run"])
def test_a_group_s_limit_counts_less_what_it_uses_and_cannot_give_back(machine: Path, name: str) -> None:
    group(machine, name, str(8 * GIB), 3 * GIB, GIB)
    assert free_bytes(machine) == 6 * GIB
    group(machine, name, str(2 * GIB), 3 * GIB, 0)
    assert free_bytes(machine) == 0


def test_a_group_beside_the_process_s_does_not_count(machine: Path) -> None:
    group(machine, "other", str(GIB), 0, 0)
    assert free_bytes(machine) == 9 * GIB


def test_groups_of_the_first_version_count(machine: Path) -> None:
    folder = machine / "sys/fs/cgroup/memory"
    folder.mkdir(parents=True)
    (folder / "memory.limit_in_bytes").write_text(str(4 * GIB))
    (folder / "memory.usage_in_bytes").write_text(str(GIB))
    assert free_bytes(machine) == 9 * GIB  # without memory.stat it is not known
    (folder / "memory.stat").write_text("cache 7\n")
    assert free_bytes(machine) == 3 * GIB
    (machine / "proc/self/cgroup").write_text("4:cpu,memory:/user/run\n0::/\n")
    own = folder / "user/run"
    own.mkdir(parents=True)
    for name, text in (
        ("memory.limit_in_bytes", str(2 * GIB)),
        ("memory.usage_in_bytes", str(2 * GIB)),
        ("memory.stat", f"inactive_file 5\ntotal_inactive_file {GIB}\n"),
    ):
        (own / name).write_text(text)
    assert free_bytes(machine) == GIB


def test_where_nothing_is_told_nothing_is_known(tmp_path: Path) -> None:
    assert free_bytes(tmp_path) is None


def test_this_machine_tells_it() -> None:
    assert (free_bytes() is not None) == Path("/proc/meminfo").exists()
