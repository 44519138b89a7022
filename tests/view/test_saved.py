"""The saved page: what lies in its folder, and how it plays in a browser, from a file and from a plain file server."""

import json
import re
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from clearway.errors import ClearwayError
from clearway.view import saved
from clearway.view.bundle import bundled
from clearway.view.saved import save_page
from clearway.view.stage import Stage, scene_stage
from helpers.browser import opened_browser

FIRST = "scene=corridor&start=4&target=8&seed=52"
PATIENCE_MS = 60_000


@pytest.fixture(scope="module")
def page_folder(stage: Stage, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("saved") / "page"
    size = save_page(stage, folder, first=FIRST, episodes=2)
    assert size.files == sum(1 for path in folder.rglob("*") if path.is_file())
    assert 0 < size.megabytes < 3
    assert size.episodes == len(content(folder)["episodes"])
    return folder


def content(folder: Path) -> dict:
    text = (folder / "data.js").read_text()
    assert text.startswith("window.CLEARWAY_SAVED = ")
    return json.loads(text.removeprefix("window.CLEARWAY_SAVED = ").removesuffix(";\n"))


def test_episodes_to_every_target_and_their_pictures_are_there(page_folder: Path, stage: Stage) -> None:
    held = content(page_folder)
    begun = [episode["begun"] for episode in held["episodes"]]
    assert (begun[0]["start"], begun[0]["target"], begun[0]["seed"]) == (4, 8, 52)
    starts = [(one["scene"], one["target"], one["start"]) for one in begun]
    assert len(set(starts)) == len(starts)
    for index, scene in enumerate(stage.scenes):
        wanted = set(stage.targets[scene.name])
        assert {target for where, target, _ in starts if where == index} == wanted
        assert {f"{index} {target} {agent}" for target in wanted for agent in (0, 1)} <= set(held["minds"])
    for episode in held["episodes"]:
        assert 0 < len(episode["steps"]) <= saved.MOST_STEPS
        assert all(episode["steps"][-1]["ended"])
        for told in episode["steps"]:
            states = [step["state"] for step in told["steps"] if step]
            if stage.scenes[episode["begun"]["scene"]].observations is not None:
                place = page_folder / f"scenes/{episode['begun']['scene']}/views"
                assert all((place / f"{state}.jpg").exists() for state in states)


def test_a_recorded_episode_is_the_one_that_the_viewer_walks(page_folder: Path, stage: Stage) -> None:
    from clearway.view.viewing import Viewing

    session, recorded = Viewing(stage), content(page_folder)["episodes"][0]
    session.answer({"do": "begin", "episode": FIRST})
    for told in recorded["steps"]:
        assert json.loads(json.dumps(session.answer({"do": "step"})["steps"])) == told["steps"]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with opened_browser() as browser:
        yield browser


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *words: object) -> None:
        """Nothing."""


@pytest.fixture(scope="module")
def addresses(page_folder: Path) -> Iterator[dict[str, str]]:
    """Of the page as a file, and on a plain file server."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(page_folder)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield {"file": (page_folder / "index.html").as_uri(), "server": f"http://127.0.0.1:{server.server_port}/"}
    server.shutdown()
    server.server_close()
    thread.join()


@pytest.mark.parametrize("how", ["file", "server"])
def test_the_page_plays(browser: Browser, addresses: dict[str, str], how: str) -> None:
    expect.set_options(timeout=PATIENCE_MS)
    wrong: list[str] = []
    page = browser.new_page(reduced_motion="reduce", viewport={"width": 1280, "height": 800})
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda message: wrong.append(message.text) if message.type in ("error", "warning") else None)
    page.clock.install()
    page.goto(addresses[how])
    expect(page.locator("h1")).to_contain_text("(recorded)")
    expect(page.locator("#position")).to_have_text("0 / 0")
    for name in ("Race", "Save MP4"):
        expect(page.get_by_role("button", name=name)).to_be_hidden()
    expect(page.locator("#selection")).to_be_hidden()
    page.locator("#speed").fill("5")
    page.get_by_role("button", name="Play").click()
    expect(page.locator(".badge.good")).to_have_count(2)
    walked = [tuple(map(int, card.locator("dd").all_inner_texts()[:2])) for card in page.locator(".walker").all()]
    tie = len(set(walked)) == 1  # steps and collisions
    badges = ["winner" if own == min(walked) and not tie else "reached" for own in walked]
    expect(page.locator(".badge.good")).to_have_text(badges)
    assert page.evaluate("Promise.all([...document.images].map((image) => image.decode())).then(() => true)")
    page.get_by_text("Value", exact=True).first.click()
    expect(page.locator("#legend")).to_contain_text("value")
    page.get_by_role("button", name="Target pose 16,").click()
    expect(page.locator("#goal-where")).to_contain_text("pose 16,")
    before = page.url
    page.get_by_role("button", name="New start").click()
    expect(page).not_to_have_url(before)
    expect(page.locator("#goal-where")).to_contain_text("pose 16,")
    page.clock.run_for(10_000)  # what was said for a while is forgotten
    expect(page.locator("#status")).to_have_text("")
    page.close()
    assert wrong == []


def test_a_click_says_which_recorded_episode_it_took(browser: Browser, addresses: dict[str, str]) -> None:
    page = browser.new_page(reduced_motion="reduce")
    page.goto(addresses["server"])
    where = page.locator("#goal-where")
    expect(where).to_contain_text("pose 8,")
    page.locator("#map").focus()
    page.keyboard.press("Enter")  # the cursor stands at the start
    expect(page.locator("#status")).to_have_text(re.compile(r"^Nearest recorded start: pose 4, .* zone, as before$"))
    page.keyboard.press("ArrowUp")
    page.keyboard.press("ArrowUp")
    page.keyboard.press("ArrowUp")
    page.keyboard.press("t")
    expect(page.locator("#status")).to_have_text(
        re.compile(r"^Nearest recorded target: pose 16, heading 0°, \w+ zone$")
    )
    expect(where).to_contain_text("pose 16,")
    assert "target=16" in page.url
    page.close()


def test_its_help_lists_what_it_can_do(browser: Browser, addresses: dict[str, str]) -> None:
    page = browser.new_page()
    page.goto(addresses["server"])
    expect(page.locator(".walker").first).to_be_visible()
    page.keyboard.press("?")
    told = page.get_by_role("dialog").inner_text()
    assert "play or pause" in told and "zones, value, policy on the map" in told
    for word in ("race", "drive", "elief", "4"):
        assert word not in told
    page.close()


@pytest.mark.parametrize("there", ["file", "full"])
def test_a_folder_that_holds_something_is_left_alone(stage: Stage, tmp_path: Path, there: str) -> None:
    folder = tmp_path / "page"
    if there == "file":
        folder.write_text("mine")
    else:
        folder.mkdir()
        (folder / "mine.txt").write_text("mine")
    with pytest.raises(ClearwayError, match="page: exists and is no empty folder"):
        save_page(stage, folder)
    assert [path.name for path in tmp_path.rglob("*")] == (["page"] if there == "file" else ["page", "mine.txt"])


@pytest.mark.slow
def test_nothing_half_written_stays(stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*words: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(saved, "_write_pictures", full)
    with pytest.raises(OSError, match="No space"):
        save_page(stage, tmp_path / "page", episodes=1)
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_saved_is_told(stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ClearwayError, match="how agents walk, and there is none"):
        save_page(scene_stage(stage.scenes[0]), tmp_path / "page")
    with pytest.raises(ClearwayError, match="attic"):
        save_page(stage, tmp_path / "page", first="scene=attic")
    monkeypatch.setattr(saved, "MOST_EPISODES", 3)
    with pytest.raises(ClearwayError, match=r"\d+ episodes would be saved, at most 3.*fewer --episodes"):
        save_page(stage, tmp_path / "page")
    assert list(tmp_path.iterdir()) == []


def test_modules_become_one_script_in_the_order_of_their_imports() -> None:
    modules = {
        "app.js": 'import { b } from "./b.js";\nimport { a } from "./a.js";\nstart(a, b);\n',
        "b.js": 'import { a } from "./a.js";\nexport const b = a + 1;\n',
        "a.js": "export const a = 1;\nconst own = 2;\n",
        "alone.js": "export const never = 0;\n",
    }
    script = bundled(modules, "app.js")
    places = [script.index(f"const of_{name} =") for name in ("a", "b", "app")]
    assert places == sorted(places)
    assert "never" not in script and "import" not in script and "export" not in script
    assert "return { a };" in script  # and not what is its own
    with pytest.raises(AssertionError, match="not known here"):
        bundled({"app.js": 'import everything from "./a.js";\n'}, "app.js")
    with pytest.raises(AssertionError, match="imports itself"):
        bundled({"app.js": 'import { a } from "./app.js";\n'}, "app.js")
