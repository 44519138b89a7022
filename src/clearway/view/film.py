"""An episode of the viewer as a film: what every walker did, one above the other, in step."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from clearway import colours
from clearway.errors import ClearwayError
from clearway.evaluation.episodes import Trajectory
from clearway.view.episode import Episode
from clearway.view.stage import Stage
from clearway.view.viewing import Viewing
from clearway.view.walker import Walker
from clearway.viz.video import Walked, frames, write_video

MOST_FILM_STEPS = 300
NAME_PX, TEXT_PX, MARGIN_PX = 36, 18, 16


def write_film(stage: Stage, episode: Episode, path: Path, frames_per_s: int) -> None:
    """Walk an episode's recorded actions again and write an MP4.

    Raises:
        ClearwayError: the episode does not fit the stage, or is too long for a film.
    """
    if max(map(len, episode.walks), default=0) > MOST_FILM_STEPS:
        raise ClearwayError(f"a film shows at most {MOST_FILM_STEPS} steps. Save a shorter episode, or its link")
    session = Viewing(stage)
    session.begin(episode)
    for walker in session.walkers:
        while walker.recorded:
            if walker.step() is None:
                break
    write_video(path, film_frames(stage, session), frames_per_s)


def film_frames(stage: Stage, session: Viewing) -> Iterator[np.ndarray]:
    """What all walkers of a session did up to now, (height, width, 3) uint8 each."""
    shown = [_frames(stage, session, index) for index in range(len(session.walkers))]
    return stacked(shown, session.names(session.episode))


def _frames(stage: Stage, session: Viewing, index: int) -> Iterator[np.ndarray]:
    walker = session.walkers[index]
    agents = stage.agents
    scenes = agents[index].scenes if index < len(agents) else stage.scenes
    return frames(scenes, _walked(walker))


def _walked(walker: Walker) -> Walked:
    states = np.array([step.state for step in walker.steps]) + walker.offset
    trajectory = Trajectory(states, np.array(walker.actions, np.int64))
    held = [step.held for step in walker.steps if step.held is not None] or None
    if walker.agent is None:
        return Walked(walker.world, walker.target, trajectory, None)
    nothing = (0.0,) * walker.world.next_state.shape[1]
    probabilities = np.array([step.probabilities or nothing for step in walker.steps])
    told = any(step.probabilities for step in walker.steps)
    return Walked(walker.world, walker.target, trajectory, probabilities if told else None, held)


def stacked(shown: list[Iterator[np.ndarray]], names: list[str]) -> Iterator[np.ndarray]:
    """Frames of several walkers one above the other, each under its name; who has ended waits in the last one."""
    last: list[np.ndarray] = []
    for together in itertools.zip_longest(*shown):
        last = [frame if frame is not None else last[index] for index, frame in enumerate(together)]
        width = max(frame.shape[1] for frame in last)
        pairs = [(_title(name, width), _wide(frame, width)) for name, frame in zip(names, last, strict=True)]
        yield np.concatenate([part for pair in pairs for part in pair])


def _wide(frame: np.ndarray, width: int) -> np.ndarray:
    """The frame, with an empty margin on its right up to that width."""
    image = Image.new("RGB", (width, len(frame)), colours.PAPER)
    image.paste(Image.fromarray(frame), (0, 0))
    return np.asarray(image)


def _title(name: str, width: int) -> np.ndarray:
    image = Image.new("RGB", (width, NAME_PX), colours.PAPER)
    place = MARGIN_PX, NAME_PX // 2 + 4
    ImageDraw.Draw(image).text(place, name, colours.INK, ImageFont.load_default(TEXT_PX), anchor="lm")
    return np.asarray(image)
