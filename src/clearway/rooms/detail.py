"""How finely a room is modelled and lit: `FULL` for pictures of any size, `SMALL` for small ones, at less cost."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from clearway.errors import SceneError

DETAIL_NOTE = "detail"  # of a scene's record
MOST_SMALL_PX = 160 * 200  # pixels of a picture; above it, fast pictures cost no less


@dataclass(frozen=True)
class Detail:
    """What may be left out where pictures are too small to show it.

    Attributes:
        least_bevel_m: edges rounded by less than this are sharp; those of more have one strip, unless it is 0.
        most_slices: flat sides of round shapes, at most.
        texel_m: size of a light map's texels.
        ambient_rays: rays that ask each texel's surroundings for light.
        texture_step: pictures of surfaces, materials and artwork are made of every so many-th pixel, across and down.
        block_m: furniture that is alike is drawn together within squares of this size, so that those out of sight can
            be left out of a picture; None: within the whole room.
    """

    least_bevel_m: float = 0.0
    most_slices: int = 1000
    texel_m: float = 0.11
    ambient_rays: int = 24
    texture_step: int = 1
    block_m: float | None = None

    def segments(self, bevel_m: float, segments: int) -> int:
        """Roundness of a box's edges, as of `meshes.bevelled_box`, where `segments` is asked for."""
        if bevel_m < self.least_bevel_m:
            return 0
        return min(segments, 1) if self.least_bevel_m else segments


FULL = Detail()
SMALL = Detail(
    least_bevel_m=0.01,
    most_slices=16,
    texel_m=0.16,
    ambient_rays=12,
    texture_step=2,
    block_m=2.0,
)
"""For pictures of about 96 x 128: a bevel of a centimetre is a pixel at one metre. Panels of doors keep the edges that
they are seen by; finer ones lose their gleam."""

DETAILS = {"full": FULL, "small": SMALL}


def are_small(height_px: int, width_px: int) -> bool:
    """Whether pictures of a size are taken the fast way (`camera.View`), of rooms in small detail: alike to the eye."""
    return height_px * width_px <= MOST_SMALL_PX and height_px % 2 == 0 and width_px % 2 == 0


def detail_for(height_px: int, width_px: int) -> str:
    """The name of the detail that pictures of this size are taken in."""
    return "small" if are_small(height_px, width_px) else "full"


def recorded_detail(scene_name: str, notes: Mapping[str, object]) -> Detail:
    """The detail that a scene's room was built in, by the notes of its record; without one in full.

    Raises:
        SceneError: there is no such detail in this version.
    """
    name = notes.get(DETAIL_NOTE, "full")
    if not isinstance(name, str) or name not in DETAILS:
        problem = f"its room has the detail {name!r:.40}, this version knows {', '.join(DETAILS)}"
        raise SceneError(scene_name, problem, "Make the scene again")
    return DETAILS[name]


def taken_fast(notes: Mapping[str, object]) -> bool:
    """Whether a scene's pictures were taken the fast way, by the notes of its record."""
    return notes.get(DETAIL_NOTE) == "small"
