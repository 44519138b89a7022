from pathlib import Path

import pytest

MODEL = """<mujoco><worldbody><geom type="plane" size=".8 .3 1"/><geom type="box" size=".1 .1 .5" pos=".7 0 .5"/>
</worldbody></mujoco>"""  # two cells of 0.5 m, x = -0.5 and 0


@pytest.mark.slow
def test_a_model_becomes_a_scene_that_can_be_inspected(clearway, tmp_path: Path) -> None:
    model = tmp_path / "hall.xml"
    model.write_text(MODEL)
    words = ("scenes", "import", "mjcf", model, "--out", tmp_path / "scenes", "--height", 30, "--width", 40)
    answer = clearway(*words, "--encoder", "random-resnet50", "--spawn", -0.5, 0)
    assert answer.code == 0, answer
    found = clearway("scenes", "inspect", tmp_path / "scenes" / "hall.h5", "--json").json
    assert (found["states"], found["cells"], found["headings"]) == (8, 2, 4)
    assert found["source"] == "mjcf"


def test_a_model_with_a_missing_mesh_is_one_line_and_nothing_is_written(clearway, tmp_path: Path) -> None:
    model = tmp_path / "hall.xml"
    model.write_text('<mujoco><asset><mesh file="gone.stl"/></asset></mujoco>')
    answer = clearway("scenes", "import", "mjcf", model, "--out", tmp_path / "scenes")
    assert answer.refusal("hall.xml", "names 'gone.stl', which is not there")
    assert [path.name for path in tmp_path.iterdir()] == ["hall.xml"]
