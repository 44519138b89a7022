"""The site builds without a broken link; what README, tutorial and commands page show does what it says."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image, ImageSequence

from clearway.view.bundle import bundled
from clearway.view.content import page_files
from clearway.view.saved import MODULES, SCRIPTS
from helpers.browser import opened_browser
from helpers.documents import ROOT, Block, code_blocks, run_block, shortened

UNTIL_STOPPED = "timeout 30 clearway "
ROOM = """
<mujoco>
  <worldbody>
    <geom type="plane" size="2 2 .1"/>
    <geom type="box" size=".2 .2 .5" pos="1 1 .5" rgba="1 0 0 1"/>
  </worldbody>
</mujoco>
"""


def test_blocks_are_found() -> None:
    blocks = code_blocks(ROOT / "docs/tutorial.md")
    assert blocks[0] == Block("sh", "clearway demo --out demo\n")
    assert {block.language for block in blocks} == {"sh", "python"}


@pytest.mark.parametrize(
    "page", [*sorted((ROOT / "docs").glob("*.md")), ROOT / "README.md"], ids=lambda page: page.stem
)
def test_the_sources_that_a_page_names_are_there(page: Path) -> None:
    if page.stem == "log":  # of its own time
        return
    named = re.findall(r"(?<![\w./-])((?:[a-z_0-9]+/)+[a-z_0-9]+\.py)\b", page.read_text())
    places = ROOT, ROOT / "src", ROOT / "src/clearway"
    assert [name for name in named if not any((place / name).exists() for place in places)] == []


@pytest.mark.parametrize(("page", "most"), [("README.md", 700), ("docs/results.md", 2_000)])
def test_a_page_stays_short(page: str, most: int) -> None:
    assert len((ROOT / page).read_text().split()) <= most


def test_the_moving_picture_is_small_and_moves() -> None:
    path = ROOT / "docs/pictures/race.webp"
    assert path.stat().st_size < 3_000_000
    with Image.open(path) as picture:
        assert sum(1 for _ in ImageSequence.Iterator(picture)) > 10


def test_a_change_that_is_of_no_use_is_noticed() -> None:
    assert shortened("train --frames 100", {"100": "5"}) == "train --frames 5"
    with pytest.raises(AssertionError, match="no longer says '200'"):
        shortened("train --frames 100", {"200": "5"})


def test_a_block_that_fails_is_noticed(tmp_path: Path) -> None:
    assert run_block(Block("sh", "false\ntrue\n"), tmp_path).returncode == 1
    assert run_block(Block("python", "import clearway\nassert not clearway.__version__\n"), tmp_path).returncode == 1
    assert run_block(Block("sh", "clearway --version\n"), tmp_path).stdout.startswith("clearway ")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site's folder."""
    folder = tmp_path_factory.mktemp("site") / "site"
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.slow
def test_tables_of_the_site_fit_a_phone(site: Path) -> None:
    """What is too wide nevertheless, scrolls within a box."""
    wide = """wraps => wraps.filter(wrap => wrap.scrollWidth > wrap.clientWidth).length"""
    with opened_browser() as browser:
        page = browser.new_page(viewport={"width": 390, "height": 844})
        for name, most in {"results": 0, "first-hour": 0, "reference": 20}.items():
            page.goto((site / name / "index.html").as_uri())
            page.locator(".md-typeset__scrollwrap").first.wait_for()
            assert page.locator(".md-typeset__scrollwrap").evaluate_all(wide) <= most
            assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_the_site_builds_without_a_broken_link(site: Path) -> None:
    pages = {page.parent.name for page in site.rglob("index.html")}
    assert {"tutorial", "python", "zones", "learning", "reference", "metrics", "results", "building"} <= pages
    reference = (site / "reference/index.html").read_text()
    ids = [f'id="clearway.{name}"' for name in ("train", "scenes.thor_v1.read_scene")]  # by the names that one imports
    first, later = map(reference.index, ids)
    assert first < later
    commands = re.sub("<[^>]*>", "", (site / "commands/index.html").read_text())
    assert "# what comes along, and how to open it\nclearway examples\n" in commands  # no comment is cut
    assert "Made with" not in (site / "index.html").read_text()


@pytest.mark.slow
def test_the_tutorial_s_blocks_run(tmp_path: Path) -> None:
    blocks = code_blocks(ROOT / "docs/tutorial.md")
    changes = {
        "--frames 600000": "--frames 4000",
        "demo --out demo": "demo --frames 4000 --out demo",
        "clearway evaluate": "clearway evaluate --episodes 5",
    }
    whole = "\n".join(block.text for block in blocks)
    assert all(old in whole for old in changes)
    for block in blocks:
        here = {old: new for old, new in changes.items() if old in block.text}
        done = run_block(Block(block.language, shortened(block.text, here)), tmp_path)
        assert done.returncode == 0, f"{block.text}\n{done.stderr}"
    made = (
        "demo/index.html",
        "bathroom.png",
        "pictures",
        "episode.mp4",
        "scenes/office.h5",
        "runs/office",
        "office.onnx",
    )
    assert all((tmp_path / name).exists() for name in made)


@pytest.mark.slow
def test_the_readme_s_blocks_run(tmp_path: Path) -> None:
    first, watching, program = code_blocks(ROOT / "README.md")
    programs = [line.partition("#")[0].strip() for line in first.text.splitlines()]
    assert programs == ["scripts/demo", "scripts/test"]  # CI runs the second, and with it this test
    changes = {"frames=600_000": "frames=4_000", "evaluate(run)": "evaluate(run, episodes=2)"}
    done = run_block(Block("python", shortened(program.text, changes)), tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1].split()[0] in ("True", "False")
    train = "clearway train scenes/bathroom.h5 --frames 4000 --out runs/bathroom\n"
    changes = {
        ".venv/bin/clearway view demo/runs/shortest demo/runs/collision-aware": (
            f"{train}{UNTIL_STOPPED}view runs/bathroom runs/bathroom || test $? = 124"
        ),
        ".venv/bin/clearway view --example ": f"{UNTIL_STOPPED}view --example || test $? = 124 ",
        ".venv/bin/clearway view --agent generalist --room 7": (
            f"{UNTIL_STOPPED}view --agent generalist --room 7 || test $? = 124"
        ),
    }
    done = run_block(Block("sh", shortened(watching.text, changes)), tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("http://127.0.0.1:") == 3


@pytest.mark.slow
def test_the_commands_page_s_blocks_run(tmp_path: Path) -> None:
    at_once, commands, runs, again, imports, generalist, encode = code_blocks(ROOT / "docs/commands.md")
    opened = {"clearway view --example   ": f"{UNTIL_STOPPED}view --example || test $? = 124  "}
    done = run_block(Block("sh", shortened(at_once.text, opened)), tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "page/index.html").exists()
    changes = {
        "build --room all --out scenes ": "build --room bathroom --out scenes/bathroom.h5",
        "train scenes ": "train scenes --frames 4000 ",
        "evaluate runs/rooms --targets": "evaluate runs/rooms --episodes 5 --targets",
        "--step-limit 40": "--step-limit 3",
        "--scene kitchen --out episode.mp4": "--scene bathroom --out episode.mp4",
        "--scene kitchen --out kitchen.onnx": "--scene bathroom --out kitchen.onnx",
        "clearway serve kitchen.onnx ": f"{UNTIL_STOPPED}serve kitchen.onnx || test $? = 124 ",
        "reproduce all": "reproduce fig3 --rooms bathroom --frames 4000",
    }
    prepare_stand_ins(tmp_path)
    short = Block("sh", shortened(commands.text, changes))
    shorter = Block("sh", shortened(runs.text, {"--frames 6e5": "--frames 4e3"}))
    for block in (short, shorter, again, imports, encode):
        done = run_block(block, tmp_path)
        assert done.returncode == 0, done.stderr
    changes = {
        "clearway view --agent": f"{UNTIL_STOPPED}view --agent",
        "--room 7                        #": "--room 7 || test $? = 124  #",
        "--count 10": "--count 1 --goals 1 --step-limit 5",
    }
    done = run_block(Block("sh", shortened(generalist.text, changes)), tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("http://127.0.0.1:")
    made = ["bathroom.png", "pictures", "episode.mp4", "kitchen.onnx", "film.mp4", "curves.png", "runs/again/run.yaml"]
    made += [f"{folder}/{name}.h5" for folder in ("imported", "together") for name in ("dump", "hall", "office", "lab")]
    assert all((tmp_path / name).exists() for name in made)


@pytest.mark.slow
def test_the_own_building_page_s_blocks_run(tmp_path: Path) -> None:
    changes = {
        "--frames 6e5": "--frames 12000",
        "runs/office --targets": "runs/office --episodes 2 --targets",
        "clearway view": f"{UNTIL_STOPPED}view",
        "view runs/office\n": "view runs/office || test $? = 124\n",
        "--episodes 20": "--episodes 2",
        "clearway serve": f"{UNTIL_STOPPED}serve",
        "serve office.onnx\n": "serve office.onnx || test $? = 124\n",
        "--goals 5 --tour 100": "--goals 1 --tour 5",
    }
    blocks = code_blocks(ROOT / "docs/building.md")
    whole = "\n".join(block.text for block in blocks)
    prepare_stand_ins(tmp_path)
    said = ""
    for block in blocks:
        if block.language == "text":
            (tmp_path / "hall.txt").write_text(block.text)
            continue
        here = {old: new for old, new in changes.items() if old in block.text}
        done = run_block(Block(block.language, shortened(block.text, here)), tmp_path)
        assert done.returncode == 0, f"{block.text}\n{done.stderr}"
        said += done.stdout
    assert all(old in whole for old in changes)
    made = ["mine/office.h5", "mine/hall.h5", "mine/lab.h5", "office.png", "office.onnx", "generalist.onnx"]
    assert all((tmp_path / name).exists() for name in made)
    assert re.search(r"^(arrived|not there yet) after \d+ steps$", said, re.MULTILINE)


def prepare_stand_ins(folder: Path) -> None:
    """What the commands take for given: a dump, a floor plan, photographs, a MuJoCo model."""
    (folder / "dumps").mkdir()
    (folder / "hall.txt").write_text("....\n....\n..#.\n")
    (folder / "office").mkdir()
    (folder / "lab").mkdir()
    (folder / "lab/scene.xml").write_text(ROOM)
    build = "clearway scenes build --room bathroom --out room.h5\n"
    export = "clearway scenes export room.h5 --out dumps/dump.h5\n"
    photographs = next(b for b in code_blocks(ROOT / "docs/tutorial.md") if b.language == "python")
    here = Block("python", shortened(photographs.text, {"scenes/bathroom.h5": "room.h5"}))
    for block in (Block("sh", build + export), here):
        done = run_block(block, folder)
        assert done.returncode == 0, done.stderr


def test_the_live_page_is_small_and_that_of_this_version() -> None:
    folder = ROOT / "docs/live"
    assert sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) < 3_000_000
    files = {name: content.decode() for name, (content, _) in page_files().items()}
    remedy = "make it again: clearway view --example --save docs/live"
    assert (folder / "page/page.js").read_text() == bundled(files, "app.js"), remedy
    assert (folder / "page/style.css").read_text() == files["style.css"], remedy
    assert (folder / "index.html").read_text() == files["index.html"].replace(MODULES, SCRIPTS), remedy
