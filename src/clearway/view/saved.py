"""The viewer's page as a folder of plain files with recorded episodes: any web server gives it, and a browser opens it.

index.html, page/     the page; its modules in one script, since browsers take none from a file
data.js               stage, maps, episodes and what the agents think of every pose, see `page/saved.js`
scenes/N/             the picture from above, and those of all poses that an episode passes
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from clearway.errors import ClearwayError
from clearway.files import check_free, folder_written_whole
from clearway.view.bundle import bundled
from clearway.view.content import jpeg, map_json, page_files, stage_json
from clearway.view.episode import Episode, read_episode
from clearway.view.stage import Stage
from clearway.view.viewing import Viewing

EPISODES = 3  # to each target
MOST_EPISODES = 500
MOST_STEPS = 300  # of a recorded episode
QUALITY = 80  # of pictures
MODULES = '<script type="module" src="page/app.js"></script>'
SCRIPTS = '<script defer src="data.js"></script>\n<script defer src="page/page.js"></script>'


@dataclass(frozen=True)
class SavedSize:
    """How much was saved.

    Attributes:
        episodes: recorded.
        files: in the folder.
        megabytes: of all files together.
    """

    episodes: int
    files: int
    megabytes: float


def save_page(stage: Stage, folder: Path, *, first: str = "", episodes: int = EPISODES) -> SavedSize:
    """Record episodes of a stage and write the page that plays them, whole or not at all.

    Args:
        stage: with agents.
        folder: a new one, or an empty one.
        first: the episode that the page opens with, as a query string or link; empty for a drawn one.
        episodes: from as many starts, drawn by the seeds 0, 1, ..., to each target offered.

    Raises:
        ClearwayError: the folder holds something, nobody walks, there would be too many episodes, or the first one does
            not fit the stage.
    """
    check_free(folder)
    if not stage.agents:
        raise ClearwayError("a saved page shows how agents walk, and there is none. Name a run folder")
    wanted = list(_wanted(stage, first, episodes))
    if len(wanted) > MOST_EPISODES:
        told = f"{len(wanted)} episodes would be saved, at most {MOST_EPISODES} are"
        raise ClearwayError(f"{told}. Give fewer --episodes, or a run of fewer scenes and targets")
    recorded = _distinct([_recorded(stage, episode) for episode in wanted])
    with folder_written_whole(folder) as part:
        _write_page(part / "page", part / "index.html")
        _write_pictures(stage, recorded, part)
        content = {"files": _files(stage, recorded), "episodes": recorded, "minds": _minds(stage, recorded)}
        (part / "data.js").write_text(f"window.CLEARWAY_SAVED = {json.dumps(content, separators=(',', ':'))};\n")
        sizes = [path.stat().st_size for path in part.rglob("*") if path.is_file()]
    return SavedSize(len(recorded), len(sizes), sum(sizes) / 1e6)


def _wanted(stage: Stage, first: str, episodes: int) -> Iterator[Episode]:
    if first:
        yield replace(read_episode(first), drive=False)
    for scene in stage.scenes:
        best = stage.first_target(scene.name)
        for target in (best, *(other for other in stage.targets[scene.name] if other != best)):
            for seed in range(episodes):
                yield Episode(scene=scene.name, target=target, seed=seed)


def _recorded(stage: Stage, episode: Episode) -> dict[str, Any]:
    """What the page would have been told of an episode: its beginning, then step by step."""
    session = Viewing(stage)
    begun = session.tell(episode)
    steps: list[dict[str, Any]] = []
    while len(steps) < MOST_STEPS and not all(walker.ended for walker in session.walkers):
        told = session.ask({"do": "step"})
        if not any(told["steps"]):
            break
        steps.append({"steps": told["steps"], "ended": told["ended"]})
    if steps:  # where the recording ends, so does the episode
        steps[-1]["ended"] = [True] * len(session.walkers)
    return {"begun": {**begun, "recorded": len(steps), "drive": False}, "steps": steps}


def _distinct(recorded: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Without those that begin in the same pose to the same target as an earlier one."""
    found: dict[tuple[int, int, int], dict[str, Any]] = {}
    for episode in recorded:
        begun = episode["begun"]
        found.setdefault((begun["scene"], begun["start"], begun["target"]), episode)
    return list(found.values())


def _files(stage: Stage, recorded: list[dict[str, Any]]) -> dict[str, Any]:
    """The JSON files that the page fetches elsewhere."""
    files: dict[str, Any] = {"stage.json": stage_json(stage)}
    for index in range(len(stage.scenes)):
        here = [episode["begun"]["target"] for episode in recorded if episode["begun"]["scene"] == index]
        files[f"scenes/{index}/map.json"] = {
            **map_json(stage, index),
            "targets": list(dict.fromkeys(here)),
            "trained": list(stage.targets[stage.scenes[index].name]),
            "sensors": [],
        }
    return files


def _minds(stage: Stage, recorded: list[dict[str, Any]]) -> dict[str, Any]:
    """Values and probabilities of all poses, by scene, target and agent; of agents that tell them."""
    told = {}
    for episode in recorded:
        begun = episode["begun"]
        for walker, shown in enumerate(stage.agents):
            key = f"{begun['scene']} {begun['target']} {walker}"
            if shown.tells_values and key not in told:
                session = Viewing(stage)
                session.begin(read_episode(begun["link"]))
                told[key] = session.ask({"do": "map", "walker": walker})
    return told


def _write_page(folder: Path, index: Path) -> None:
    files = {name: content for name, (content, _) in page_files().items()}
    page = files.pop("index.html").decode()
    assert MODULES in page, "the page's script is named in another way"
    index.write_text(page.replace(MODULES, SCRIPTS), encoding="utf-8")
    folder.mkdir()
    scripts = {name: files.pop(name).decode() for name in list(files) if name.endswith(".js")}
    (folder / "page.js").write_text(bundled(scripts, "app.js"), encoding="utf-8")
    for name, content in files.items():
        (folder / name).write_bytes(content)


def _write_pictures(stage: Stage, recorded: list[dict[str, Any]], folder: Path) -> None:
    """The picture from above, and of every pose that an episode passes or leads to."""
    for index, scene in enumerate(stage.scenes):
        passed = set()
        for episode in recorded:
            begun = episode["begun"]
            if begun["scene"] == index:
                walked = [step for walker in begun["walkers"] for step in walker["steps"]]
                walked += [step for told in episode["steps"] for step in told["steps"] if step]
                passed |= {begun["target"], *(step["state"] for step in walked)}
        place = folder / f"scenes/{index}"
        (place / "views").mkdir(parents=True)
        if scene.top_view is not None:
            (place / "above.jpg").write_bytes(jpeg(scene.top_view.image, QUALITY))
        if scene.observations is not None:
            for state in sorted(passed):
                (place / f"views/{state}.jpg").write_bytes(jpeg(scene.observations[state], QUALITY))
