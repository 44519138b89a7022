from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.scenes.scene import Scene
from clearway.scenes.sensors import Readings, Sensor, depth, rgb
from clearway.scenes.thor_v1 import read_scene, write_scene
from clearway.scenes.validate import check_scene
from helpers.made import corridor_scene, with_depth

TOUCH = Sensor("touch", (4,), "float32", "N", -1.0, 5.0)


def test_depth_is_kept_in_millimetres_up_to_its_far_limit() -> None:
    sensor = depth(1, 4)
    kept = sensor.kept(np.array([[0.1234, 7.0006, 19.9999, np.inf]], np.float32))
    assert kept.dtype == np.uint16 and kept.tolist() == [[123, 7001, 20000, 20000]]
    values = sensor.values(kept)
    assert values.dtype == np.float32 and values.tolist() == [[np.float32(0.123), np.float32(7.001), 20.0, 20.0]]


def test_colour_is_kept_as_it_is() -> None:
    picture = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    assert rgb(2, 4).kept(picture) is picture and rgb(2, 4).values(picture) is picture


def test_a_scene_names_what_it_lacks() -> None:
    assert np.array_equal(corridor_scene(2).seen_by("rgb")[:], corridor_scene(2).observations)
    with pytest.raises(SceneError, match=r"corridor: has rgb, but no depth\. Build or import it again with --sensors"):
        corridor_scene(2).seen_by("depth")


def test_files_keep_depth_to_the_bit(tmp_path: Path) -> None:
    scene, path = with_depth(corridor_scene(3)), tmp_path / "corridor.h5"
    write_scene(scene, path)
    again = read_scene(path)
    assert again.sensors == scene.sensors
    made, kept = scene.seen_by("depth")[:], again.seen_by("depth")
    assert made.dtype == np.float32 and 0 < made.min() < made.max() < 8
    for index in (slice(None), 3, np.array([[4, 1], [1, 0]]), np.array([], int)):
        assert kept[index].dtype == np.float32
        np.testing.assert_array_equal(kept[index], made[index])
    np.testing.assert_array_equal(again.observations[:], scene.observations)


def test_files_keep_any_other_sensor(tmp_path: Path) -> None:
    values = np.linspace(-1, 5, 48, dtype=np.float32).reshape(12, 4)
    scene = replace(corridor_scene(3), further=(Readings(TOUCH, values),))
    write_scene(scene, tmp_path / "a.h5")
    again = read_scene(tmp_path / "a.h5")
    assert again.further[0].sensor == TOUCH
    np.testing.assert_array_equal(again.seen_by("touch")[:], values)


def test_a_flipped_bit_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    write_scene(with_depth(corridor_scene(3)), path)
    with h5py.File(path) as file:
        place = file["sensors/depth"].id.get_chunk_info(0).byte_offset
    content = bytearray(path.read_bytes())
    content[place + 20] ^= 4
    path.write_bytes(content)
    with pytest.raises(SceneError, match="dataset 'sensors/depth'"):
        read_scene(path).seen_by("depth")[0]


def rewritten(dtype: str, shape: tuple[int, ...] = (12, 12, 16), fill: float = 9) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        attributes = dict(file["sensors/depth"].attrs)
        del file["sensors/depth"]
        file["sensors/depth"] = np.full(shape, fill, dtype)
        file["sensors/depth"].attrs.update(attributes)

    return change


def attribute(name: str, value: object) -> Callable[[h5py.File], None]:
    return lambda file: file["sensors/depth"].attrs.__setitem__(name, value)


def linked(file: h5py.File) -> None:
    del file["sensors"]
    file["sensors"] = h5py.ExternalLink("other.h5", "/sensors")


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (rewritten("float32"), "expected numbers of kind 'u'"),
        (rewritten("uint8"), "holds uint8, expected uint16"),
        (rewritten("uint16", (11, 12, 16)), "has shape"),
        (rewritten("uint16", (12, 2, 2, 2, 2)), "expected 1 to 3 sides"),
        (attribute("high", np.nan), "attribute 'high' is nan"),
        (attribute("high", -1.0), "has the range 0.0 to -1.0"),
        (attribute("step", 0.0), "has steps of 0.0"),
        (attribute("step", 1e-9), "has steps of 1e-09"),
        (attribute("dtype", "object"), "is of object, expected uint8"),
        (lambda file: file["sensors/depth"].attrs.__delitem__("unit"), "lacks the attribute 'unit'"),
        (lambda file: file.move("sensors/depth", "sensors/rgb"), "is no name of a sensor"),
        (linked, "is not a group"),
    ],
)
def test_a_sensor_that_does_not_fit_is_one_line(tmp_path: Path, change, problem: str) -> None:
    path = tmp_path / "a.h5"
    write_scene(with_depth(corridor_scene(3)), path)
    with h5py.File(path, "r+") as file:
        change(file)
    with pytest.raises(SceneError, match=problem) as error:
        read_scene(path)
    assert str(error.value).startswith(str(path)) and "\n" not in str(error.value)


def test_values_out_of_range_are_refused_when_they_are_read_or_written(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    write_scene(with_depth(corridor_scene(3)), path)
    with h5py.File(path, "r+") as file:
        rewritten("uint16", fill=20_001)(file)
    with pytest.raises(SceneError, match=r"a.h5, dataset 'depth': holds values out of 0 to 20 m"):
        read_scene(path).seen_by("depth")[2]
    broken = Readings(TOUCH, np.full((12, 4), np.nan, np.float32))
    with pytest.raises(SceneError, match="holds values out of -1 to 5 N"):
        write_scene(replace(corridor_scene(3), further=(broken,)), tmp_path / "b.h5")
    assert not (tmp_path / "b.h5").exists()


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda scene: replace(scene, further=scene.further * 2), "stands twice"),
        (lambda scene: replace(scene, further=(replace(scene.further[0], raw=scene.further[0][:]),)), "holds float32"),
        (lambda scene: replace(scene, further=(Readings(rgb(12, 16), scene.observations),)), "is no name of a sensor"),
        (lambda scene: replace(scene, further=(Readings(TOUCH, np.zeros((3, 4), np.float32)),)), "has shape"),
    ],
)
def test_unsound_readings_are_refused(change: Callable[[Scene], Scene], problem: str) -> None:
    check_scene(with_depth(corridor_scene(3)))
    with pytest.raises(SceneError, match=problem):
        check_scene(change(with_depth(corridor_scene(3))))
