"""Parts of a scene that are of another kind than they have to be."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

import clearway
from clearway.errors import SceneError
from clearway.scenes.parts import check_parts
from clearway.scenes.scene import EncoderRecord, Provenance, TopView
from clearway.scenes.sensors import Readings
from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.made import corridor_scene, grid_scene, with_depth

SCENE = grid_scene(1, width=4, depth=3, picture_size=(10, 10), feature_count=8)
(DEPTH,) = with_depth(SCENE).further
NO_NAME = "expected a short text without slashes"


def with_arrays(**arrays: object) -> EncoderRecord:
    return EncoderRecord("mine", "1", arrays=arrays)


def of_sensor(**changes: object) -> tuple[Readings]:
    return (replace(DEPTH, sensor=replace(DEPTH.sensor, **changes)),)


WRONG = {
    "graph": [(SCENE.graph.tolist(), "graph is of type list"), (SCENE.graph.astype(object), "an array of object")],
    "locations_m": [(SCENE.locations_m.tolist(), "locations_m is of type list, expected a NumPy array")],
    "headings_deg": [(None, "headings_deg is None")],
    "observations": [
        (SCENE.observations.tolist(), "observations is of type list"),
        (SCENE.observations / 255, r"an array of float64, expected a NumPy array \(S, height, width, 3\) uint8"),
    ],
    "features": [
        (np.asarray(SCENE.features).tolist(), "features is of type list"),
        (np.float32(3), r"features is np.float32\(3.0\), expected a NumPy array \(S, F\)"),
    ],
    "cell_size_m": [
        ("0.5", "cell_size_m is '0.5', expected a number"),
        (True, "cell_size_m is True"),
        (Fraction(1, 2), r"cell_size_m is Fraction\(1, 2\), expected a number, int or float"),
    ],
    "made_by": [
        ({"source": "x"}, "made_by is of type dict, expected a Provenance"),
        (Provenance(3), "made_by.source is 3, expected a text"),
        (Provenance("x", seed="1"), "made_by.seed is '1'"),
        (Provenance("x", notes=["a"]), "made_by.notes is of type list, expected a dict"),
    ],
    "encoder": [
        ("mine", "encoder is 'mine', expected an EncoderRecord"),
        (EncoderRecord("mine", 1), "encoder.identity is 1, expected a text"),
        (EncoderRecord("mine", "1", arrays=[np.zeros(2)]), "encoder.arrays is of type list, expected a dict of NumPy"),
        (with_arrays(a=[1]), r"encoder.arrays\['a'\] is of type list, expected a NumPy array of numbers"),
        (with_arrays(a=np.array(["a", "b"])), r"encoder.arrays\['a'\] is an array of <U1, expected .* numbers"),
        (with_arrays(a=np.array([1, None])), r"encoder.arrays\['a'\] is an array of object"),
        (with_arrays(a=np.zeros(2, complex)), r"encoder.arrays\['a'\] is an array of complex128"),
        (with_arrays(a=np.zeros(2), **{"a/b": np.zeros(2)}), f"a name in encoder.arrays is 'a/b', {NO_NAME}"),
        (with_arrays(**{".": np.zeros(2)}), f"a name in encoder.arrays is '.', {NO_NAME}"),
        (with_arrays(**{"": np.zeros(2)}), f"a name in encoder.arrays is '', {NO_NAME}"),
        (EncoderRecord("mine", "1", arrays={1: np.zeros(2)}), f"a name in encoder.arrays is 1, {NO_NAME}"),
    ],
    "top_view": [
        ("above.png", "top_view is 'above.png'"),
        (TopView(np.zeros((2, 2, 3), np.uint8), 0, 1, 0, "1"), "top_view's extent"),
        (TopView(np.zeros((2, 2, 3), np.uint8), 0, 1, 0, Fraction(1)), "top_view's extent"),
    ],
    "further": [
        (["depth"], "further is of type list, expected a tuple of Readings"),
        ((Readings(None, DEPTH.raw),), "further: a sensor is None, expected a Sensor"),
        ((Readings(DEPTH.sensor, [[1]]),), r"further: depth's raw is of type list, expected an array \(S, ...\)"),
        (of_sensor(name=3), "further: a sensor's name is 3, expected a text"),
        (of_sensor(dtype=np.float32), "further: a sensor's dtype is of type type, expected a text"),
        (of_sensor(unit=None), "further: a sensor's unit is None, expected a text"),
        (of_sensor(low="0"), "further: depth's low is '0', expected a number"),
        (of_sensor(shape=10), "further: depth's shape is 10, expected a tuple"),
    ],
    "name": [(name, "cannot be a scene's name") for name in (7, None, "", ".", "..", "a/b", "a\\b", "a\nb", "a" * 201)],
}


def test_sound_parts_pass(tmp_path: Path) -> None:
    made_by = Provenance("x", versions=MappingProxyType({"a": "1"}), notes=MappingProxyType({"b": [2]}))
    arrays = {"flags": np.zeros(2, bool), "half": np.zeros((2, 2), np.float16), "none": np.zeros(0)}
    others = replace(SCENE, made_by=made_by, encoder=with_arrays(**arrays), cell_size_m=np.float32(0.5))
    nameless = replace(SCENE, name="Küche 1.5", features=None, encoder=None)
    for number, scene in enumerate((SCENE, nameless, others, with_depth(SCENE))):
        check_parts(scene, "some.h5")
        write_scene(scene, tmp_path / f"{number}.h5")
        assert np.array_equal(read_scene(tmp_path / f"{number}.h5").graph, scene.graph)


@pytest.mark.parametrize("part", WRONG)
def test_a_part_of_another_kind_is_named_and_no_folder_is_made(part: str, tmp_path: Path) -> None:
    for value, problem in WRONG[part]:
        with pytest.raises(SceneError, match=problem) as caught:
            write_scene(replace(SCENE, **{part: value}), tmp_path / "out" / "some.h5")
        assert "some.h5: " in str(caught.value) and "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"made_by": Provenance("x", notes={"a": np.zeros(3)})}, "made_by.notes is no JSON"),
        ({"made_by": Provenance("x", versions={"a": object()})}, "made_by.versions is no JSON"),
        ({"encoder": EncoderRecord("mine", "1", {"a": {1}})}, "encoder.settings is no JSON"),
    ],
)
def test_what_no_file_can_keep_is_refused_before_a_folder_is_made(changes: dict, problem: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=problem):
        write_scene(replace(SCENE, **changes), tmp_path / "out" / "some.h5")
    assert not (tmp_path / "out").exists()


def test_a_file_or_a_training_whose_scene_has_no_name_for_files_is_refused(tmp_path: Path) -> None:
    write_scene(SCENE, tmp_path / "some.h5")
    with pytest.raises(SceneError, match=r"\.\.\.h5: '\.\.' cannot be a scene's name"):
        read_scene((tmp_path / "some.h5").rename(tmp_path / "...h5"))
    with pytest.raises(SceneError, match=r"scenes: '\.\.' cannot be a scene's name"):
        clearway.train(replace(corridor_scene(), name=".."), frames=80, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()
