"""The viewer's page in a real headless Chromium, clicked through; any error on the page fails the test."""

import json
import re
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import av
import pytest
from playwright.sync_api import Browser, Page, expect

from helpers.browser import opened_browser

pytestmark = pytest.mark.slow  # what they share takes long to make

PATIENCE_MS = 60_000  # others may be using the machine
PHONE = {"width": 390, "height": 844}


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with opened_browser() as browser:
        yield browser


@pytest.fixture
def opened(browser: Browser, address: str) -> Iterator[Callable[..., Page]]:
    """Opens the viewer's page at an episode."""
    contexts, wrong = [], []

    def at(episode: str = "", before: str = "", **looks) -> Page:
        looks = {"viewport": {"width": 1280, "height": 860}, "reduced_motion": "reduce"} | looks
        context = browser.new_context(**looks)
        contexts.append(context)
        page = context.new_page()
        page.add_init_script(before)
        page.set_default_timeout(PATIENCE_MS)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("console", lambda message: wrong.append(message.text) if message.type in ("error", "warning") else None)
        page.goto(f"{address}#{episode}")
        expect(page.locator(".walker").first).to_be_visible()
        return page

    yield at
    for context in contexts:
        context.close()
    assert wrong == []


@pytest.fixture(autouse=True)
def _patient() -> None:
    expect.set_options(timeout=PATIENCE_MS)


def number(page: Page, walker: str, field: str) -> str:
    return page.locator(f'[data-walker="{walker}"] [data-field="{field}"]').inner_text()


def shown(page: Page, position: str) -> None:
    """Wait until the playback stands at, for example, "2 / 2"."""
    expect(page.locator("#position")).to_have_text(position)


def point(page: Page, state: int) -> dict[str, float]:
    """Where a pose of the scene lies on the map, computed here once more: a third of a cell ahead of its middle."""
    scene = page.evaluate(
        "fetch(`scenes/${document.querySelector('#scene').selectedIndex}/map.json`).then(r => r.json())"
    )
    left, right, low, high = scene["extent_m"]
    box = page.locator("#map").bounding_box()
    assert box is not None
    x, z = scene["locations_m"][state]
    ahead = {0: (0, 1), 90: (1, 0), 180: (0, -1), 270: (-1, 0)}[scene["headings_deg"][state]]
    x, z = x + ahead[0] * scene["cell_size_m"] / 3, z + ahead[1] * scene["cell_size_m"] / 3
    return {"x": box["width"] * (x - left) / (right - left), "y": box["height"] * (high - z) / (high - low)}


def pixels(page: Page) -> str:
    """The map as it looks."""
    return page.locator("#map").evaluate("canvas => canvas.toDataURL()")


def test_a_whole_episode_by_mouse(opened: Callable[..., Page], tmp_path: Path) -> None:
    page = opened("scene=corridor&seed=2")
    before = pixels(page)
    page.locator("#map").click(position=point(page, 1))  # the first cell, looking aside
    shown(page, "0 / 0")
    expect(page).to_have_url(re.compile("start=1&"))
    page.get_by_text("the target", exact=True).click()
    page.locator("#map").click(position=point(page, 12))
    expect(page.locator("#goal-where")).to_have_text("pose 12, heading 0°, not trained on")
    page.get_by_role("button", name="Target pose 8,").click()
    expect(page.locator("#goal-where")).to_have_text("pose 8, heading 0°, trained on")
    assert pixels(page) != before

    page.get_by_role("button", name="Race").click()
    expect(page.locator('[data-walker="you"]')).to_be_visible()
    page.get_by_role("button", name="forward", exact=True).click()
    shown(page, "1 / 1")
    assert (number(page, "you", "steps"), number(page, "you", "collisions")) == ("1", "1")
    expect(page.locator('[data-walker="you"].bumped')).to_be_visible()
    for name in ("turn left", "forward", "forward"):
        page.get_by_role("button", name=name, exact=True).click()
    shown(page, "4 / 4")
    assert (number(page, "you", "to_go"), number(page, "you", "collisions")) == ("0", "1")
    assert number(page, "you", "earned") == "9.95"  # 10 - 0.02 - 0.02 - 0.011, by the collision-aware reward
    expect(page.locator('[data-walker="you"] .badge')).to_have_text("winner")
    expect(page.locator("#status")).to_contain_text("you: target reached in 4 steps, 1 collision. You win, in 4 steps")
    assert int(number(page, "aware", "steps")) == int(number(page, "plain", "steps")) == 4
    shares = page.locator('[data-walker="aware"] .share').all_inner_texts()
    assert sum(float(share.removesuffix(" %")) for share in shares) == pytest.approx(100, abs=2.1)

    page.locator("#timeline").fill("1")
    shown(page, "1 / 4")
    assert number(page, "you", "to_go") == "3"
    page.get_by_role("button", name="Restart").click()
    shown(page, "0 / 0")

    page.get_by_role("button", name="One step", exact=True).click()
    shown(page, "1 / 1")
    with page.expect_download() as download:
        page.get_by_role("button", name="Save MP4").click()
    download.value.save_as(tmp_path / "episode.mp4")
    with av.open(str(tmp_path / "episode.mp4")) as film:
        assert sum(1 for _ in film.decode(video=0)) == 2 + 6
    expect(page.locator("#status")).to_contain_text("Film saved")


def test_two_agents_play_to_the_end_and_the_link_replays_them(opened: Callable[..., Page]) -> None:
    page = opened("scene=corridor&start=4&target=8&seed=52")
    page.locator("#speed").fill("5")
    page.get_by_role("button", name="Play").click()
    expect(page.locator(".badge.good")).to_have_count(2)
    expect(page.locator("body.playing")).to_have_count(0)
    steps = {name: number(page, name, "steps") for name in ("aware", "plain")}
    assert {number(page, name, "to_go") for name in steps} == {"0"}
    link = page.url
    walks = [part for part in link.split("&") if part.startswith("walk=")]
    assert {name: len(walk) - len("walk=") for name, walk in zip(steps, walks, strict=True)} == {
        name: int(count) for name, count in steps.items()
    }

    again = opened(link.partition("#")[2], reduced_motion="no-preference")  # plays by itself
    expect(again.locator(".badge.good")).to_have_count(2)
    assert {name: number(again, name, "steps") for name in steps} == steps


def test_by_keyboard_alone(opened: Callable[..., Page]) -> None:
    page = opened("scene=corridor&start=4&target=16&selection=argmax")
    page.keyboard.press("n")
    shown(page, "1 / 1")
    page.keyboard.press("b")
    shown(page, "0 / 1")
    page.keyboard.press("d")
    expect(page.locator('[data-walker="you"]')).to_be_visible()
    for key, position in (("ArrowUp", "1 / 1"), ("ArrowUp", "2 / 2"), ("ArrowDown", "3 / 3")):
        page.keyboard.press(key)
        shown(page, position)
    assert number(page, "you", "to_go") == "2"
    zones = pixels(page)
    page.keyboard.press("2")
    expect(page.locator("#legend")).to_contain_text("value")
    value = pixels(page)
    page.keyboard.press("3")
    expect(page.locator("#legend")).to_contain_text("turn left")
    assert len({zones, value, pixels(page)}) == 3
    page.keyboard.press("m")
    expect(page.locator("#map")).to_be_focused()
    page.keyboard.press("ArrowUp")  # the cursor, not the user
    page.keyboard.press("PageDown")
    expect(page.locator("#cursor")).to_have_text("Cursor: pose 9, heading 90°, collision zone")
    page.keyboard.press("Enter")
    shown(page, "0 / 0")
    expect(page).to_have_url(re.compile("start=9&"))  # one cell on, turned right
    page.keyboard.press("?")
    expect(page.get_by_role("dialog")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_be_hidden()
    for _ in range(40):  # every control can be reached, and shows that it is
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.id") == "play":
            break
    assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid"
    assert page.evaluate("document.activeElement.id") == "play"


def test_a_scene_without_pictures_and_with_twelve_headings(opened: Callable[..., Page]) -> None:
    page = opened("scene=grid")
    assert (
        page.locator('[data-walker="aware"] img').evaluate("image => image.decode().then(() => image.naturalWidth)")
        == 16
    )
    page.locator("#scene").select_option("bare")
    expect(page.locator('[data-walker="aware"] .picture')).to_have_text("no pictures in this scene")
    expect(page.get_by_role("button", name="Target pose 30, heading 180°")).to_have_text("30")
    plain = pixels(page)
    for key in ("2", "3"):
        page.keyboard.press(key)
        page.wait_for_timeout(50)
    expect(page.locator("#legend")).to_contain_text("backward")
    assert pixels(page) != plain
    page.keyboard.press("n")
    shown(page, "1 / 1")


def test_play_at_the_end_starts_over(opened: Callable[..., Page]) -> None:
    page = opened("scene=corridor&start=4&target=8&seed=52")
    page.locator("#speed").fill("5")
    page.get_by_role("button", name="Play").click()
    expect(page.locator(".badge.good")).to_have_count(2)
    end = page.locator("#position").inner_text().partition(" / ")[2]
    shown(page, f"{end} / {end}")
    page.locator("#speed").fill("0")
    page.get_by_role("button", name="Play").click()
    expect(page.locator("#position")).to_have_text(re.compile(rf"^[01] / {end}$"))
    expect(page.locator("body.playing")).to_be_visible()
    assert int(end) > 1  # it was elsewhere before


LONG = {"aware": "bathroom-collision-aware-ppo-s0", "plain": "bathroom-shortest-ppo-s0"}
RENAMED = (
    f"const long = {json.dumps([[json.dumps(word) for word in pair] for pair in LONG.items()])};"
    """
    const parse = JSON.parse;
    JSON.parse = (text) => parse(long.reduce((told, [own, other]) => told.replaceAll(own, other), text));
    Response.prototype.json = async function () { return JSON.parse(await this.text()); };
    """
)


@pytest.mark.parametrize("viewport", [{"width": 1280, "height": 800}, PHONE], ids=["screen", "phone"])
def test_long_names_take_one_line_and_the_views_stand_level(opened: Callable[..., Page], viewport: dict) -> None:
    at = "scene=corridor&start=4&target=8"
    heights = "cards => cards.map((card) => card.querySelector('header').offsetHeight)"
    short = opened(at, viewport=viewport).locator(".walker").evaluate_all(heights)
    page = opened(at, viewport=viewport, before=RENAMED)
    names = page.locator(".walker h2")
    expect(names).to_have_text(list(LONG.values()))  # read aloud whole
    assert page.locator(".walker").evaluate_all(heights) == short == [short[0]] * 2
    for name, heading in zip(LONG.values(), names.all(), strict=True):
        title = heading.get_attribute("title")
        assert title is not None and title.startswith(name)
        cut = "(heading) => [...heading.children].some(({ scrollWidth, clientWidth }) => scrollWidth > clientWidth)"
        assert heading.evaluate(cut)
        assert heading.evaluate("({ lastChild }) => getComputedStyle(lastChild).textOverflow") == "ellipsis"
    own = names.locator(".own").all_inner_texts()
    assert own == ["collision-aware-ppo-s0", "shortest-ppo-s0"]  # what tells them apart is cut last
    assert page.evaluate("document.documentElement.scrollWidth") <= viewport["width"]


def test_the_page_says_who_walks_where(opened: Callable[..., Page]) -> None:
    page = opened("scene=corridor&start=4&target=8", viewport=PHONE)
    expect(page.locator("h1")).to_contain_text("corridor: aware and plain, to where the target's picture was taken")
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]


def test_an_agent_has_one_colour_whatever_the_order(opened: Callable[..., Page]) -> None:
    """The second agent's, green, is the collision-aware one's, as on the demo's page."""
    page = opened("scene=corridor")
    script = "async (walkers) => (await import('./page/looks.js')).withLooks(walkers).map(({ look }) => look.colour)"
    blue, green, purple = "#0b3d91", "#3ddc84", "#8e2c9c"
    for rewards, colours in {
        ("shortest", "collision-aware"): [blue, green],
        ("collision-aware", "shortest"): [green, blue],
        ("collision-aware", "collision-aware"): [blue, green],
        ("bump", "shortest"): [blue, green],
        ("collision-aware",): [blue],
    }.items():
        walkers = [{"agent": True, "reward": reward} for reward in rewards] + [{"agent": False, "reward": "shortest"}]
        assert page.evaluate(script, walkers) == [*colours, purple]


def test_the_star_is_seen_round_those_who_stand_on_it(opened: Callable[..., Page]) -> None:
    green = """(canvas) => {
        const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d");
        copy.drawImage(canvas, 0, 0);
        const { data } = copy.getImageData(0, 0, canvas.width, canvas.height);
        let found = 0;
        for (let i = 0; i < data.length; i += 4) found += data[i] === 0 && data[i + 1] === 135 && data[i + 2] === 108;
        return found;
    }"""
    page = opened("scene=corridor&start=4&target=8&seed=52")
    apart = page.locator("#map").evaluate(green)
    page.locator("#speed").fill("5")
    page.get_by_role("button", name="Play").click()
    expect(page.locator(".badge.good")).to_have_count(2)
    assert page.locator("#map").evaluate(green) > 0.6 * apart > 0


RACE = {
    "alone": ([(4, 1), (6, 0)], [0], {"index": 0, "text": "a wins, in 4 steps"}),
    "together": ([(4, 1), (4, 0)], [0, 1], {"index": 1, "text": "b wins, with fewer collisions (0)"}),
    "tie": ([(4, 1), (4, 1)], [0, 1], {"index": None, "text": "A tie: a and b"}),
    "none": ([(4, 1), (4, 1)], [], None),
}


@pytest.mark.parametrize("case", RACE)
def test_a_race_is_won_by_who_arrives_first(opened: Callable[..., Page], case: str) -> None:
    walks, first, expected = RACE[case]
    walkers = [
        {"name": name, "steps": [{"collisions": bumps}] * (steps + 1)}
        for name, (steps, bumps) in zip("ab", walks, strict=True)
    ]
    page = opened("scene=corridor")
    script = "async ([walkers, first]) => (await import('./page/verdict.js')).verdict(walkers, first)"
    found = page.evaluate(script, [walkers, first])
    assert found == expected


def test_depth_is_a_switch_away_where_the_scene_has_it(opened: Callable[..., Page]) -> None:
    page = opened("scene=corridor&start=1&target=8")
    picture = page.locator('[data-walker="aware"] .picture img')
    expect(picture).to_have_attribute("src", "scenes/0/views/1.jpg")
    page.get_by_label("Seen by").select_option("depth, 0 to 20 m")
    expect(picture).to_have_attribute("src", "scenes/0/depth/1.jpg")
    expect(page.locator("#goal-picture")).to_have_attribute("src", "scenes/0/depth/8.jpg")
    expect(page.locator("#targets img").first).to_have_attribute("src", re.compile("scenes/0/depth/"))
    assert page.evaluate("Promise.all([...document.images].map((image) => image.decode())).then(() => true)")
    page.locator("#scene").select_option("grid")
    expect(page.get_by_label("Seen by")).to_be_hidden()
    expect(picture).to_have_attribute("src", re.compile("scenes/1/views/"))


def test_scenes_change_from_large_to_small_and_faster_than_they_load(opened: Callable[..., Page]) -> None:
    page = opened("scene=bare&start=59&target=30")
    page.locator("#scene").select_option("corridor")
    expect(page).to_have_url(re.compile("scene=corridor&"))
    page.locator("#layer").get_by_text("Value").click()
    page.evaluate("""() => {
        for (const name of ["bare", "corridor", "grid", "bare", "corridor"]) {
            document.querySelector("#scene").value = name;
            document.querySelector("#scene").dispatchEvent(new Event("change"));
        }
    }""")
    page.keyboard.press("n")
    shown(page, "1 / 1")
    expect(page).to_have_url(re.compile("scene=corridor&.*walk="))
    expect(page.locator("#scene")).to_have_value("corridor")
    expect(page.locator("#legend")).to_contain_text("value")
    assert page.locator("#targets img").count() == 3  # the corridor's, not those of a scene that came late


def test_a_browser_that_keeps_no_more_addresses_shows_the_steps_nevertheless(opened: Callable[..., Page]) -> None:
    """Safari throws after 100 in 30 s."""
    page = opened("scene=corridor&target=8")
    page.evaluate("""() => {
        history.replaceState = () => { throw new DOMException("too many", "SecurityError"); };
        const writeText = async (text) => { window.copied = text; };
        Object.defineProperty(navigator, "clipboard", { value: { writeText } });
    }""")
    page.keyboard.press("n")
    shown(page, "1 / 1")
    expect(page.locator("#value-chart")).to_be_visible()
    page.get_by_role("button", name="Copy link").click()
    expect(page.locator("#status")).to_contain_text("Link copied")
    assert re.search("#scene=corridor&.*&walk=", page.evaluate("copied"))


def test_choosing_a_target_by_keyboard_keeps_the_focus(opened: Callable[..., Page]) -> None:
    page = opened("scene=corridor&target=16")
    page.get_by_role("button", name="Target pose 8,").focus()
    page.keyboard.press("Enter")
    expect(page.locator("#goal-where")).to_contain_text("pose 8,")
    expect(page.get_by_role("button", name="Target pose 8,")).to_be_focused()
    assert "target=8" in page.url


def test_one_page_too_many_is_told_to_close_another(browser: Browser, full: str) -> None:
    with closing(browser.new_page()) as page:
        page.goto(full)
        expect(page.locator("#status")).to_have_text("16 pages are open. Close one, then load this one again")
        assert page.locator("#position").inner_text() == "0 / 0"  # nothing is walked for it


def test_a_film_that_fails_is_said_and_can_be_tried_again(opened: Callable[..., Page]) -> None:
    page = opened("scene=corridor")
    page.evaluate("window.fetch = async () => new Response('Internal Server Error', { status: 500 })")
    button = page.get_by_role("button", name="Save MP4")
    button.click()
    expect(page.locator("#status")).to_have_text("The viewer failed. Its terminal says why")
    expect(button).to_be_enabled()
    assert page.locator("#position").inner_text() == "0 / 0"  # the failed film has not walked


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_a_phone_in_light_and_dark(opened: Callable[..., Page], scheme: str) -> None:
    page = opened("scene=grid&drive=1", viewport=PHONE, color_scheme=scheme, has_touch=True, is_mobile=True)
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
    play = page.get_by_role("button", name="Play")
    box = play.bounding_box()
    assert box is not None and box["y"] + box["height"] <= PHONE["height"]  # at hand without scrolling
    ink, paper = (page.evaluate(f"getComputedStyle(document.body).{name}") for name in ("color", "backgroundColor"))
    light_ink, light_paper = (sum(json.loads(f"[{colour[4:-1]}]")) for colour in (ink, paper))
    assert abs(light_ink - light_paper) > 500
    assert (light_paper > light_ink) == (scheme == "light")
    forward = page.get_by_role("button", name="forward", exact=True)
    forward.tap()
    shown(page, "1 / 1")


def test_a_damaged_link_is_said_and_another_episode_begins(opened: Callable[..., Page]) -> None:
    page = opened("scene=attic")
    expect(page.locator("#status")).to_contain_text("scene attic: not shown here")
    expect(page.locator("#goal-where")).to_contain_text("pose 0")
    assert "attic" not in page.locator("#goal-where").inner_text()
