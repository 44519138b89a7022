"""What can be changed between training and the live room, and how strongly; plain data without imports."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any


@dataclass(frozen=True)
class Perturbations:
    """How the live room differs from the grid; all zero: not at all."""

    distance_noise: float = 0.0
    """Standard deviation of the length of a move, metres."""
    angle_noise: float = 0.0
    """Standard deviation of the angle of a turn, degrees."""
    camera_height_jitter: float = 0.0
    """Standard deviation of the camera's height, drawn for every picture, metres."""
    camera_pitch_jitter: float = 0.0
    """Standard deviation of the camera's pitch, drawn for every picture, degrees."""
    light: float = 0.0
    """An episode's pictures are brighter or darker by up to this share, for example 0.3."""
    pixel_noise: float = 0.0
    """Standard deviation of the noise of every pixel and colour, grey levels of 255."""
    move_furniture: float = 0.0
    """Every piece of furniture is moved by up to so many metres in an episode, where a way remains."""
    new_obstacle: bool = False
    """A bin stands on the shortest path in every episode in which there is another way."""

    def scaled(self, strength: float) -> Perturbations:
        """All magnitudes times `strength`; a new obstacle is there or not."""
        values = self.to_json()
        return Perturbations(**{k: v if isinstance(v, bool) else strength * v for k, v in values.items()})

    def alone(self, name: str) -> Perturbations:
        """This one perturbation without the others."""
        return Perturbations(**{name: getattr(self, name)})

    def to_json(self) -> dict[str, Any]:
        """As JSON values: numbers, and whether there is a new obstacle."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @property
    def too_strong(self) -> str | None:
        """The first magnitude above its `MOST`, or None."""
        return next((name for name, most in MOST.items() if getattr(self, name) > most), None)


REFERENCE = Perturbations(
    distance_noise=0.05,
    angle_noise=5.0,
    camera_height_jitter=0.05,
    camera_pitch_jitter=3.0,
    light=0.3,
    pixel_noise=10.0,
    move_furniture=0.3,
    new_obstacle=True,
)
"""Full strength in a sweep."""

MOST = {
    "distance_noise": 1.0,
    "angle_noise": 180.0,
    "camera_height_jitter": 1.0,
    "camera_pitch_jitter": 90.0,
    "light": 1.0,
    "pixel_noise": 255.0,
    "move_furniture": 10.0,
}
"""Of every magnitude: at light 1 an episode may be black, and no room is longer than 10 m."""


REARRANGING = ("move_furniture", "new_obstacle")
"""Of these, what changes where things stand: there is nothing to move in MuJoCo models of others."""


def as_it_was_built(perturbations: Perturbations) -> Perturbations:
    """The same, but everything stands where it stood."""
    return replace(perturbations, **{name: type(getattr(perturbations, name))() for name in REARRANGING})


@dataclass(frozen=True)
class Condition:
    """A row of a sweep: its label and what is changed."""

    label: str
    perturbations: Perturbations


LABELS = {
    "distance_noise": "move ± {:g} m",
    "angle_noise": "turn ± {:g}°",
    "camera_height_jitter": "camera height ± {:g} m",
    "camera_pitch_jitter": "camera pitch ± {:g}°",
    "light": "light ± {:.0%}",
    "pixel_noise": "pixel noise {:g}",
    "move_furniture": "furniture moved ≤ {:g} m",
    "new_obstacle": "new obstacle",
}


def label_of(perturbations: Perturbations) -> str:
    """What is changed, in words."""
    changed = {name: value for name, value in perturbations.to_json().items() if value}
    return ", ".join(LABELS[name].format(value) for name, value in changed.items()) or "none"


def sweep_settings(strengths: tuple[float, ...], reference: Perturbations = REFERENCE) -> list[Condition]:
    """Nothing changed; every perturbation alone, then all together, at every strength (a share of `reference`)."""
    settings = [Condition("none", Perturbations())]
    for name, value in reference.to_json().items():
        if not value:
            continue
        for scaled in (reference.scaled(strength) for strength in strengths):
            single = scaled.alone(name)
            settings.append(Condition(label_of(single), single))
            if isinstance(value, bool):
                break
    settings += [Condition(f"all, strength {strength:g}", reference.scaled(strength)) for strength in strengths]
    return settings
