import json
from pathlib import Path

import h5py
import numpy as np


def made_folder(folder: Path) -> Path:
    """Two locations half a metre apart and one between them."""
    folder.mkdir()
    keys = [f"0.00|{0.25 * z:0.2f}|{heading}|0" for z in range(3) for heading in (0, 90, 180, 270)]
    ahead = [{"source": keys[4 * z], "target": keys[4 * z + 4]} for z in range(2)]
    (folder / "graph.json").write_text(json.dumps({"nodes": [{"id": key} for key in keys], "links": ahead}))
    with h5py.File(folder / "resnet50_fc.hdf5", "w") as file:
        for index, key in enumerate(keys):
            file[key] = np.eye(12, dtype=np.float32)[index]
    return folder


def test_a_folder_becomes_a_scene_that_can_be_inspected(clearway, tmp_path: Path) -> None:
    folder = made_folder(tmp_path / "FloorPlan9_physics")
    answer = clearway("scenes", "import", "savn", folder, "--out", tmp_path / "scenes")
    assert answer.code == 0, answer
    found = clearway("scenes", "inspect", tmp_path / "scenes" / "FloorPlan9_physics.h5", "--json").json
    assert (found["states"], found["cells"], found["source"]) == (8, 2, "savn")
    assert found["blocked_share"] == (16 - 2) / 16  # one move forward, and one backward by the agent that looks away


def test_a_folder_of_something_else_is_refused(clearway, tmp_path: Path) -> None:
    answer = clearway("scenes", "import", "savn", tmp_path, "--out", tmp_path / "scenes")
    assert answer.refusal("graph.json", "no such file")


def test_two_scenes_of_one_name_are_refused_before_anything_is_written(clearway, tmp_path: Path) -> None:
    for part in ("train", "test"):
        (tmp_path / part).mkdir()
        made_folder(tmp_path / part / "FloorPlan9")
    folders = [tmp_path / part / "FloorPlan9" for part in ("train", "test")]
    answer = clearway("scenes", "import", "savn", *folders, "--out", tmp_path / "scenes")
    assert answer.refusal("FloorPlan9", "has this name", "one by one")
    assert not (tmp_path / "scenes").exists()
