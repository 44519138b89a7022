"""The Active Vision Dataset (Ammirato et al., ICRA 2017): real homes, photographed from 12 headings on a rough grid.

A folder a scene: pictures in `jpg_rgb`, and `annotations.json`, which links each picture to those that a move or a turn
leads to ("" where the way is blocked). The links are the scene's graph, as they are. Where the pictures were taken is
laid out from them: neighbours a step apart along the heading; maps are therefore sketches.
"""

from __future__ import annotations

import warnings
from collections import Counter, deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from clearway.errors import SceneError
from clearway.importers.json_files import read_json
from clearway.importers.photographs import HEIGHT_PX, photographs, picture_within
from clearway.scenes.actions import ACTION_COUNT, BLOCKED, Action
from clearway.scenes.scene import Provenance, Scene
from clearway.scenes.validate import MAX_STATES, MIN_HEADINGS, SceneWarning, check_scene
from clearway.version import __version__

SOURCE = "avd"
ANNOTATIONS, PICTURES = "annotations.json", "jpg_rgb"
STEP_M = 0.3
LINKS = {
    Action.MOVE_FORWARD: "forward",
    Action.TURN_RIGHT: "rotate_cw",
    Action.TURN_LEFT: "rotate_ccw",
    Action.MOVE_BACKWARD: "backward",
}
GET_WHOLE = "Give a folder of the data set, for example Home_001_1"


def read_avd(folder: Path, *, step_m: float = STEP_M, name: str | None = None, height_px: int = HEIGHT_PX) -> Scene:
    """A folder of the data set as a scene without features.

    Args:
        folder: of one scene.
        step_m: length of a move, for maps.
        name: of the scene; the folder's where it is not given.
        height_px: of the scene's pictures.

    Raises:
        SceneError: a file is missing or damaged, or no location can be turned round at.

    Warns:
        SceneWarning: locations are left out because turns do not lead round.
    """
    links = _links(folder / ANNOTATIONS)
    circles = _circles(links, folder / ANNOTATIONS)
    names = [name for circle in circles for name in circle]
    heading_count, number = len(circles[0]), {name: index for index, name in enumerate(names)}
    graph = np.full((len(names), ACTION_COUNT), BLOCKED, np.int32)
    for index, picture in enumerate(names):
        for action, end in links[picture].items():
            graph[index, action] = number.get(end, BLOCKED)
    cells, shifts = _laid_out(graph, heading_count)
    headings = (np.tile(np.arange(heading_count), len(circles)) + np.repeat(shifts, heading_count)) % heading_count
    paths = [_picture_path(folder, picture) for picture in names]
    scene = Scene(
        name=name or folder.resolve().name,
        observations=photographs(paths, height_px),
        features=None,
        locations_m=np.repeat(cells, heading_count, axis=0) * step_m,
        headings_deg=np.round(headings * 360 / heading_count).astype(np.int64),
        graph=graph,
        made_by=Provenance(SOURCE, versions={"clearway": __version__}, notes={"locations": "laid out from the links"}),
        cell_size_m=step_m,
    )
    check_scene(scene, folder)
    return scene


def _links(path: Path) -> dict[str, dict[Action, str]]:
    """Where each action leads from each picture, by their names; "" where it is blocked."""
    content = read_json(path)
    try:
        return {
            str(name): {action: _end(entry, word) for action, word in LINKS.items()} for name, entry in content.items()
        }
    except (AttributeError, KeyError, TypeError) as fault:
        words = ", ".join(LINKS.values())
        raise SceneError(path, f"lacks the links {words} of a picture ({fault!r})", GET_WHOLE) from fault


def _end(entry: Mapping[str, Any], word: str) -> str:
    end = entry[word]
    if not isinstance(end, str):
        raise TypeError(f"{word} is {end!r}")
    return end


def _circles(links: Mapping[str, Mapping[Action, str]], path: Path) -> list[list[str]]:
    """Pictures of each location, each to the right of the one before; locations with another number are left out."""
    circles, left_out, seen = [], 0, set()
    for first in links:
        if first in seen:
            continue
        circle, picture = [], first
        while picture in links and picture not in seen:
            seen.add(picture)
            circle.append(picture)
            picture = links[picture][Action.TURN_RIGHT]
        turned_to = circle.index(picture) if picture in circle else len(circle)
        left_out += turned_to  # a picture whose right turn leads into a circle is not part of it
        circle = circle[turned_to:]
        back = all(
            links[right].get(Action.TURN_LEFT) == left
            for left, right in zip(circle, circle[1:] + circle[:1], strict=True)
        )
        if back and len(circle) >= MIN_HEADINGS:
            circles.append(circle)
        else:
            left_out += len(circle)
    lengths = Counter(map(len, circles))
    if not lengths:
        raise SceneError(path, "no picture can be turned round from, back to itself", GET_WHOLE)
    usual = max(lengths, key=lambda length: (length * lengths[length], length))
    left_out += sum(len(circle) for circle in circles if len(circle) != usual)
    circles = [circle for circle in circles if len(circle) == usual]
    if len(circles) * usual > MAX_STATES:
        raise SceneError(path, f"has {len(circles) * usual} poses, expected up to {MAX_STATES}", GET_WHOLE)
    if left_out:
        message = f"{path}: {left_out} of {len(links)} pictures are left out: turns there do not lead round in {usual}"
        warnings.warn(message, SceneWarning, stacklevel=3)
    return circles


def _laid_out(graph: np.ndarray, heading_count: int) -> tuple[np.ndarray, np.ndarray]:
    """A place for each location, (L, 2) in steps, and the heading of its first picture, (L,), from the links."""
    count = len(graph) // heading_count
    cells, shifts, placed = np.zeros((count, 2)), np.zeros(count, np.int64), np.zeros(count, bool)
    for first in range(count):
        if placed[first]:
            continue
        before = placed.copy()
        placed[first] = True
        queue = deque([first])
        while queue:
            here = queue.popleft()
            for picture in range(here * heading_count, (here + 1) * heading_count):
                heading = (picture % heading_count + shifts[here]) % heading_count
                turn = 2 * np.pi * heading / heading_count
                for action, sign in ((Action.MOVE_FORWARD, 1), (Action.MOVE_BACKWARD, -1)):
                    end = graph[picture, action]
                    there = end // heading_count
                    if end != BLOCKED and not placed[there]:
                        placed[there] = True
                        shifts[there] = (heading - end % heading_count) % heading_count
                        cells[there] = cells[here] + sign * np.array([np.sin(turn), np.cos(turn)])
                        queue.append(there)
        if before.any():  # a part that nothing leads to stands to the right of the others
            cells[placed & ~before, 0] += cells[before, 0].max() + 3 - cells[placed & ~before, 0].min()
    return cells, shifts


def _picture_path(folder: Path, name: str) -> Path:
    path = picture_within(folder / PICTURES, name)
    if path is None:
        raise SceneError(folder / ANNOTATIONS, f"names {name[:80]!r}, which is no file in {PICTURES}", GET_WHOLE)
    return path
