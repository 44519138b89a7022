import errno
import json
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
import torch
from torch import Tensor

from clearway.errors import RunError
from clearway.learn import checkpoint
from clearway.learn.checkpoint import (
    KEPT,
    Progress,
    keep_newest_checkpoint,
    newest_checkpoint,
    read_network,
    read_progress,
    read_training,
    write_checkpoint,
)
from helpers.small_runs import equal_bits

FILES = ("network.safetensors", "training.safetensors", "checkpoint.json")


def tensors(seed: int) -> dict[str, Tensor]:
    rng = torch.Generator().manual_seed(seed)
    return {
        "a": torch.randn(3, 4, generator=rng),
        "turned": torch.randn(3, 4, generator=rng).T,
        "count": torch.tensor(seed),
        "flags": torch.tensor([True, False]),
        "drawn": torch.arange(3) + (seed << 40),
        "mean": torch.randn(2, generator=rng, dtype=torch.float64),
    }


def written(folder: Path, frames: int) -> Path:
    return write_checkpoint(folder, tensors(frames), tensors(frames + 1), Progress(frames, frames // 10, 1.5))


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_round_trip_bit_for_bit(tmp_path: Path) -> None:
    path = written(tmp_path / "checkpoints", 120)
    assert path.name == "frames-000000000120"
    assert sorted(f.name for f in path.iterdir()) == sorted(FILES)
    assert equal_bits(read_network(path), tensors(120))
    assert equal_bits(read_training(path), tensors(121))
    assert read_progress(path) == Progress(120, 12, 1.5)
    assert newest_checkpoint(tmp_path / "checkpoints") == path


def test_only_the_newest_few_stay(tmp_path: Path) -> None:
    for frames in (100, 200, 1_000, 90_000):
        written(tmp_path, frames)
    assert KEPT == 2
    assert names(tmp_path) == ["frames-000000001000", "frames-000000090000"]


def test_of_several_the_newest_whole_one_can_be_kept_alone(tmp_path: Path) -> None:
    older, damaged = written(tmp_path, 100), written(tmp_path, 200)
    flip_a_byte(damaged / FILES[0])
    with pytest.warns(UserWarning, match="SHA-256"):
        keep_newest_checkpoint(tmp_path)
    assert names(tmp_path) == [older.name]
    flip_a_byte(older / FILES[0])
    with pytest.warns(UserWarning), pytest.raises(RunError, match="every checkpoint is damaged"):
        keep_newest_checkpoint(tmp_path)
    assert names(tmp_path) == [older.name]


def test_writing_again_at_the_same_frame_replaces(tmp_path: Path) -> None:
    written(tmp_path, 100)
    write_checkpoint(tmp_path, tensors(7), tensors(8), Progress(100, 10, 2.0))
    assert names(tmp_path) == ["frames-000000000100"]
    assert equal_bits(read_network(newest_checkpoint(tmp_path)), tensors(7))


def test_damaged_newer_ones_do_not_push_out_what_is_written_now(tmp_path: Path) -> None:
    damaged, others = [written(tmp_path, frames) for frames in (200, 300)], [written(tmp_path, 100)]
    for path in damaged:
        flip_a_byte(path / FILES[0])
    others.append(written(tmp_path, 150))
    with pytest.warns(UserWarning, match="SHA-256"):
        assert newest_checkpoint(tmp_path) == others[1]
    assert others[0].exists()
    written(tmp_path, 250)
    assert names(tmp_path) == [f"frames-{frames:012d}" for frames in (200, 250, 300)]


def test_a_manifest_without_its_frames_is_damage(tmp_path: Path) -> None:
    older, newer = written(tmp_path, 100), written(tmp_path, 200)
    manifest = json.loads((newer / FILES[2]).read_text())
    del manifest["frames"]
    (newer / FILES[2]).write_text(json.dumps(manifest))
    with pytest.warns(UserWarning, match="lacks a number"):
        assert newest_checkpoint(tmp_path) == older


def flip_a_byte(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0x80
    path.write_bytes(content)


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-7])


def remove(path: Path) -> None:
    path.unlink()


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("damage", [flip_a_byte, truncate, remove])
def test_a_damaged_checkpoint_is_passed_over_and_refused(
    name: str, damage: Callable[[Path], None], tmp_path: Path
) -> None:
    older, newer = written(tmp_path, 100), written(tmp_path, 200)
    damage(newer / name)
    with pytest.warns(UserWarning, match="an earlier checkpoint is used"):
        assert newest_checkpoint(tmp_path) == older
    for read in (read_network, read_training, read_progress):
        with pytest.raises(RunError, match="frames-000000000200"):
            read(newer)


def test_a_manifest_that_is_something_else_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, 100)
    for content in ("[]", '{"format_version": "x", "sha256": {}}', '{"format_version": 1, "sha256": {}}', "null"):
        (path / "checkpoint.json").write_text(content)
        with pytest.raises(RunError):
            read_network(path)


def test_no_checkpoint_at_all(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="no checkpoint"):
        newest_checkpoint(tmp_path / "nothing")
    with pytest.raises(RunError, match="incomplete"):
        read_network(tmp_path / "frames-000000000001")


def test_all_damaged_is_an_error_that_says_so(tmp_path: Path) -> None:
    flip_a_byte(written(tmp_path, 100) / "network.safetensors")
    with pytest.warns(UserWarning), pytest.raises(RunError, match="every checkpoint is damaged"):
        newest_checkpoint(tmp_path)


def test_a_newer_format_is_refused_with_the_remedy(tmp_path: Path) -> None:
    path = written(tmp_path, 100)
    manifest = json.loads((path / "checkpoint.json").read_text())
    (path / "checkpoint.json").write_text(json.dumps(manifest | {"format_version": 2}))
    with pytest.raises(RunError, match="Upgrade clearway"):
        read_network(path)
    (path / "training.safetensors").rename(path / "state.safetensors")  # a newer one may hold other files
    with pytest.raises(RunError, match="Upgrade clearway"):
        read_network(path)
    written(tmp_path, 50)
    with pytest.raises(RunError, match="Upgrade clearway"):  # not damaged, so no older one in its place
        newest_checkpoint(tmp_path)


@pytest.mark.parametrize("full_at", [1, 2])
def test_a_full_disk_leaves_the_previous_one_and_no_part(
    full_at: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = written(tmp_path, 100)
    save, calls = checkpoint.save_file, []

    def full(content: Mapping[str, Tensor], path: Path) -> None:
        calls.append(path)
        save(content, path)
        if len(calls) == full_at:
            path.write_bytes(path.read_bytes()[:20])
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(checkpoint, "save_file", full)
    with pytest.raises(RunError, match="No space left on device"):
        written(tmp_path, 200)
    assert names(tmp_path) == [before.name]
    assert newest_checkpoint(tmp_path) == before
    monkeypatch.undo()
    assert newest_checkpoint(tmp_path) != written(tmp_path, 200)


def test_what_a_killed_process_left_half_written_is_ignored_and_swept(tmp_path: Path) -> None:
    before = written(tmp_path, 100)
    half = tmp_path / ".frames-000000000150.part"
    half.mkdir()
    (half / "network.safetensors").write_bytes(b"half")
    assert newest_checkpoint(tmp_path) == before
    written(tmp_path, 200)
    assert names(tmp_path) == ["frames-000000000100", "frames-000000000200"]
