"""The example's episode as a moving picture: the same start, room and target for both agents, and one of them bumps."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from clearway.examples.shipped import SHIPPED, load_example
from clearway.view.episode import read_episode
from clearway.view.film import film_frames
from clearway.view.stage import run_stage
from clearway.view.viewing import Viewing
from clearway.viz.figures import counted
from clearway.viz.page import Picture

FILE = "pictures/contrast.webp"
SHOWN_PX = 1112  # across, as wide as a page
STEP_MS, END_MS = 500, 2_500
QUALITY = 70


def contrast(out: Path, folder: Path = SHIPPED) -> Picture:
    """Write the episode into a page's folder as a WebP that plays over and over; its caption has both agents' figures.

    Raises:
        ClearwayError: a file of the example is missing or was altered.
    """
    example = load_example(folder)
    stage = run_stage(list(example.runs.values()), [example.scene])
    session = Viewing(stage)
    session.begin(read_episode(example.episode))
    for walker in session.walkers:
        while walker.step() is not None:
            pass
    _write(out / FILE, [_shown(Image.fromarray(frame)) for frame in film_frames(stage, session)])
    figures = (
        f"{name} {agent['collisions'][0]:.3f} ({agent['collisions'][1]:.3f} to {agent['collisions'][2]:.3f})"
        for name, agent in example.card["agents"].items()
    )
    bumped = (
        f"{name} bumped {counted(walker.steps[-1].collisions, 'time')}"
        for name, walker in zip(example.runs, session.walkers, strict=True)
    )
    caption = (
        "Two agents that come along, trained with the published settings, under which the rewards differ most: here "
        f"{', '.join(bumped)}. Collisions an episode: {', '.join(figures)}; 95 % intervals over episodes, one training "
        "each. The agents below learn by our own recipe, under which, trained to the end, the rewards hardly differ."
    )
    return Picture(FILE, caption, "Both agents step by step, one above the other: view, target, way, probabilities")


def _shown(frame: Image.Image) -> Image.Image:
    return frame.resize((SHOWN_PX, round(frame.height * SHOWN_PX / frame.width)), Image.Resampling.LANCZOS)


def _write(path: Path, frames: list[Image.Image]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    first, *others = frames
    waits = [STEP_MS] * len(others) + [END_MS]
    first.save(path, save_all=True, append_images=others, duration=waits, loop=0, quality=QUALITY)
