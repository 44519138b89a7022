"""The viewer's page and what it asks for: files, pictures, maps, a WebSocket for the episode, and films.

Behind `web.guard`: every path here comes after the token. Nothing is written but a film, in a folder of its own that
is removed once the film is sent.
"""

from __future__ import annotations

import asyncio
import json
import tempfile
import threading
from pathlib import Path

import numpy as np

from clearway.errors import ClearwayError, install_hint
from clearway.view.content import grey, jpeg, map_json, page_files, shades, stage_json
from clearway.view.episode import read_episode
from clearway.view.film import write_film
from clearway.view.stage import Stage
from clearway.view.viewing import Viewing

try:
    from fastapi import FastAPI, Request, WebSocket, WebSocketDisconnect
    from fastapi.responses import JSONResponse, Response
except ImportError as error:
    raise ClearwayError(f"the viewer needs FastAPI. {install_hint('view')}") from error

MOST_PAGES = 16  # open at a time
TOO_MANY_PAGES = 4001  # WebSocket close code; the page shows the reason that comes with it
FILM_FRAMES_PER_S = 3


def make_app(stage: Stage) -> FastAPI:
    """The application for a stage."""
    app = FastAPI(openapi_url=None)
    files = page_files()
    filming, pages = threading.Lock(), asyncio.Semaphore(MOST_PAGES)

    @app.exception_handler(ClearwayError)
    def refused(request: Request, error: ClearwayError) -> Response:
        return _fresh(JSONResponse({"text": str(error)}, status_code=400))

    @app.get("/")
    def index() -> Response:
        return _fresh(_file(*files["index.html"]))

    @app.get("/page/{name}")
    def page_file(name: str) -> Response:
        return _fresh(_file(*files[name])) if name in files else Response(status_code=404)

    @app.get("/stage.json")
    def whole_stage() -> Response:
        return _fresh(JSONResponse(stage_json(stage)))

    @app.get("/scenes/{index}/map.json")
    def scene_map(index: int) -> Response:
        return _fresh(JSONResponse(map_json(stage, index))) if index in range(len(stage.scenes)) else _missing()

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
        shown = next((one for one in shades(scene) if one.name == sensor), None)
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


def _parsed(text: str) -> object:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None


def _file(content: bytes, kind: str) -> Response:
    return Response(content, media_type=kind)


def _jpeg(image: np.ndarray) -> Response:
    return Response(jpeg(image), media_type="image/jpeg", headers={"cache-control": "private, max-age=3600"})


def _missing() -> Response:
    return _fresh(Response(status_code=404))


def _fresh(response: Response) -> Response:
    response.headers["cache-control"] = "no-store"
    return response
