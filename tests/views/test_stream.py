"""Every picture comes once an epoch, in an order that seed and epoch fix, from any batch on."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import clearway
from clearway.errors import ClearwayError
from clearway.views import stream
from clearway.views.shard import Shard
from clearway.views.stream import ViewBatch, Views
from helpers.made_views import SETTINGS, made_views, write_made

ROOMS = ("a", "b", "c")


@pytest.fixture
def views(tmp_path: Path, monkeypatch) -> Views:
    """Three rooms of ten poses, two takes each, read in blocks of four poses."""
    monkeypatch.setattr(stream, "BLOCK_POSES", 4)
    for seed, name in enumerate(ROOMS):
        write_made(tmp_path, name, seed=seed)
    return clearway.open_views(tmp_path)


def named(batch: ViewBatch) -> list[tuple[int, int, int]]:
    """Room, pose and take of each picture."""
    return list(zip(batch.room.tolist(), batch.table.pose.tolist(), batch.table.take.tolist(), strict=True))


def flat(batches) -> list[tuple[int, int, int]]:
    return [row for batch in batches for row in named(batch)]


EVERY = [(room, pose, take) for room in range(3) for pose in range(10) for take in range(2)]


def test_what_is_there_is_told(views) -> None:
    assert len(views) == 60 and views.rooms == ROOMS and views.takes == 2
    assert views.settings == SETTINGS and [sensor.name for sensor in views.sensors] == ["rgb", "depth"]


@pytest.mark.parametrize("blocks_at_once", [1, 2, 16])
def test_every_picture_comes_once_with_what_is_known_of_it(views, blocks_at_once) -> None:
    batches = list(views.batches(8, seed=3, blocks_at_once=blocks_at_once))
    assert [len(batch) for batch in batches] == [8] * 7 + [4] and views.batch_count(8) == 8
    assert sorted(flat(batches)) == EVERY
    made = [made_views(SETTINGS, seed) for seed in range(3)]
    for batch in batches:
        for row, (room, pose, take) in enumerate(named(batch)):
            here = 2 * pose + take
            np.testing.assert_array_equal(batch.seen["rgb"][row], made[room].rgb[here])
            np.testing.assert_array_equal(batch.seen["depth"][row], made[room].further[0].raw[here])
            assert batch.table.free_m[row].tolist() == made[room].table.free_m[here].tolist()
            assert batch.table.heading_deg[row] == made[room].table.heading_deg[here]


def test_rooms_and_poses_are_mixed_and_takes_stay_together(views) -> None:
    order = flat(views.batches(8, seed=1))
    assert all(order[at][:2] == order[at + 1][:2] for at in range(0, 60, 2))
    rooms = [room for room, _, _ in order[::2]]
    assert sum(one != other for one, other in pairwise(rooms)) > 10
    poses = [pose for room, pose, _ in order[::2] if room == 0]
    assert poses != sorted(poses)
    blocks: dict[tuple[int, int], list[int]] = {}
    for room, pose, _ in flat(views.batches(8, seed=1, blocks_at_once=1)):
        blocks.setdefault((room, pose // 4), []).append(pose % 4)
    assert len({tuple(poses) for poses in blocks.values() if len(poses) == 8}) > 1  # each in an order of its own


def test_poses_of_a_room_come_together_where_that_is_asked_for(views) -> None:
    for together in (2, 4, 5):
        order = flat(views.batches(2 * together, seed=1, together=together))
        groups = [order[at : at + 2 * together] for at in range(0, len(order), 2 * together)]
        assert all(len({room for room, _, _ in group}) == 1 for group in groups)
        assert len(order) == 60 // (2 * together) * 2 * together or together == 4
        assert len(set(order)) == len(order)
        assert views.batch_count(2 * together, together) == len(groups)
    left = [set(EVERY) - set(flat(views.batches(8, epoch=epoch, together=4))) for epoch in range(4)]
    assert {len(one) for one in left} == {12}  # of ten poses two blocks of four


def test_seed_and_epoch_fix_the_order(views) -> None:
    first = flat(views.batches(8, seed=1, epoch=2))
    assert flat(views.batches(8, seed=1, epoch=2)) == first
    assert flat(views.batches(8, seed=1, epoch=3)) != first != flat(views.batches(8, seed=2, epoch=2))
    assert flat(views.batches(16, seed=1, epoch=2)) == first  # whatever the size of a batch


@pytest.mark.parametrize("blocks_at_once", [1, 3, 16])
def test_it_goes_on_with_any_batch(views, blocks_at_once, monkeypatch) -> None:
    options = {"seed": 1, "epoch": 1, "blocks_at_once": blocks_at_once}
    whole = list(views.batches(6, **options))
    for start in range(len(whole) + 2):
        rest = list(views.batches(6, start=start, **options))
        assert len(rest) == max(0, len(whole) - start)
        for batch, other in zip(rest, whole[start:], strict=True):
            assert named(batch) == named(other)
            np.testing.assert_array_equal(batch.seen["rgb"], other.seen["rgb"])
    read: list[str] = []
    seen = Shard.seen
    monkeypatch.setattr(Shard, "seen", lambda shard, *given: read.append(shard.room) or seen(shard, *given))
    assert list(views.batches(6, start=len(whole), **options)) == [] and read == []


def test_one_sensor_alone_can_be_read(views, monkeypatch) -> None:
    (batch,) = views.batches(60, sensors=("depth",))
    assert list(batch.seen) == ["depth"]
    depth = views.sensors[1].values(batch.seen["depth"])
    assert depth.dtype == np.float32 and depth.min() >= 0 and depth.max() <= 20


def test_poses_that_are_too_few_for_a_block_go_with_the_one_before(views, monkeypatch) -> None:
    monkeypatch.setattr(stream, "BLOCK_POSES", 4)  # of ten poses three, three and four
    seen = {row for epoch in range(20) for row in flat(views.batches(6, epoch=epoch, together=3))}
    assert seen == set(EVERY)
    assert views.batch_count(6, together=3) == 3 * 3


def test_a_room_of_fewer_poses_than_go_together_is_named(views) -> None:
    assert views.batch_count(22, together=11) == 0
    with pytest.raises(ClearwayError, match="together=11: a room has but 10 poses"):
        views.batches(22, together=11)


def test_blocks_of_large_pictures_are_smaller(views, monkeypatch) -> None:
    pose_bytes = 2 * (16 * 16 * 3 + 16 * 16 * 2)
    monkeypatch.setattr(stream, "BLOCK_BYTES", 2 * pose_bytes + 1)
    asked: list[int] = []
    seen = Shard.seen
    monkeypatch.setattr(
        Shard, "seen", lambda shard, name, rows: asked.append(rows.stop - rows.start) or seen(shard, name, rows)
    )
    assert sorted(flat(views.batches(8))) == EVERY
    assert set(asked) == {4}


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"pictures": 0}, "pictures=0: expected a whole number from 1"),
        ({"pictures": 7}, "pictures=7: 1 poses together have 2. Give a multiple"),
        ({"pictures": 8, "together": 3}, "pictures=8: 3 poses together have 6"),
        ({"pictures": 22, "together": 11}, "together=11: a room has but 10 poses"),
        ({"pictures": 2.0}, "pictures=2.0"),
        ({"pictures": 8, "epoch": -1}, "epoch=-1"),
        ({"pictures": 8, "start": True}, "start=True"),
        ({"pictures": 8, "sensors": ("sonar",)}, "expected some of rgb, depth"),
        ({"pictures": 8, "sensors": ()}, "expected some of rgb, depth"),
    ],
)
def test_wrong_arguments_are_one_error_at_once(views, asked, said) -> None:
    with pytest.raises(ClearwayError, match=said):
        views.batches(**asked)


def test_a_shard_that_goes_away_is_told(views, tmp_path) -> None:
    (tmp_path / "b.h5").unlink()
    with pytest.raises(ClearwayError, match=r"b\.h5: has changed since"):
        list(views.batches(8))


def test_what_does_not_belong_together_is_refused(tmp_path) -> None:
    write_made(tmp_path, "a")
    write_made(tmp_path, "b", replace(SETTINGS, seed=5))
    with pytest.raises(ClearwayError, match=r"b\.h5: has seed 5 instead of 0, as .*a\.h5 has it"):
        clearway.open_views(tmp_path)
    (tmp_path / "a2.h5").write_bytes((tmp_path / "a.h5").read_bytes())
    with pytest.raises(ClearwayError, match="shows a, as another file does"):
        clearway.open_views([tmp_path / "a.h5", str(tmp_path / "a2.h5")])
    for wrong, said in (
        (3, "views=3"),
        ([3], "views=3"),
        (tmp_path / "none", "no such file. Check the path, or make it with clearway scenes views"),
        ([], "none given"),
    ):
        with pytest.raises(ClearwayError, match=said):
            clearway.open_views(wrong)
