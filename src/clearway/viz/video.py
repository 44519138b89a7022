"""A film of one episode: the agent's view, the target, the map with zones and the path so far, action probabilities."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from clearway import colours
from clearway.agents.agent import Agent, State
from clearway.envs.record import EpisodeSoFar
from clearway.envs.render import CAPTION_HEIGHT_PX, PANEL_HEIGHT_PX, Renderer
from clearway.errors import ClearwayError
from clearway.evaluation.episodes import Trajectory
from clearway.evaluation.single import memories
from clearway.files import written_whole
from clearway.mapping.held import Held
from clearway.scenes.actions import Action
from clearway.scenes.scene import Scene
from clearway.viz.held import MEANING, held_picture
from clearway.world.world import World

STRIP_PX, MARGIN_PX, BAR_PX, TEXT_PX = 44, 16, 14, 16
FRAMES_PER_S = 3
LAST_FRAME_TIMES = 6  # the last frame stays for so many
SUFFIXES = (".mp4", ".gif")
MOST_OF_A_GIF = 50  # frames/s; viewers show faster ones slowly
MOST_FRAMES_PER_S = 240


@dataclass(frozen=True)
class Walked:
    """An episode to be shown.

    Attributes:
        world: where it was walked.
        target: index of the world's target.
        trajectory: states and actions.
        probabilities: (T + 1, A) of the actions, before each step and after the last; None where no agent told them.
        held: what an agent with a map held in each of the T + 1 poses; None of others.
    """

    world: World
    target: int
    trajectory: Trajectory
    probabilities: np.ndarray | None
    held: Sequence[Held] | None = None


def walked(
    world: World,
    agent: Agent,
    target: int,
    trajectory: Trajectory,
    holds: Callable[[State], Held] | None = None,
    scenes: Sequence[Scene] = (),
) -> Walked:
    """The episode with what the agent holds of its actions at each pose.

    Args:
        world: where it was walked.
        agent: who walked.
        target: index of the world's target.
        trajectory: states and actions.
        holds: tells, by its state, what an agent with a map holds besides.
        scenes: the world's, in its order, for an agent that sees pictures.
    """
    thoughts, held = [], []
    for decisions, state in memories(world, agent, trajectory, target, scenes):
        thoughts.append(decisions.probabilities)
        held += [] if holds is None else [holds(state)]
    told = [thought for thought in thoughts if thought is not None]
    probabilities = np.concatenate(told) if len(told) == len(thoughts) else None
    return Walked(world, target, trajectory, probabilities, held or None)


def frames(scenes: Sequence[Scene], shown: Walked) -> Iterator[np.ndarray]:
    """The frames, (height, width, 3) uint8 with even sides, one a pose; scenes: of the world, in its order."""
    renderer = Renderer(scenes, shown.world)
    states, actions = shown.trajectory.states, shown.trajectory.actions
    blocked = shown.world.blocked.numpy()[states[:-1], actions]
    scene, first = _where(scenes, shown)
    for step in range(len(states)):
        bumps = np.stack([states[:step], actions[:step]], axis=1)[blocked[:step]]
        picture = Image.fromarray(renderer.rgb(EpisodeSoFar(states[: step + 1], bumps), shown.target))
        chosen = int(actions[step]) if step < len(actions) else None
        thought = None if shown.probabilities is None else shown.probabilities[step]
        if shown.held is not None:
            goal = int(shown.world.target_state[shown.target]) - first
            picture = _with_held(picture, scene, shown.held[step], states[: step + 1] - first, goal)
        yield np.asarray(_with_strip(picture, thought, chosen))


def _where(scenes: Sequence[Scene], shown: Walked) -> tuple[Scene, int]:
    """The scene that was walked in, and its first state in the world's numbering."""
    index = int(shown.world.target_scene[shown.target])
    return scenes[index], int(shown.world.scene_offset[index])


def _with_held(picture: Image.Image, scene: Scene, held: Held, states: np.ndarray, target: int) -> Image.Image:
    """The picture with what is held beside it."""
    font = ImageFont.load_default(TEXT_PX)
    column_px = int(font.getlength(MEANING)) + 1
    panel = held_picture(scene, held, states, target, (column_px, PANEL_HEIGHT_PX))
    wide = Image.new("RGB", (picture.width + column_px + 2 * MARGIN_PX, picture.height), colours.PAPER)
    wide.paste(picture, (0, 0))
    left = picture.width + MARGIN_PX
    wide.paste(panel, (left, CAPTION_HEIGHT_PX + (PANEL_HEIGHT_PX - panel.height) // 2))
    ImageDraw.Draw(wide).text((left, CAPTION_HEIGHT_PX // 2), MEANING, colours.INK, font, anchor="lm")
    return wide


def _with_strip(picture: Image.Image, probabilities: np.ndarray | None, chosen: int | None) -> Image.Image:
    """The picture with a bar for each action, or its name alone, below; the action taken is in full strength."""
    width, height = picture.width // 2 * 2, (picture.height + STRIP_PX) // 2 * 2
    frame = Image.new("RGB", (width, height), colours.PAPER)
    frame.paste(picture, (0, 0))
    pen, font = ImageDraw.Draw(frame), ImageFont.load_default(TEXT_PX)
    space = (width - 2 * MARGIN_PX) // len(Action)
    top = height - STRIP_PX
    for action in Action:
        left = MARGIN_PX + action * space
        name = action.name.lower().replace("_", " ")
        ink = colours.INK if action == chosen else colours.FAINT_INK
        if probabilities is None:
            pen.text((left, top + 8), name, ink, font, anchor="lm")
            continue
        share = float(probabilities[action])
        pen.text((left, top + 8), f"{name}  {100 * share:.0f} %", ink, font, anchor="lm")
        length = (space - MARGIN_PX) * share
        pen.rectangle((left, top + 20, left + space - MARGIN_PX, top + 20 + BAR_PX), outline=colours.FAINT_INK)
        if length >= 1:
            pen.rectangle((left, top + 20, left + length, top + 20 + BAR_PX), fill=ink)
    return frame


def write_video(path: Path, pictures: Iterator[np.ndarray], frames_per_s: int = FRAMES_PER_S) -> None:
    """Write an MP4 (H.264) or a GIF, by the path's ending. A GIF counts in hundredths of a second.

    Raises:
        ClearwayError: the ending is another one, or no film is as fast.
    """
    if path.suffix not in SUFFIXES:
        raise ClearwayError(f"{path}: expected a name that ends in {' or '.join(SUFFIXES)}. Give another --out")
    if path.suffix == ".gif" and frames_per_s > MOST_OF_A_GIF:
        raise ClearwayError(
            f"{path}: {frames_per_s} frames/s in a GIF, which viewers show {MOST_OF_A_GIF} of. Give fewer, or an MP4"
        )
    if frames_per_s > MOST_FRAMES_PER_S:
        raise ClearwayError(f"{path}: {frames_per_s} frames/s, expected at most {MOST_FRAMES_PER_S}. Give fewer")
    with written_whole(path) as part:
        if path.suffix == ".gif":
            first, *others = [Image.fromarray(frame) for frame in _with_long_end(pictures)]
            first.save(
                part, "GIF", save_all=True, append_images=others, duration=10 * round(100 / frames_per_s), loop=0
            )
        else:
            _write_mp4(part, _with_long_end(pictures), frames_per_s)


def _with_long_end(pictures: Iterator[np.ndarray]) -> Iterator[np.ndarray]:
    """The frames, the last of them several times more."""
    frame = None
    for frame in pictures:
        yield frame
    assert frame is not None, "a film needs a frame"
    yield from [frame] * LAST_FRAME_TIMES


def _write_mp4(path: Path, pictures: Iterator[np.ndarray], frames_per_s: int) -> None:
    """Frame by frame, so that a long film needs no more memory than a short one."""
    import av

    with av.open(str(path), "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=Fraction(frames_per_s))
        stream.pix_fmt = "yuv420p"
        for number, picture in enumerate(pictures):
            if number == 0:  # the encoder opens with the first frame
                stream.height, stream.width = picture.shape[:2]
            for packet in stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")):
                container.mux(packet)
        for packet in stream.encode():
            container.mux(packet)
