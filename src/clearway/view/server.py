"""The viewer's page and what it asks for: files, pictures, maps, a WebSocket for the episode, and films.

Behind `web.guard`: every path here comes after the token. Nothing is written but a film, in a folder of its own that
is removed once the film is sent.
"""

from __future__ import annotations

import asyncio
import io
import json
import tempfile
import threading
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from clearway.errors import ClearwayError
from clearway.scenes.scene import Scene
from clearway.scenes.sensors import Sensor
from clearway.view.episode import read_episode
from clearway.view.film import write_film
from clearway.view.stage import Stage
from clearway.view.viewing import Viewing
from clearway.viz.maps import map_extent
from clearway.zones import scene_zones

try:
    from fastapi import FastAPI, Request, WebSocket, WebSocketDisconnect
    from fastapi.responses import JSONResponse, Response
except ImportError as error:
    raise ClearwayError("the viewer needs FastAPI. Install it: pip install 'clearway[view]'") from error

PAGE = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}
"""Kinds of the page's files, by ending."""
MOST_PAGES = 16  # open at a time
TOO_MANY_PAGES = 4001  # WebSocket close code; the page shows the reason that comes with it
FILM_FRAMES_PER_S = 3
GREY_BEND = 20  # how much better near is told apart than far; depth in metres up to 20 becomes log(1 + depth)
JPEG = {"quality": 90, "subsampling": 0}


def make_app(stage: Stage) -> FastAPI:
    """The application for a stage."""
    app = FastAPI(openapi_url=None)
    files = _page_files()
    filming, pages = threading.Lock(), asyncio.Semaphore(MOST_PAGES)

    @app.exception_handler(ClearwayError)
    def refused(request: Request, error: ClearwayError) -> Response:
        return _fresh(JSONResponse({"text": str(error)}, status_code=400))

    @app.get("/")
    def index() -> Response:
        return _fresh(Response(*files["index.html"]))

    @app.get("/page/{name}")
    def page_file(name: str) -> Response:
        return _fresh(Response(*files[name])) if name in files else Response(status_code=404)

    @app.get("/stage.json")
    def whole_stage() -> Response:
        return _fresh(JSONResponse(_stage_json(stage)))

    @app.get("/scenes/{index}/map.json")
    def scene_map(index: int) -> Response:
        return _fresh(JSONResponse(_map_json(stage, index))) if index in range(len(stage.scenes)) else _missing()

    @app.get("/scenes/{index}/above.jpg")
    def above(index: int) -> Response:
        view = stage.scenes[index].top_view if index in range(len(stage.scenes)) else None
        return _jpeg(view.image) if view is not None else _missing()

    @app.get("/scenes/{index}/views/{state}.jpg")
    def picture(index: int, state: int) -> Response:
        if index not in range(len(stage.scenes)) or state not in range(stage.scenes[index].state_count):
            return _missing()
        observations = stage.scenes[index].observations
        return _jpeg(observations[state]) if observations is not None else _missing()

    @app.get("/scenes/{index}/{sensor}/{state}.jpg")
    def sensed(index: int, sensor: str, state: int) -> Response:
        if index not in range(len(stage.scenes)) or state not in range(stage.scenes[index].state_count):
            return _missing()
        scene = stage.scenes[index]
        shown = next((one for one in _shades(scene) if one.name == sensor), None)
        return _missing() if shown is None else _jpeg(grey(scene.seen_by(sensor)[state], shown))

    @app.get("/film.mp4")
    def film(request: Request) -> Response:
        episode = read_episode(request.url.query)
        with filming, tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "episode.mp4"
            write_film(stage, episode, path, FILM_FRAMES_PER_S)
            headers = {"content-disposition": 'attachment; filename="episode.mp4"'}
            return _fresh(Response(path.read_bytes(), media_type="video/mp4", headers=headers))

    @app.websocket("/live")
    async def live(socket: WebSocket) -> None:
        if pages.locked():
            await socket.accept()  # a page is told nothing about a refused socket
            reason = f"{MOST_PAGES} pages are open. Close one, then load this one again"
            return await socket.close(TOO_MANY_PAGES, reason)
        async with pages:
            await socket.accept()
            session = Viewing(stage)
            try:
                while True:
                    message = _parsed(await socket.receive_text())
                    await socket.send_text(json.dumps(await asyncio.to_thread(session.answer, message)))
            except (WebSocketDisconnect, KeyError):  # KeyError: bytes instead of text
                return None

    return app


def grey(values: np.ndarray, sensor: Sensor) -> np.ndarray:
    """A sensor's values as a picture of their shape, uint8: white for the lowest, black for the highest.

    Steps near the lowest are told apart better than steps near the highest: depth of a room, where the range goes far.
    """
    share = (values.astype(np.float64) - sensor.low) / (sensor.high - sensor.low)
    return np.rint(255 * (1 - np.log1p(GREY_BEND * share) / np.log1p(GREY_BEND))).astype(np.uint8)


def _shades(scene: Scene) -> list[Sensor]:
    """The sensors of a scene whose observations are one number a pixel."""
    return [sensor for sensor in scene.sensors if len(sensor.shape) == 2]


def _page_files() -> dict[str, tuple[bytes, int, None, str]]:
    """The page's files by name: content, status, headers, kind."""
    folder = resources.files("clearway.view") / "page"
    found = {}
    for file in folder.iterdir():
        kind = PAGE.get(Path(file.name).suffix)
        if kind:
            found[file.name] = (file.read_bytes(), 200, None, kind)
    return found


def _parsed(text: str) -> object:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None


def _stage_json(stage: Stage) -> dict[str, Any]:
    return {
        "agents": [
            {"name": shown.name, "values": shown.tells_values, "map": not shown.tells_values} for shown in stage.agents
        ],
        "scenes": [scene.name for scene in stage.scenes],
    }


def _map_json(stage: Stage, index: int) -> dict[str, Any]:
    scene = stage.scenes[index]
    left, right, low, high = map_extent(scene)
    return {
        "name": scene.name,
        "extent_m": [left, right, low, high],
        "cell_size_m": scene.cell_size_m,
        "turn_deg": scene.turn_deg,
        "locations_m": np.round(scene.locations_m, 4).tolist(),
        "headings_deg": scene.headings_deg.tolist(),
        "cells": scene.cells.tolist(),
        "zones": scene_zones(scene, stage.zone_level).tolist(),
        "targets": list(stage.targets[scene.name]),
        "has_pictures": scene.observations is not None,
        "picture_shape": None if scene.observations is None else list(scene.observations.shape[1:3]),
        "has_above": scene.top_view is not None,
        "sensors": [sensor.to_json() for sensor in _shades(scene)],
    }


def _jpeg(image: np.ndarray) -> Response:
    content = io.BytesIO()
    Image.fromarray(np.asarray(image)).convert("RGB").save(content, "JPEG", **JPEG)
    return Response(content.getvalue(), media_type="image/jpeg", headers={"cache-control": "private, max-age=3600"})


def _missing() -> Response:
    return _fresh(Response(status_code=404))


def _fresh(response: Response) -> Response:
    response.headers["cache-control"] = "no-store"
    return response
