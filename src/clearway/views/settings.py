"""`ViewSettings`: which pictures are taken of each room; with the room they say all of its shard."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from clearway.errors import ArgumentError, SceneError
from clearway.learn.seeds import SEED_LIMIT
from clearway.live.conditions import Perturbations
from clearway.live.words import GEOMETRY
from clearway.scenes.sensors import RGB, SENSORS, Sensor, check_names

SIDES_PX = (16, 1024)  # least and most of a picture's height and width
MOST_POSES, MOST_TAKES = 100_000, 100
MOST_BYTES = 4 * 1024**3  # of a room's pictures, which are in memory together when they are taken


@dataclass(frozen=True)
class ViewSettings:
    """Which pictures are taken of each room.

    Attributes:
        poses: number of places with a heading, drawn at random.
        takes: pictures of each, every one under a perturbation of its own.
        seed: of all chances. A pose depends on it, the room and its own number alone.
        perturbations: how strong they are.
        sensors: what takes the pictures, names of `scenes.sensors.SENSORS`.
        size_px: height and width of the pictures.
        held_out: poses next to held-out cells alone (`scenes.held_out`); else none of them.
        scene_headings: the headings of the scene alone; else any, uniform over 360 degrees.
        compress: keep them in less space, slower to read.
    """

    poses: int = 400
    takes: int = 2
    seed: int = 0
    perturbations: Perturbations = GEOMETRY
    sensors: tuple[str, ...] = (RGB,)
    size_px: tuple[int, int] = (96, 128)
    held_out: bool = False
    scene_headings: bool = False
    compress: bool = False

    def check(self) -> None:
        """Raises ArgumentError or SceneError where there are no such pictures."""
        for name, number, low, high in (
            ("poses", self.poses, 1, MOST_POSES),
            ("takes", self.takes, 1, MOST_TAKES),
            ("seed", self.seed, 0, SEED_LIMIT - 1),
            *(("size", side, *SIDES_PX) for side in self.size_px),
        ):
            if not low <= number <= high:
                raise ArgumentError(f"{name}={number}: expected {low} to {high}. Give a number in that range")
        check_names(self.sensors)
        size = self.picture_count * sum(sensor.kept_bytes for sensor in self.all_sensors)
        if size > MOST_BYTES:
            problem = f"poses={self.poses}: the pictures of a room would take {size / 1024**3:.1f} GiB in memory"
            raise ArgumentError(f"{problem}, expected at most {MOST_BYTES >> 30}. Take fewer or smaller ones")
        if self.takes > 1 and self.perturbations == Perturbations():
            problem = f"takes={self.takes}: without perturbations all takes of a pose are the same picture"
            raise ArgumentError(f"{problem}. Perturb something, or take each pose once")

    @property
    def picture_count(self) -> int:
        """Of a room."""
        return self.poses * self.takes

    @property
    def all_sensors(self) -> tuple[Sensor, ...]:
        """What takes the pictures, colour first."""
        names = (RGB, *(name for name in self.sensors if name != RGB))
        return tuple(SENSORS[name](*self.size_px) for name in names)

    def to_json(self) -> dict[str, object]:
        """As JSON values."""
        return {**asdict(self), "sensors": list(self.sensors), "size_px": list(self.size_px)}


def settings_of(record: Mapping[str, Any]) -> ViewSettings:
    """The settings that `ViewSettings.to_json` made a record of.

    Raises:
        ArgumentError: it is no such record, or there are no such pictures.
    """
    try:
        sensors, size_px = tuple(record["sensors"]), tuple(record["size_px"])
        changed = {"sensors": sensors, "size_px": size_px, "perturbations": Perturbations(**record["perturbations"])}
        settings = ViewSettings(**{**record, **changed})
        whole = (settings.poses, settings.takes, settings.seed, *size_px)
        if len(size_px) != 2 or settings.to_json() != record or not all(type(number) is int for number in whole):
            raise ValueError("a value is of another kind")
        settings.check()
    except (LookupError, TypeError, ValueError, SceneError) as fault:
        raise ArgumentError(f"these are no settings of views ({fault}). Give what ViewSettings.to_json gave") from fault
    return settings


def differing(kept: ViewSettings, asked: ViewSettings) -> str:
    """What is not as asked for, in words; empty where all is."""
    found, wanted = ({**one.to_json(), **one.perturbations.to_json()} for one in (kept, asked))
    changed = [key for key in wanted if found[key] != wanted[key] and key != "perturbations"]
    return ", ".join(f"{key.replace('_', ' ')} {found[key]} instead of {wanted[key]}" for key in changed)
