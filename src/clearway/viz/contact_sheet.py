"""What an agent saw on its way: the views of one episode in order, the target's picture first."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from clearway import colours
from clearway.errors import SceneError
from clearway.files import written_whole
from clearway.scenes.actions import ACTION_NAMES
from clearway.scenes.scene import Scene
from clearway.viz.figures import counted
from clearway.zones import ZONE_NAMES

COLUMNS = 6
MOST_VIEWS = 41  # with the target seven rows
VIEW_WIDTH_PX, FRAME_PX, GAP_PX, CAPTION_PX, MARGIN_PX, HEADER_PX = 240, 7, 16, 30, 20, 72
FREE_FRAME = "#c9ced4"


def draw_contact_sheet(
    scene: Scene,
    path: Path,
    *,
    states: np.ndarray,
    actions: np.ndarray,
    zones: np.ndarray,
    target: int,
    title: str = "",
) -> None:
    """Draw the views of an episode and save them as PNG. Long episodes are thinned out evenly, and the sheet says so.

    Args:
        scene: with pictures.
        path: of the sheet.
        states: (T + 1,) int, in the scene's own numbering.
        actions: (T,) int, between them.
        zones: (S,) int, zone of each pose; frames a view.
        target: the target's state.
        title: stands above.

    Raises:
        SceneError: the scene has no pictures.
    """
    if scene.observations is None:
        raise SceneError(scene.name, "the scene has no pictures", "Choose a file with pictures", "observation")
    assert len(states) == len(actions) + 1
    shown = _shown_steps(len(states))
    views = [scene.observations[int(states[step])] for step in shown]
    tiles = [_tile(scene.observations[target], "target", colours.TARGET)]
    for step, view in zip(shown, views, strict=True):
        zone = ZONE_NAMES[zones[states[step]]]
        frame = FREE_FRAME if zone == "free" else colours.ZONE_COLOURS[zone]
        tiles.append(_tile(view, _caption(step, states, actions), frame, bump=_is_bump(step, states)))
    sheet = _laid_out(tiles)
    note = "all views" if len(shown) == len(states) else f"{len(shown)} of {len(states)} views"
    bumps = int((states[1:] == states[:-1]).sum())
    summary = f"{counted(len(actions), 'step')}, {counted(bumps, 'collision')} · {note}"
    _draw_header(sheet, title, summary)
    with written_whole(path) as part:
        sheet.save(part, format="PNG", optimize=True)


def _shown_steps(count: int) -> list[int]:
    """The steps to show, the first and the last among them."""
    return sorted({round(step) for step in np.linspace(0, count - 1, min(count, MOST_VIEWS)).tolist()})


def _is_bump(step: int, states: np.ndarray) -> bool:
    return step > 0 and bool(states[step] == states[step - 1])


def _caption(step: int, states: np.ndarray, actions: np.ndarray) -> str:
    """The step's number and the action that led to the view."""
    if step == 0:
        return "0 · start"
    blocked = " · blocked" if _is_bump(step, states) else ""
    return f"{step} · {ACTION_NAMES[int(actions[step - 1])]}{blocked}"


def _tile(view: np.ndarray, caption: str, frame: str, bump: bool = False) -> Image.Image:
    """A view in its frame with its caption below; blocked moves carry a cross."""
    picture = Image.fromarray(np.asarray(view))
    height = round(picture.height * VIEW_WIDTH_PX / picture.width)
    resample = Image.Resampling.LANCZOS if picture.width >= VIEW_WIDTH_PX / 2 else Image.Resampling.NEAREST
    picture = picture.resize((VIEW_WIDTH_PX, height), resample)
    tile = Image.new("RGB", (VIEW_WIDTH_PX + 2 * FRAME_PX, height + 2 * FRAME_PX + CAPTION_PX), colours.PAPER)
    pen = ImageDraw.Draw(tile)
    pen.rounded_rectangle((0, 0, tile.width - 1, height + 2 * FRAME_PX - 1), radius=5, fill=frame)
    tile.paste(picture, (FRAME_PX, FRAME_PX))
    ink = colours.ZONE_COLOURS["collision"] if bump else colours.INK
    pen.text((2, height + 2 * FRAME_PX + 4), caption, fill=ink, font=_font(18))
    return tile


def _laid_out(tiles: list[Image.Image]) -> Image.Image:
    columns = min(COLUMNS, len(tiles))
    rows = math.ceil(len(tiles) / columns)
    width, height = tiles[0].width + GAP_PX, tiles[0].height + GAP_PX // 2
    size = 2 * MARGIN_PX + columns * width - GAP_PX, HEADER_PX + rows * height + MARGIN_PX
    sheet = Image.new("RGB", size, colours.PAPER)
    for index, tile in enumerate(tiles):
        row, column = divmod(index, columns)
        sheet.paste(tile, (MARGIN_PX + column * width, HEADER_PX + row * height))
    return sheet


def _draw_header(sheet: Image.Image, title: str, summary: str) -> None:
    """Title, summary and the legend of the frames."""
    pen = ImageDraw.Draw(sheet)
    pen.text((MARGIN_PX, 10), title, fill=colours.INK, font=_font(24))
    pen.text((MARGIN_PX, 42), summary, fill=colours.FAINT_INK, font=_font(18))
    right = sheet.width - MARGIN_PX
    for zone in ("collision", "precollision"):
        label = f"{zone} zone"
        right -= round(pen.textlength(label, font=_font(18)))
        pen.text((right, 42), label, fill=colours.INK, font=_font(18))
        right -= 24
        pen.rounded_rectangle((right, 44, right + 17, 61), radius=3, fill=colours.ZONE_COLOURS[zone])
        right -= 18


def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)
