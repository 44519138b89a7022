"""The example that comes along, and a small one made the same way."""

import json
import shutil
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from clearway.errors import ClearwayError, RunError
from clearway.evaluation.runs import evaluate_runs
from clearway.examples import make, shipped
from clearway.examples.shipped import CARD_FILE, MOST_BYTES, SHIPPED, load_example, read_card
from clearway.examples.stage import example_stage
from clearway.learn.presets import PAPER_A2C
from clearway.perception.eyes import SHIPPED as EYES
from clearway.view.viewing import Viewing
from helpers.made import grid_scene
from helpers.small_runs import FEATURES, small_learner

MOST_WEIGHTS = 20 * 1000**2  # of all that the package holds


def size(paths: list[Path]) -> int:
    return sum(path.stat().st_size for path in paths if path.is_file())


def test_what_comes_along_is_small_and_holds_no_pickle() -> None:
    files = [path for path in SHIPPED.rglob("*") if path.is_file()]
    assert 0 < size(files) <= MOST_BYTES
    assert {path.suffix for path in files} == {".json", ".jsonl", ".h5", ".safetensors"}
    weights = list(SHIPPED.parents[1].rglob("*.safetensors"))
    assert EYES / "eyes.safetensors" in weights
    assert size(weights) <= MOST_WEIGHTS
    assert set(read_card()["sha256"]) == {str(path.relative_to(SHIPPED)) for path in files} - {CARD_FILE}


def test_the_shipped_agents_walk_in_their_scene_from_the_episode_that_shows_the_difference() -> None:
    stage, episode = example_stage()
    assert [agent.name for agent in stage.agents] == ["shortest", "collision-aware"]
    (scene,) = stage.scenes
    assert scene.observations is not None and scene.observations.shape == (180, 300, 400, 3)
    session = Viewing(stage)
    begun = session.answer({"do": "begin", "episode": episode})
    assert begun["kind"] == "episode", begun
    for walker in session.walkers:
        while walker.step() is not None:
            pass
    first, last = (walker.steps[-1] for walker in session.walkers)
    assert first.reached and last.reached
    assert first.collisions > last.collisions == 0


def test_the_card_says_how_it_was_made_without_a_place_on_some_machine() -> None:
    card = read_card()
    assert [command.split()[1] for command in card["made_by"]] == ["scenes", "train", "train", "examples"]
    bumps = [card["agents"][name]["collisions"] for name in ("shortest", "collision-aware")]
    assert bumps[0][1] > bumps[1][2]  # the intervals are apart
    texts = [path.read_text() for path in SHIPPED.rglob("*.json")]
    assert not [text for text in texts if "/work" in text or "/tmp" in text or "/home" in text]


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An example of an instant."""
    folder = tmp_path_factory.mktemp("examples") / "small"
    with pytest.MonkeyPatch.context() as patch:

        def encode(scenes, encoder, *, progress):
            made = [grid_scene(2, width=4, depth=3, feature_count=FEATURES, name=scene.name) for scene in scenes]
            return [make.replace(one, observations=scene.observations) for one, scene in zip(made, scenes, strict=True)]

        patch.setattr(make, "encode_scenes", encode)
        patch.setattr(make, "SOUGHT", 3)
        patch.setattr(make, "evaluate_runs", partial(evaluate_runs, episodes_per_target=5, step_limit=60))
        scene = grid_scene(2, width=4, depth=3, feature_count=FEATURES, name="small")
        make.make_example(make.Recipe(scene, small_learner(frames=160)), folder)
    return folder


def test_an_example_is_made_and_read_again(small: Path) -> None:
    example = load_example(small)
    assert list(example.runs) == ["shortest", "collision-aware"]
    scene = grid_scene(2, width=4, depth=3, feature_count=FEATURES, name="small")
    assert example.scene.name == "small"
    np.testing.assert_array_equal(example.scene.graph, scene.graph)
    assert example.scene.observations is not None and scene.observations is not None
    assert np.abs(example.scene.observations.astype(int) - scene.observations).mean() < 20  # JPEG of a made-up picture
    stage, _ = example_stage(small)
    assert Viewing(stage).answer({"do": "begin", "episode": ""})["kind"] == "episode"
    assert [path.name for path in small.parent.iterdir()] == ["small"]


def test_the_recipe_is_of_the_published_settings() -> None:
    changed = {name for name, value in vars(make.LEARNER).items() if value != getattr(PAPER_A2C, name)}
    assert changed == {"frames", "width", "feature_basis"}


@pytest.mark.parametrize("name", ["scene.h5", "pictures.h5", "runs/shortest/run.json"])
def test_an_altered_or_missing_file_is_told_in_one_line(small: Path, tmp_path: Path, name: str) -> None:
    folder = tmp_path / "altered"
    shutil.copytree(small, folder)
    content = bytearray((folder / name).read_bytes())
    content[len(content) // 2] ^= 1
    (folder / name).write_bytes(content)
    with pytest.raises(RunError, match=f"{name}: was altered.*Install clearway again"):
        load_example(folder)
    (folder / name).unlink()
    with pytest.raises(RunError, match=f"{name}: is missing"):
        load_example(folder)


@pytest.mark.parametrize("change", [{"format_version": 9}, {"episode": 3}, {"sha256": None}, {"agents": []}])
def test_a_card_that_cannot_be_read_is_told_in_one_line(small: Path, tmp_path: Path, change: dict) -> None:
    (tmp_path / CARD_FILE).write_text(json.dumps({**json.loads((small / CARD_FILE).read_text()), **change}))
    with pytest.raises(RunError, match=r"card\.json: cannot be read"):
        read_card(tmp_path)
    (tmp_path / CARD_FILE).write_text("{")
    with pytest.raises(RunError, match=r"card\.json: cannot be read"):
        read_card(tmp_path)


def test_a_folder_that_holds_something_is_left_alone(small: Path) -> None:
    before = sorted(small.rglob("*"))
    with pytest.raises(ClearwayError, match="no empty folder"):
        make.make_example(make.Recipe(grid_scene(1)), small)
    assert sorted(small.rglob("*")) == before


def test_pictures_are_kept_one_behind_the_other(tmp_path: Path) -> None:
    pictures = np.zeros((3, 8, 8, 3), np.uint8) + np.array([10, 120, 240], np.uint8)[:, None, None, None]
    shipped.write_pictures(tmp_path / "p.h5", [make.jpeg(one, 95) for one in pictures])
    np.testing.assert_allclose(shipped._pictures(tmp_path / "p.h5", 3), pictures, atol=2)
