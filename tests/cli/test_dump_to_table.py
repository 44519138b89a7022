"""A dump written by other code goes through every command."""

import json
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from clearway.errors import ClearwayError
from clearway.evaluation import single
from clearway.scenes.scene import encoder_names
from clearway.scenes.targets import default_targets
from clearway.scenes.thor_v1 import read_scene, write_scene

TARGET_KEYS = {"scene", "target", "steps", "collisions", "success", "sc", "spl", "shortest_path_steps"}


@pytest.fixture(scope="module")
def evaluated(clearway, trained):
    """The answer to `evaluate --json`, and the run."""
    return clearway("evaluate", trained.run, "--episodes", 4, "--step-limit", 300, "--json"), trained.run


@pytest.mark.parametrize(("feature_axis", "unreachable"), [(10, -1), (1, 1000)])
def test_a_dump_is_imported_as_it_is(clearway, dump, tmp_path, feature_axis, unreachable):
    source = dump(tmp_path / "kitchen_02.h5", feature_axis=feature_axis, unreachable=unreachable)
    answer = clearway("scenes", "import", "thor-v1", source, "--out", tmp_path / "scenes")
    assert (answer.code, answer.out) == (0, "")
    assert answer.err == f"{tmp_path / 'scenes' / 'kitchen_02.h5'}: 76 states, 19 cells of 0.5 m, 5 x 5 m\n"
    original, imported = read_scene(source), read_scene(tmp_path / "scenes" / "kitchen_02.h5")
    assert np.array_equal(original.graph, imported.graph)
    assert np.array_equal(original.features, imported.features)
    assert np.array_equal(original.observations[:], imported.observations[:])


def shown(text: str) -> str:
    return text.replace("\x1b", r"\x1b").replace("\x07", r"\x07")


@pytest.mark.parametrize("name", ["[/x]", "[red]kept[/red]", "\x1b[31mred\x1b]0;owned\x07"])
def test_names_in_files_and_folders_are_shown_as_they_are(clearway, dump, tmp_path, name):
    scene = read_scene(dump(tmp_path / "kitchen_02.h5"))
    write_scene(replace(scene, encoder=replace(scene.encoder, name=name)), tmp_path / "named.h5")
    answer = clearway("scenes", "inspect", tmp_path / "named.h5")
    assert answer.code == 0, answer
    assert shown(name) in answer.out
    assert "\x1b" not in answer.out and "\x07" not in answer.out
    assert encoder_names([read_scene(tmp_path / "named.h5")]) == shown(name)
    folder = tmp_path / f"sc{name.replace('/', '')}"
    answer = clearway("scenes", "import", "thor-v1", tmp_path / "kitchen_02.h5", "--out", folder)
    assert answer.err == f"{shown(str(folder / 'kitchen_02.h5'))}: 76 states, 19 cells of 0.5 m, 5 x 5 m\n"
    answer = clearway("oracle", (tmp_path / "named.h5").rename(tmp_path / "n[b].h5"), "--targets", 1)
    assert "n[b]" in answer.out


def test_an_archive_of_dumps_is_imported_and_a_scene_exported_again(clearway, dump, tmp_path):
    source = dump(tmp_path / "kitchen_02.h5")
    with zipfile.ZipFile(tmp_path / "dumps.zip", "w") as archive:
        archive.write(source, "thor/kitchen_02.h5")
    assert clearway("scenes", "import", "thor-v1", tmp_path / "dumps.zip", "--out", tmp_path / "scenes").code == 0
    imported = tmp_path / "scenes" / "kitchen_02.h5"
    assert clearway("scenes", "export", imported, "--out", tmp_path / "again.h5").code == 0
    original, again = read_scene(source), read_scene(tmp_path / "again.h5")
    assert np.array_equal(original.graph, again.graph)
    assert np.array_equal(original.observations[:], again.observations[:])
    assert clearway("scenes", "export", imported, "--out", imported).refusal("kitchen_02.h5", "over the scene itself")


def test_inspect_prints_the_figures_of_the_room(clearway, trained, tmp_path):
    answer = clearway("scenes", "inspect", trained.scene, "--json", "--map", tmp_path / "map.png")
    content = answer.json
    assert (answer.code, answer.err) == (0, "")
    assert (content["states"], content["cells"], content["components"]) == (76, 19, 2)
    assert content["component_sizes"] == [72, 4]
    assert content["encoder"] == "from file (24 features)"
    # 6 x 3 cells: along x the ends are blocked, along z the outer rows; and all of the cell out of reach
    assert content["zones"] == {"free": 12, "precollision": 24, "collision": 40}
    assert content["source"] == "thor_v1"
    with Image.open(tmp_path / "map.png") as picture:
        assert picture.format == "PNG" and picture.width > 300


def test_inspect_without_json_says_the_same(clearway, trained):
    answer = clearway("scenes", "inspect", trained.scene)
    assert answer.code == 0
    assert "None" not in answer.out
    rows = dict(line.split("  ", 1) for line in answer.out.splitlines())
    assert rows["states"].strip() == "76"
    assert rows["zones"].strip() == "free 12, precollision 24, collision 40"


def test_the_run_keeps_what_the_command_line_asked_for(trained):
    record = json.loads((trained.run / "run.json").read_text())
    assert (record["reward"]["alpha"], record["reward"]["gamma"], record["reward"]["beta"]) == (-0.02, -0.015, -0.02)
    learner = record["learner"]
    assert (learner["envs"], learner["width"], learner["clip_rewards"], learner["frames"]) == (20, 16, True, 640)
    (scene,) = record["scenes"]
    assert tuple(scene["targets"]) == default_targets(read_scene(trained.scene))  # nobody named any
    assert Path(scene["path"]) == trained.scene.resolve()


def test_evaluate_prints_the_agreed_json(evaluated, trained):
    answer, run = evaluated
    content = answer.json
    assert (answer.code, answer.err) == (0, "")
    assert {"targets", "scenes", "average"} <= content.keys()
    assert [(row["scene"], row["target"]) for row in content["targets"]] == [
        ("bathroom_02", target) for target in default_targets(read_scene(trained.scene))
    ]
    for row in content["targets"]:
        assert row.keys() >= TARGET_KEYS
        assert all(0 <= row[share] <= 1 for share in ("success", "sc", "spl"))
        assert 1 <= row["shortest_path_steps"] <= row["steps"] <= 300
    assert [scene["scene"] for scene in content["scenes"]] == ["bathroom_02"]
    assert content["average"]["steps"] == pytest.approx(np.mean([row["steps"] for row in content["targets"]]))
    assert (content["agent"], content["action_selection"]) == ("collision-aware, alpha -0.02, gamma -0.015", "sampled")
    assert content["encoder"] == "from file (24 features)"
    assert json.loads((run / "evaluation.json").read_text()) == content
    assert "| shortest path | 5/5 |" in (run / "evaluation.md").read_text()


def test_the_other_agents_stand_beside(evaluated):
    others = {other["agent"]: other for other in evaluated[0].json["others"]}
    assert {"random", "shortest path"} <= others.keys()
    assert all(row["steps"] == row["shortest_path_steps"] for row in others["shortest path"]["targets"])
    assert others["random"]["average"]["collisions"] > others["shortest path"]["average"]["collisions"] == 0


@pytest.mark.slow
def test_evaluate_prints_tables_and_draws(clearway, trained, tmp_path):
    words = ("--episodes", 2, "--step-limit", 40, "--targets", "--pictures", tmp_path / "pictures")
    answer = clearway("evaluate", trained.run, *words)
    assert answer.code == 0
    assert answer.err == f"pictures: {tmp_path / 'pictures'}\n"
    for part in ("collision-aware", "shortest path", "random", "Encoder: from file (24 features).", "bathroom_02"):
        assert part in answer.out
    names = sorted(path.name for path in (tmp_path / "pictures").iterdir())
    assert names == ["curves.png", "episode-bathroom_02.png", "map-bathroom_02.png"]


def test_scenes_may_have_moved(clearway, trained, dump, tmp_path):
    moved = dump(tmp_path / "moved" / "bathroom_02.h5")
    words = ("evaluate", trained.run, "--episodes", 1, "--step-limit", 5, "--json", "--scenes")
    assert clearway(*words, moved.parent).code == 0
    assert clearway(*words, dump(tmp_path / "renamed" / "attic.h5")).code == 0
    other = dump(tmp_path / "other" / "attic.h5", feature_axis=9)
    assert clearway(*words, other).refusal("bathroom_02", "attic", "--scenes")


def test_a_run_goes_on_only_when_asked_to(clearway, trained, small):
    words = ("train", trained.scene, "--out", trained.run, "--alpha", "-0.02", "--gamma", "-1.5e-2", *small)
    assert clearway(*words).refusal(str(trained.run), "holds a run already", "--resume")
    assert clearway(*words, "--resume").code == 0
    assert clearway(*words, "--resume", "--seed", 7).refusal("another experiment")


@pytest.mark.parametrize(("solved", "rows"), [(0, " --targets"), (5, "")])
def test_training_ends_with_the_number_of_solved_targets(clearway, trained, small, tmp_path, solved, rows):
    run = tmp_path / "run"
    words = ("train", trained.scene, "--out", run, "--resume", *small)
    begun = clearway(*words)
    assert begun.code == 0 and f"{run}: no run to resume is here; a new one is begun\n" in begun.err
    metrics = run / "metrics.jsonl"
    metrics.write_text(metrics.read_text().replace('"solved_targets": 0', f'"solved_targets": {solved}'))
    lines = clearway(*words).err.splitlines()
    assert not [line for line in lines if "no run to resume is here" in line]
    short = " in its last episodes, of at most 40 steps each" if rows else ""
    told = f"{run}: trained, {solved} of 5 targets solved{short}. Next: clearway evaluate {run}{rows}"
    assert lines[-2 if rows else -1] == told
    metrics.unlink()
    assert clearway(*words).err.endswith(f"{run}: trained. Next: clearway evaluate {run}\n")


def test_several_scenes_with_targets_each(clearway, dump, tmp_path, small):
    for name in ("one", "two"):
        dump(tmp_path / "scenes" / f"{name}.h5")
    chosen = ("--reward", "shortest", "--feature-basis", 8)
    words = ("train", tmp_path / "scenes", "--out", tmp_path / "run", *small, *chosen)
    assert clearway(*words, "--targets", "one=0,5", "two=7").code == 0
    record = json.loads((tmp_path / "run" / "run.json").read_text())
    assert record["learner"]["feature_basis"] == 8
    assert {scene["name"]: scene["targets"] for scene in record["scenes"]} == {"one": [0, 5], "two": [7]}
    assert record["reward"]["name"] == "shortest"


@pytest.mark.slow
def test_another_seed_walks_other_episodes(clearway, trained):
    words = ("evaluate", trained.run, "--episodes", 3, "--step-limit", 100, "--json")
    first, again, other = (clearway(*words, "--seed", seed).json for seed in (0, 0, 1))
    assert first == again
    assert first["targets"] != other["targets"] and other["seed"] == 1


def test_training_takes_the_zones_that_are_asked_for(clearway, trained, small, tmp_path):
    assert clearway("train", trained.scene, "--out", tmp_path / "run", "--zones", "cell", *small).code == 0
    levels = [json.loads((run / "run.json").read_text())["zone_level"] for run in (trained.run, tmp_path / "run")]
    assert levels == ["pose", "cell"]


@pytest.mark.parametrize("selection", ["sampled", "argmax", "argmax-untried"])
def test_a_film_shows_actions_as_they_are_asked_for(clearway, trained, tmp_path, monkeypatch, selection):
    asked = {}

    def noted(*_, **settings):
        asked.update(settings)
        raise ClearwayError("enough")

    monkeypatch.setattr(single, "single_episode", noted)
    out = tmp_path / "film.gif"
    assert clearway("video", trained.run, "--out", out, "--selection", selection, "--seed", 7).refusal("enough")
    assert (asked["selection"], asked["seed"]) == (selection, 7)
