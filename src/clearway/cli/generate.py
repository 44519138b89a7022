"""`clearway scenes generate`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from clearway.choices import PlanKind, SensorName, SplitName
from clearway.cli.console import say_made

if TYPE_CHECKING:
    from clearway.scenes.scene import Scene


@dataclass(frozen=True)
class Generate:
    """Make rooms or flats as scene files, as many as you like, the same for everyone who asks for them.

    What is in the folder already is checked and not made again, so that an interrupted command goes on.

    Example: clearway scenes generate --kind flat --count 10 --split train --out flats
    """

    out: Path
    """Folder for the scene files."""
    kind: PlanKind = "room"
    """room: kitchens, living rooms, bedrooms and bathrooms in turn; flat: two to six rooms and a corridor."""
    count: int = 1
    """Number of files: the first so many of this kind, split and seed."""
    split: SplitName = "train"
    """Splits never share a plan. The first 100 rooms and 50 flats of test with seed 0 never change."""
    seed: int = 0
    """Another one gives other rooms."""
    sensors: tuple[SensorName, ...] = ("rgb",)
    """What takes the pictures: rgb, or rgb depth (metres, kept in the file beside the colour pictures)."""
    size: tuple[int, int] = (96, 128)
    """Height and width of the pictures, pixels."""
    encoder: str = "auto"
    """As of scenes build, or none: scenes without features, faster, and not to be trained on before they are encoded.
    random-resnet50 is calibrated on the first four training rooms, whatever is generated."""
    encoder_seed: int = 0
    """Seed of random-resnet50."""
    workers: int | None = None
    """Processes, each of which makes whole rooms; by default one a core."""
    ray: str | None = None
    """Make them on a Ray cluster: local, auto or an address. Its nodes must see the folder under the same path."""

    def run(self) -> None:
        """Check, make and write."""
        from clearway.api.generation import generate

        there = set(self.out.glob("*.h5")) if self.out.is_dir() else set()
        paths = generate(
            self.kind,
            self.count,
            split=self.split,
            seed=self.seed,
            out=self.out,
            sensors=self.sensors,
            size=self.size,
            encoder=self.encoder,
            encoder_seed=self.encoder_seed,
            workers=self.workers,
            ray=self.ray,
            show_progress=True,
        )
        say_made(self.out, paths, there)


def chosen_room(seed: int) -> Scene:
    """The room of a seed that a user chose; built the first time, with a progress bar."""
    from clearway.api.arguments import as_whole
    from clearway.generation.cached import room_of_seed
    from clearway.generation.request import MAX_SEED
    from clearway.progress import work_progress

    as_whole("room", seed, 0, MAX_SEED)
    with work_progress("making the room", 1, True, unit="rooms") as done:
        return room_of_seed(seed, done)
