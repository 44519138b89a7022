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
from clearway.importers.mjcf_files import ModelFiles, files_of_model
from clearway.rooms.obstacles import AgentShape, body_geoms

URDF = """<robot name="hut"><link name="base">
<collision><geometry><box size="1 1 1"/></geometry></collision></link></robot>"""
SPIKE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
AGENT = AgentShape(radius_m=0.3, height_m=1.0, step_m=0.4)


def written(folder: Path, words: str, name: str = "world.xml") -> Path:
    path = folder / name
    path.write_text(f"<mujoco>{words}</mujoco>")
    return path


def test_meshes_and_included_files_are_found_and_the_models_defaults_leave_the_body_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "assets").mkdir()
    (tmp_path / "assets" / "spike.obj").write_text(SPIKE)
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
        pytest.param('<worldbody><geom size="none"/></worldbody>', "size", id="no number"),
        pytest.param(
            '<extension><plugin plugin="their.own"/></extension>',
            "plugin their.own not found",
            id="plugin",
            marks=pytest.mark.slow,
        ),
        pytest.param('<include file="world.xml"/>', "world.xml", id="includes itself", marks=pytest.mark.slow),
        pytest.param("<worldbody>" + "<body>" * 5000 + "</body>" * 5000 + "</worldbody>", "", id="too deep"),
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
def test_a_model_that_takes_too_long_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mjcf_compile, "TIME_LIMIT_S", 1)
    large = '<asset><texture name="t" type="2d" builtin="checker" width="16000" height="16000"/></asset>'
    with pytest.raises(SceneError, match=r"took more than 1 s|SIGALRM"):
        compiled(written(tmp_path, large), AGENT)


@pytest.mark.skipif(sys.platform == "win32", reason="files are shut off by a limit of POSIX")
@pytest.mark.parametrize("place", ["inside", "outside"])
def test_mujoco_itself_opens_no_file(place: str, tmp_path: Path) -> None:
    """Even where a name were overlooked: the file is there and sound, and MuJoCo was not handed it."""
    beside = tmp_path / place
    beside.mkdir()
    (beside / "spike.obj").write_text(SPIKE)
    files = ModelFiles(f'<mujoco><asset><mesh file="{beside / "spike.obj"}"/></asset></mujoco>'.encode())
    with pytest.raises(SceneError, match="MuJoCo cannot use it"):
        compiled(tmp_path / "world.xml", AGENT, files)


def test_files_of_the_same_name_and_of_attached_models_are_each_found(tmp_path: Path) -> None:
    for folder, size in (("a", "1"), ("b", "5")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "spike.obj").write_text(SPIKE.replace("1 0 0", f"{size} 0 0"))
    body = '<worldbody><body name="b"><geom type="mesh" mesh="spike"/></body></worldbody>'
    written(tmp_path / "b", f'<asset><mesh file="spike.obj"/></asset>{body}', "child.xml")
    words = (
        '<asset><mesh file="./a/spike.obj"/><model name="child" file="b\\child.xml"/></asset>'
        '<worldbody><geom type="mesh" mesh="spike"/>'
        '<frame><attach model="child" body="b" prefix="p"/></frame></worldbody>'
    )
    model = compiled(written(tmp_path, words), AGENT)
    assert model.mesh_vertnum.tolist() == [4, 4]
    near, far = model.mesh_vert[:4], model.mesh_vert[4:]
    assert np.ptp(near, axis=0).max() < 2 < np.ptp(far, axis=0).max()


def test_files_outside_a_model_s_folder_take_trust(tmp_path: Path) -> None:
    (tmp_path / "home").mkdir()
    written(tmp_path, '<worldbody><geom name="included" size="1"/></worldbody>', "more.xml")
    path = written(tmp_path / "home", '<include file="../more.xml"/>')
    with pytest.raises(SceneError, match=r"names '\.\./more\.xml', which lies outside its folder\. .*--trust"):
        compiled(path, AGENT)
    assert compiled(path, AGENT, files_of_model(path, trust=True)).ngeom == 4


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
