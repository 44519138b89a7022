"""The generalist in two rooms that it has never entered: a picture of its way and what it held, and a film.

    python docs/pictures/unseen.py docs/pictures/generalist.jpg docs/pictures/unseen-room.webp

The rooms are those of `clearway view --agent generalist --room SEED`: one for the picture, one for the film. Start,
target and actions are of seed 0, the target is the farthest of 20. The film is that of `clearway video`, smaller.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import av
from PIL import Image

from clearway import colours
from clearway.experiments.demo_generalist import FirstWalk, first_walk
from clearway.viz.held import held_picture
from clearway.viz.maps import Walk, draw_map
from clearway.zones import scene_zones

PICTURE_SIZE_PX, SPACE_PX = (1300, 900), 16
FILM_WIDTH_PX, STEP_MS, END_MS, QUALITY = 900, 333, 2400, 70


def main() -> None:
    """Draw, film, and say what happened."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("picture", type=Path)
    parser.add_argument("film", type=Path)
    parser.add_argument("--rooms", type=int, nargs=2, default=(0, 9), help="seeds: of the picture's, of the film's")
    given = parser.parse_args()
    drawn = first_walk(given.rooms[0], seed=0)
    print(f"picture: {len(drawn.walk.actions)} steps, {drawn.collisions} collisions")
    beside(drawn).save(given.picture, quality=86, optimize=True)
    frames = filmed(given.rooms[1])
    waits_ms = [STEP_MS] * (len(frames) - 1) + [END_MS]
    frames[0].save(
        given.film, save_all=True, append_images=frames[1:], duration=waits_ms, loop=0, quality=QUALITY, method=6
    )


def beside(drawn: FirstWalk) -> Image.Image:
    """The way on the map with zones; beside it what the agent held at its end."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "map.png"
        walks = [Walk("generalist", drawn.walk.states)]
        draw_map(drawn.scene, path, zones=scene_zones(drawn.scene), target=drawn.target, walks=walks)
        left = Image.open(path).convert("RGB")
    width, height = PICTURE_SIZE_PX
    left.thumbnail((width // 2, height))
    size = (width - left.width - SPACE_PX, height)
    right = held_picture(drawn.scene, drawn.held, drawn.walk.states, drawn.target, size)
    whole = Image.new("RGB", (left.width + SPACE_PX + right.width, max(left.height, right.height)), colours.PAPER)
    whole.paste(left, (0, 0))
    whole.paste(right, (left.width + SPACE_PX, 0))
    return whole


def filmed(seed: int) -> list[Image.Image]:
    """Frames of the film, a step each."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        words = ["video", "generalist", "--room", str(seed), "--out", str(path)]
        subprocess.run([sys.executable, "-m", "clearway", *words], check=True)
        with av.open(path) as film:
            frames = [frame.to_image() for frame in film.decode(video=0)]
    height = round(frames[0].height * FILM_WIDTH_PX / frames[0].width)
    return [frame.resize((FILM_WIDTH_PX, height), Image.Resampling.LANCZOS) for frame in frames]


if __name__ == "__main__":
    main()
