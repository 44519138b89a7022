"""MuJoCo models that are broken or meant to do harm end in one line; sound ones come out with the agent's body."""

import os
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.importers import mjcf_compile
from clearway.importers.mjcf_compile import compiled
from clearway.rooms.obstacles import AgentShape, body_geoms

URDF = """<robot name="hut"><link name="base">
<collision><geometry><box size="1 1 1"/></geometry></collision></link></robot>"""
AGENT = AgentShape(radius_m=0.3, height_m=1.0, step_m=0.4)


def written(folder: Path, words: str, name: str = "world.xml") -> Path:
    path = folder / name
    path.write_text(f"<mujoco>{words}</mujoco>")
    return path


def test_meshes_and_included_files_are_found_and_the_models_defaults_leave_the_body_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "assets").mkdir()
    (tmp_path / "assets" / "spike.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    )
    written(tmp_path, '<worldbody><geom name="included" size="1"/></worldbody>', "more.xml")
    written(
        tmp_path,
        '<compiler meshdir="assets"/><asset><mesh file="spike.obj"/></asset><include file="more.xml"/>'
        '<default><geom fromto="0 0 0 1 0 0" type="box" size="1 1 1" rgba="1 0 0 1" group="1" contype="1"/></default>'
        '<worldbody><geom type="mesh" mesh="spike" fromto="nan nan nan nan nan nan"/></worldbody>',
    )
    monkeypatch.chdir(tmp_path)
    model = compiled(Path("world.xml"), AGENT)
    assert sorted(os.listdir(tmp_path)) == ["assets", "more.xml", "world.xml"]
    assert model.nmesh == 1 and model.ngeom == 5
    body = body_geoms(model)
    np.testing.assert_allclose(model.geom_size[body], [[0.3, 0.2, 0], [0.2, 0.3, 0.5], [0.3, 0.2, 0.5]])
    assert (model.geom_rgba[body] == 0).all() and (model.geom_contype[body] == 0).all()
    assert model.geom_type[body].tolist() == [
        mujoco.mjtGeom.mjGEOM_CAPSULE,
        mujoco.mjtGeom.mjGEOM_BOX,
        mujoco.mjtGeom.mjGEOM_BOX,
    ]


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        pytest.param("<worldbody>", "XML", id="no XML", marks=pytest.mark.slow),
        pytest.param('<asset><mesh file="gone.stl"/></asset>', r"gone\.stl", id="missing mesh"),
        pytest.param(
            '<extension><plugin plugin="their.own"/></extension>',
            "plugin their.own not found",
            id="plugin",
            marks=pytest.mark.slow,
        ),
        pytest.param('<include file="world.xml"/>', "world.xml", id="includes itself", marks=pytest.mark.slow),
        pytest.param('<size memory="1T"/>', "memory", id="huge data"),
    ],
)
def test_what_mujoco_says_becomes_one_line(tmp_path: Path, words: str, problem: str) -> None:
    with pytest.raises(SceneError, match=rf"world\.xml: MuJoCo cannot use it \(.*{problem}.*\)\. ") as caught:
        compiled(written(tmp_path, words), AGENT)
    assert "\n" not in str(caught.value)


def test_no_such_file_is_said(tmp_path: Path) -> None:
    for path in (tmp_path / "none.xml", tmp_path):
        with pytest.raises(SceneError, match="there is no such file"):
            compiled(path, AGENT)


@pytest.mark.skipif(sys.platform != "linux", reason="memory is bounded on Linux")
def test_a_model_that_asks_for_all_memory_gets_no_more_than_the_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mjcf_compile, "MEMORY_LIMIT_BYTES", 1 << 30)
    bomb = '<asset><texture name="t" type="2d" builtin="flat" width="20000" height="20000"/></asset>'  # 1.2 GB
    with pytest.raises(SceneError, match=r"MuJoCo cannot use it .*memory"):
        compiled(written(tmp_path, bomb), AGENT)


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_model_that_takes_too_long_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mjcf_compile, "TIME_LIMIT_S", 3)
    os.mkfifo(tmp_path / "silent.stl")
    with pytest.raises(SceneError, match="took more than 3 s"):
        compiled(written(tmp_path, '<asset><mesh file="silent.stl"/></asset>'), AGENT)


def test_a_process_that_dies_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mjcf_compile, "COMMAND", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)  # {path}")
    with pytest.raises(SceneError, match=r"MuJoCo ended with signal SIGSEGV .*8 GiB"):
        compiled(written(tmp_path, ""), AGENT)


def test_the_body_stays_where_a_model_discards_what_is_only_seen(tmp_path: Path) -> None:
    world = '<compiler discardvisual="true"/><worldbody><geom type="plane" size="2 2 .1"/></worldbody>'
    model = compiled(written(tmp_path, world), AGENT)
    assert len(body_geoms(model)) == 3
    (tmp_path / "hut.urdf").write_text(URDF)
    assert len(body_geoms(compiled(tmp_path / "hut.urdf", AGENT))) == 3
