"""Compose a picture of a demo, map and views: `python compose.py demo demo.jpg`."""

from __future__ import annotations

import sys
from pathlib import Path

from PIL import Image

MARGIN_PX = 12
COLUMNS = 2
BACKGROUND = "white"


def compose(demo: Path) -> Image.Image:
    """The map on the left; beside it the views, in columns, filling its height."""
    left = Image.open(demo / "pictures" / "map.png").convert("RGB")
    views = [Image.open(path).convert("RGB") for path in sorted((demo / "pictures").glob("view-*.png"))]
    rows = -(-len(views) // COLUMNS)
    height = (left.height - (rows - 1) * MARGIN_PX) // rows
    width = height * views[0].width // views[0].height
    whole = Image.new("RGB", (left.width + COLUMNS * (width + MARGIN_PX), left.height), BACKGROUND)
    whole.paste(left, (0, 0))
    for number, view in enumerate(views):
        row, column = divmod(number, COLUMNS)
        corner = (left.width + MARGIN_PX + column * (width + MARGIN_PX), row * (height + MARGIN_PX))
        whole.paste(view.resize((width, height), Image.Resampling.LANCZOS), corner)
    return whole


if __name__ == "__main__":
    compose(Path(sys.argv[1])).save(sys.argv[2], quality=80)
