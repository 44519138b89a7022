"""The example's episode as moving pictures: the same start, room and target for both agents, and one of them bumps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from clearway import colours
from clearway.envs.floor_map import FloorMap, Ink
from clearway.examples.shipped import SHIPPED, load_example
from clearway.scenes.scene import Scene
from clearway.view.episode import read_episode
from clearway.view.stage import run_stage
from clearway.view.viewing import Viewing
from clearway.view.walker import Walker
from clearway.viz.figures import BY_REWARD, counted
from clearway.viz.page import KeyFigure, Opening, Picture
from clearway.zones import scene_zones

FILE = "pictures/contrast-{}.webp"  # by the agent's name
PANEL_PX = 360, 270  # the view; the map beside it is at most as large
TITLE_PX, TEXT_PX, GAP_PX = 40, 22, 10
STEP_MS, END_MS = 500, 2_500
QUALITY = 70


def contrast(out: Path, folder: Path = SHIPPED) -> Opening:
    """Write the episode into a page's folder, a WebP an agent, in step; both agents' figures belong above.

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
    longest = max(len(walker.steps) for walker in session.walkers)
    pictures = []
    for name, walker in zip(example.runs, session.walkers, strict=True):
        shown = list(_frames(example.scene, name, walker))
        _write(out / FILE.format(name), shown + shown[-1:] * (longest - len(shown)))
        pictures.append(Picture(FILE.format(name), f"{name}: {_went(walker, -1)}", f"{name}: view and way by step"))
    text = (
        "Two agents that come along, trained with the published settings, under which the rewards differ most; 95 % "
        "intervals over episodes, one training each. The start was chosen because the difference shows: from most, "
        "neither bumps. The agents below learn by our own recipe, under which, trained to the end, the rewards hardly "
        "differ."
    )
    figures = [_figure(name, agent) for name, agent in example.card["agents"].items()]
    return Opening(figures, pictures, text)


def _figure(name: str, agent: Mapping[str, Any]) -> KeyFigure:
    value, low, high = agent["collisions"]
    note = f"95 %: {low:.3f} to {high:.3f}"
    return KeyFigure(f"{name}: collisions an episode", f"{value:.3f}", note, BY_REWARD[name].colour)


def _frames(scene: Scene, name: str, walker: Walker) -> Iterator[Image.Image]:
    """View and map at each pose, under the name and what happened so far."""
    assert scene.observations is not None
    room, look = FloorMap(scene, scene_zones(scene), PANEL_PX), BY_REWARD[name]
    states, font = np.array([step.state for step in walker.steps]), ImageFont.load_default(TEXT_PX)
    ink, size = Ink(look.colour, look.colour, look.halo), (PANEL_PX[0] + GAP_PX + room.size[0], TITLE_PX + PANEL_PX[1])
    goal = walker.world.scene_state(walker.target)
    bumps = [(at, states[at], walker.actions[at]) for at in range(len(states) - 1) if walker.steps[at + 1].blocked]
    for at, state in enumerate(states.tolist()):
        frame = Image.new("RGB", size, colours.PAPER)
        met = np.array([bump[1:] for bump in bumps if bump[0] < at], np.int64).reshape(-1, 2)
        frame.paste(room.draw(states[: at + 1], met, goal, ink), (PANEL_PX[0] + GAP_PX, TITLE_PX))
        view = Image.fromarray(scene.observations[state]).resize(PANEL_PX, Image.Resampling.LANCZOS)
        frame.paste(view, (0, TITLE_PX))
        pen = ImageDraw.Draw(frame)
        pen.text((0, TITLE_PX // 2), name, colours.INK, font, anchor="lm")
        pen.text((PANEL_PX[0] + GAP_PX, TITLE_PX // 2), _went(walker, at), colours.INK, font, anchor="lm")
        yield frame


def _went(walker: Walker, at: int) -> str:
    """What happened up to a step, -1: to the last."""
    step, steps = walker.steps[at], range(len(walker.steps))[at]
    return f"{counted(steps, 'step')}, {counted(step.collisions, 'collision')}"


def _write(path: Path, frames: list[Image.Image]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    waits = [STEP_MS] * (len(frames) - 1) + [END_MS]
    first, *others = frames
    first.save(path, save_all=True, append_images=others, duration=waits, loop=0, quality=QUALITY)
