"""`Case`, one hostile file and what may come of reading it, and the damage that any file can suffer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SECTOR_BYTES = 512


@dataclass(frozen=True)
class Case:
    """A hostile file.

    Attributes:
        group: line of the summary that it counts in.
        name: what is wrong with it.
        make: writes it into an empty folder and gives back what the reader is handed.
        read: reads it and gives back a digest of all that was read.
        says: what the refusal must say; empty where a harmless read is as good.
        same: digest of the whole original: nothing else may be read; empty where there is none.
    """

    group: str
    name: str
    make: Callable[[Path], Path]
    read: Callable[[Path], str]
    says: str = ""
    same: str = ""


@dataclass(frozen=True)
class Sound:
    """A sound file, to be damaged.

    Attributes:
        group: as of a case.
        file: its name.
        content: its bytes.
        read: as of a case.
        same: as of a case.
        beside: writes the other files of its folder.
    """

    group: str
    file: str
    content: bytes
    read: Callable[[Path], str]
    same: str = ""
    beside: Callable[[Path], object] = lambda folder: None

    def case(self, kind: str, name: str, content: bytes) -> Case:
        """The same file with other bytes."""

        def make(folder: Path) -> Path:
            self.beside(folder)
            path = folder / self.file
            path.write_bytes(content)
            return path

        return Case(f"{self.group}: {kind}", name, make, self.read, same=self.same)

    def flipped(self, count: int, seed: int = 0) -> Iterator[Case]:
        """One bit flipped, at places drawn without replacement."""
        every = 8 * len(self.content)
        for bit in np.random.default_rng(seed).choice(every, size=min(count, every), replace=False).tolist():
            hurt = bytearray(self.content)
            hurt[bit // 8] ^= 1 << bit % 8
            yield self.case("flipped bits", f"bit {bit}", bytes(hurt))

    def cut(self, count: int) -> Iterator[Case]:
        """Cut at lengths from 0 on, evenly, and at the last bytes."""
        whole = len(self.content)
        for length in sorted({*np.linspace(0, whole - 1, count).astype(int).tolist(), whole - 2, whole - 3}):
            yield self.case("truncated", f"{length} of {whole} bytes", self.content[:length])

    def overwritten(self, count: int, seed: int = 0) -> Iterator[Case]:
        """Lost sectors, which read as zeros; sectors with noise in them; sectors in each other's place."""
        rng = np.random.default_rng(seed)
        sectors = -(-len(self.content) // SECTOR_BYTES)
        for number in range(count):
            hurt = bytearray(self.content)
            first, second = (SECTOR_BYTES * int(sector) for sector in rng.integers(sectors, size=2))
            here, there = slice(first, first + SECTOR_BYTES), slice(second, second + SECTOR_BYTES)
            if number % 3 == 0:
                hurt[here] = bytes(len(hurt[here]))
            elif number % 3 == 1:
                hurt[here] = rng.bytes(len(hurt[here]))
            elif len(hurt[here]) == len(hurt[there]):
                hurt[here], hurt[there] = hurt[there], hurt[here]
            yield self.case("lost and swapped sectors", f"sector {first // SECTOR_BYTES}", bytes(hurt))
