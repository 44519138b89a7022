"""`Views`: some shards, and their pictures in shuffled batches.

A shard is read in blocks of neighbouring poses, which are as random as any others of the room. The blocks of all rooms
are shuffled, and so many of them are in memory at a time; their pictures are shuffled together. The order follows from
seed and epoch alone, so that a training goes on with any batch of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Integral
from pathlib import Path

import numpy as np

from clearway.errors import ArgumentError, SceneError
from clearway.remote.passing import in_turn
from clearway.scenes.scene_files import scene_files
from clearway.scenes.sensors import Sensor
from clearway.views.settings import ViewSettings, differing
from clearway.views.shard import Shard, read_shard
from clearway.views.table import ViewTable, joined

BLOCK_POSES = 64
BLOCKS_AT_ONCE = 16
BLOCK_BYTES = 64 * 1024**2  # of a block of large pictures, which then has fewer poses


@dataclass(frozen=True, eq=False)
class ViewBatch:
    """B pictures.

    Attributes:
        room: (B,) int64, index of each picture's room in `Views.rooms`.
        table: what is known of them, B rows.
        seen: by each sensor's name the pictures as they are kept: `rgb` (B, height, width, 3) uint8, `depth`
            (B, height, width) uint16 millimetres.
    """

    room: np.ndarray
    table: ViewTable
    seen: Mapping[str, np.ndarray]

    def __len__(self) -> int:
        """B."""
        return len(self.room)

    def __getitem__(self, rows: np.ndarray | slice) -> ViewBatch:
        """Some pictures, in the order asked for."""
        return ViewBatch(self.room[rows], self.table[rows], {name: seen[rows] for name, seen in self.seen.items()})


@dataclass(frozen=True, eq=False)
class Views:
    """Views of some rooms.

    Attributes:
        shards: one a room, by name.
    """

    shards: tuple[Shard, ...]

    @cached_property
    def rooms(self) -> tuple[str, ...]:
        """Names of the rooms, as `ViewBatch.room` counts them."""
        return tuple(shard.room for shard in self.shards)

    @property
    def takes(self) -> int:
        """Pictures of each pose, of all rooms alike."""
        return self.shards[0].takes

    @property
    def sensors(self) -> tuple[Sensor, ...]:
        """What took the pictures, of all rooms alike, colour first."""
        return self.shards[0].sensors

    @property
    def settings(self) -> ViewSettings:
        """Which pictures these are, of all rooms alike."""
        return self.shards[0].settings

    def __len__(self) -> int:
        """Number of pictures."""
        return sum(len(shard) for shard in self.shards)

    def batches(
        self,
        pictures: int,
        *,
        seed: int = 0,
        epoch: int = 0,
        start: int = 0,
        together: int = 1,
        sensors: Sequence[str] | None = None,
        blocks_at_once: int = BLOCKS_AT_ONCE,
    ) -> Iterator[ViewBatch]:
        """All pictures once, shuffled. The takes of a pose come one after the other.

        Args:
            pictures: of a batch, a multiple of `together` times the takes of a pose; the last one may have fewer.
            seed: another one is another order.
            epoch: likewise.
            start: batches to leave out, to go on after them; none of them is read.
            together: so many poses of one room, drawn at random, come one after the other. Poses of a block that are
                left over from this are left out; each time others.
            sensors: names; None: all.
            blocks_at_once: blocks in memory, of 64 poses with their takes each, mostly of as many rooms.

        Raises:
            ArgumentError: an argument is out of range.
            SceneError: a shard is gone, damaged, or another than when it was opened; when it is come to.
        """
        names = tuple(sensor.name for sensor in self.sensors) if sensors is None else tuple(sensors)
        self._check(pictures, seed, epoch, start, together, names, blocks_at_once)
        blocks = self._blocks(together)
        order = np.random.default_rng([seed, epoch]).permutation(len(blocks)).tolist()
        windows = [
            [blocks[number] for number in order[at : at + blocks_at_once]]
            for at in range(0, len(order), blocks_at_once)
        ]
        return self._stream(windows, pictures, (seed, epoch), start * pictures, together, names)

    def batch_count(self, pictures: int, together: int = 1) -> int:
        """Batches of so many pictures in an epoch, see `batches`."""
        return -(-sum(block.rows(self.takes, together) for block in self._blocks(together)) // pictures)

    def _check(
        self,
        pictures: int,
        seed: int,
        epoch: int,
        start: int,
        together: int,
        names: tuple[str, ...],
        blocks_at_once: int,
    ) -> None:
        for name, number, least in (
            ("pictures", pictures, 1),
            ("seed", seed, 0),
            ("epoch", epoch, 0),
            ("start", start, 0),
            ("together", together, 1),
            ("blocks_at_once", blocks_at_once, 1),
        ):
            if not isinstance(number, Integral) or isinstance(number, bool) or number < least:
                raise ArgumentError(f"{name}={number!r:.40}: expected a whole number from {least} on. Give one")
        if pictures % (together * self.takes):
            whole = together * self.takes
            raise ArgumentError(f"pictures={pictures}: {together} poses together have {whole}. Give a multiple of it")
        if together > (fewest := min(len(shard) // self.takes for shard in self.shards)):
            raise ArgumentError(f"together={together}: a room has but {fewest} poses. Give fewer")
        known = [sensor.name for sensor in self.sensors]
        if not names or not set(names) <= set(known) or len(set(names)) < len(names):
            raise ArgumentError(f"sensors={names!r:.80}: expected some of {', '.join(known)}, each once. Correct it")

    def _blocks(self, together: int) -> list[_Block]:
        """All blocks, room after room."""
        pose_bytes = self.takes * sum(sensor.kept_bytes for sensor in self.sensors)
        poses = together * max(1, min(BLOCK_POSES, BLOCK_BYTES // pose_bytes) // together)
        found = []
        for room, shard in enumerate(self.shards):
            count = len(shard) // self.takes
            firsts = range(0, max(1, count - together + 1), poses)  # a rest below `together` goes with the last block
            ends = [*firsts[1:], count]
            found += [_Block(room, first, end - first) for first, end in zip(firsts, ends, strict=True)]
        return found

    def _stream(
        self,
        windows: Sequence[Sequence[_Block]],
        pictures: int,
        chances: tuple[int, int],
        skipped: int,
        together: int,
        names: tuple[str, ...],
    ) -> Iterator[ViewBatch]:
        parts: list[ViewBatch] = []
        for number, blocks in enumerate(windows):
            rows = sum(block.rows(self.takes, together) for block in blocks)
            if skipped >= rows:
                skipped -= rows
                continue
            rng = np.random.default_rng([*chances, number])
            pool = self._pool(blocks, names)
            order = _order(blocks, self.takes, together, rng)[skipped:]
            skipped = 0
            while len(order):
                wanted = pictures - sum(len(part) for part in parts)
                parts.append(pool[order[:wanted]])
                order = order[wanted:]
                if sum(len(part) for part in parts) == pictures:
                    yield _joined(parts)
                    parts = []
            del pool  # before the next one is read
        if parts:
            yield _joined(parts)

    def _pool(self, blocks: Sequence[_Block], names: tuple[str, ...]) -> ViewBatch:
        """All pictures of some blocks, one block after the other."""
        takes, tables, begin = self.takes, [], 0
        room = np.repeat([block.room for block in blocks], [block.poses * takes for block in blocks])
        chosen = [sensor for sensor in self.sensors if sensor.name in names]
        seen = {sensor.name: np.empty((len(room), *sensor.shape), sensor.kept_dtype) for sensor in chosen}
        paths = [self.shards[block.room].path for block in blocks]
        for block, _ in zip(blocks, in_turn(paths), strict=True):
            shard = self.shards[block.room]
            rows = slice(block.first * takes, (block.first + block.poses) * takes)
            end = begin + block.poses * takes
            for name, pictures in seen.items():
                pictures[begin:end] = shard.seen(name, rows)
            tables.append(shard.table[rows])
            begin = end
        return ViewBatch(room, joined(tables), seen)


@dataclass(frozen=True)
class _Block:
    """Neighbouring poses of a shard: its room, its first pose, and how many."""

    room: int
    first: int
    poses: int

    def rows(self, takes: int, together: int) -> int:
        """Pictures of it that come in an epoch."""
        return self.poses // together * together * takes


def views_in(paths: Sequence[Path]) -> Views:
    """The views in some shards, or folders of them. Pictures stay in the files until they are looked at.

    Raises:
        ClearwayError: there is no such file, a folder holds none, a file is no sound shard, or they do not belong
            together.
    """
    shards = list(map(read_shard, in_turn(scene_files(paths, "clearway scenes views"))))
    first, seen = shards[0], set()
    for shard in shards:
        if other := differing(shard.settings, first.settings):
            raise SceneError(shard.path, f"has {other}, as {first.path} has it", "Open them one by one")
        if shard.room in seen:
            raise SceneError(shard.path, f"shows {shard.room}, as another file does", "Leave one of them out")
        seen.add(shard.room)
    return Views(tuple(shards))


def _order(blocks: Sequence[_Block], takes: int, together: int, rng: np.random.Generator) -> np.ndarray:
    """The rows of some blocks, one after the other, in a random order: takes and poses that go together stay so."""
    groups, begin = [], 0
    for block in blocks:
        poses = rng.permutation(block.poses)[: block.poses // together * together]
        rows = (begin + takes * poses)[:, None] + np.arange(takes)
        groups.append(rows.reshape(-1, together * takes))
        begin += block.poses * takes
    every = np.concatenate(groups)
    return every[rng.permutation(len(every))].reshape(-1)


def _joined(batches: Sequence[ViewBatch]) -> ViewBatch:
    if len(batches) == 1:
        return batches[0]
    return ViewBatch(
        np.concatenate([batch.room for batch in batches]),
        joined([batch.table for batch in batches]),
        {name: np.concatenate([batch.seen[name] for batch in batches]) for name in batches[0].seen},
    )
