"""What is written is read, and what is damaged, cut or lies is refused in one line."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.scenes.thor_v1 import write_scene
from clearway.views import shard as shards
from clearway.views.shard import is_shard, read_shard, room_key, write_shard
from clearway.views.table import COLUMNS, ViewTable
from helpers.made import corridor_scene
from helpers.made_views import SETTINGS, made_views, write_made


def test_what_is_written_is_read(tmp_path: Path) -> None:
    made, path = made_views(), write_made(tmp_path, "one")
    shard = read_shard(path)
    assert is_shard(path) and len(shard) == 20 and shard.takes == 2 and shard.room == "one"
    assert shard.settings == SETTINGS and shard.sensors == SETTINGS.all_sensors
    for field in fields(ViewTable):
        kept, given = getattr(shard.table, field.name), getattr(made.table, field.name)
        assert kept.dtype == given.dtype
        np.testing.assert_array_equal(kept, given)
    np.testing.assert_array_equal(shard.seen("rgb", slice(None)), made.rgb)
    rows = np.array([19, 3, 3])
    np.testing.assert_array_equal(shard.seen("rgb", rows), made.rgb[rows])
    np.testing.assert_array_equal(shard.seen("depth", slice(4, 9)), made.further[0].raw[4:9])


def test_compressed_shards_hold_the_same_in_less(tmp_path: Path) -> None:
    views, scene = made_views(), corridor_scene()
    views.rgb[:] = views.further[0].raw[:] = 7
    plain, small = tmp_path / "plain.h5", tmp_path / "small.h5"
    write_shard(plain, scene, SETTINGS, views)
    write_shard(small, scene, replace(SETTINGS, compress=True), views)
    assert small.stat().st_size < 0.7 * plain.stat().st_size
    for name in ("rgb", "depth"):
        np.testing.assert_array_equal(
            read_shard(small).seen(name, slice(None)), read_shard(plain).seen(name, slice(None))
        )


def test_everything_stands_under_a_checksum(tmp_path: Path) -> None:
    """A bit anywhere in a sound file is noticed, or changes nothing."""
    path = write_made(tmp_path, "one", replace(SETTINGS, poses=2, sensors=("rgb",)))
    content, hurt = path.read_bytes(), tmp_path / "hurt.h5"
    noticed = 0
    whole = everything(path)
    for bit in np.random.default_rng(0).choice(8 * len(content), 150, replace=False).tolist():
        changed = bytearray(content)
        changed[bit // 8] ^= 1 << bit % 8
        hurt.write_bytes(changed)
        try:
            assert everything(hurt) == whole
        except SceneError as error:
            noticed += 1
            assert str(hurt) in str(error) and str(error).isprintable()
    assert noticed > 20


def everything(path: Path) -> tuple:
    shard = read_shard(path)
    seen = tuple(shard.seen(sensor.name, slice(None)).tobytes() for sensor in shard.sensors)
    return shard.room, shard.room_key, shard.settings, shard.table.to_array().tobytes(), seen


def test_a_file_cut_short_is_refused(tmp_path: Path) -> None:
    content = write_made(tmp_path, "one").read_bytes()
    for length in (0, 100, len(content) // 2, len(content) - 1):
        (tmp_path / "cut.h5").write_bytes(content[:length])
        with pytest.raises(SceneError, match=r"cut\.h5"):
            everything(tmp_path / "cut.h5")


def changed(tmp_path: Path, change) -> Path:
    path = write_made(tmp_path, "one")
    with h5py.File(path, "r+") as file:
        change(file)
    return path


def other(name: str, **options):
    def change(file: h5py.File) -> None:
        del file[name]
        file.create_dataset(name, **options)

    return change


def settings_of(**change: object):
    return lambda file: file.attrs.__setitem__("settings", json.dumps({**SETTINGS.to_json(), **change}))


HUGE = 1 << 40
FAULTS = {
    "no views": (lambda file: file.attrs.__delitem__("format"), "holds no views"),
    "newer": (
        lambda file: file.attrs.__setitem__("format_version", 9),
        "has version 9.* reads 2. Take them again",
    ),
    "no version": (lambda file: file.attrs.__delitem__("format_version"), "has version None"),
    "no pictures": (lambda file: file.__delitem__("rgb"), "dataset 'rgb': is missing"),
    "no table": (lambda file: file.__delitem__("table"), "dataset 'table': is missing"),
    "no settings": (
        lambda file: file.attrs.__delitem__("settings"),
        "attribute 'settings': these are no settings of views",
    ),
    "no room": (lambda file: file.attrs.__setitem__("room", "{}"), "does not say which room"),
    "more poses": (settings_of(poses=11), "has shape .20, 16, 16, 3., expected .22, 16, 16, 3."),
    "takes that are none": (settings_of(poses=-10, takes=-2), "these are no settings of views"),
    "takes in words": (settings_of(takes="2"), "these are no settings of views"),
    "other size": (settings_of(size_px=[16, 20]), "has shape"),
    "other sensors": (settings_of(sensors=["rgb"]), "has other sensors than its settings say: depth"),
    "float pictures": (other("rgb", data=np.zeros((20, 16, 16, 3), np.float32)), "expected numbers of kind 'u'"),
    "wide pictures": (other("rgb", data=np.zeros((20, 16, 16, 3), np.uint16)), "holds uint16, expected uint8"),
    "other count": (other("rgb", data=np.zeros((21, 16, 16, 3), np.uint8)), "has shape"),
    "huge pictures": (
        other("rgb", shape=(20, HUGE, HUGE, 3), dtype="u1", chunks=(1, 64, 64, 3)),
        "values were written",
    ),
    "huge count": (other("rgb", shape=(HUGE, 16, 16, 3), dtype="u1", chunks=(1, 16, 16, 3)), "values were written"),
    "huge settings": (settings_of(size_px=[1024, 1024], poses=100_000), "would take 976.6 GiB"),
    "no values": (
        other("table", shape=(20, len(COLUMNS)), dtype="f8", chunks=(20, len(COLUMNS))),
        f"not all of its {20 * len(COLUMNS):,} values",
    ),
    "other columns": (other("table", data=np.zeros((20, 3))), "has shape"),
    "no numbers": (other("table", data=np.full((20, len(COLUMNS)), np.nan)), "something else than numbers"),
    "negative pose": (other("table", data=np.full((20, len(COLUMNS)), -1.0)), "something else than numbers"),
    "half a pose": (other("table", data=np.full((20, len(COLUMNS)), 0.5)), "something else than numbers"),
    "endless": (other("table", data=np.full((20, len(COLUMNS)), 1e9)), "something else than numbers"),
    "unwritten": (other("rgb", shape=(20, 16, 16, 3), dtype="u1", chunks=(1, 16, 16, 3)), "were written"),
}


@pytest.mark.parametrize(("change", "said"), FAULTS.values(), ids=list(FAULTS))
def test_a_file_that_lies_is_refused(tmp_path: Path, change, said: str) -> None:
    path = changed(tmp_path, change)
    with pytest.raises(SceneError, match=said) as refused:
        everything(path)
    assert str(refused.value).startswith(str(path)) and refused.value.remedy


def test_depth_out_of_range_is_refused(tmp_path: Path) -> None:
    path = changed(tmp_path, lambda file: file["sensors/depth"].__setitem__((3, 0, 0), 20_001))
    with pytest.raises(SceneError, match="out of 0 to 20 m"):
        read_shard(path).seen("depth", slice(0, 5))


def test_a_shard_that_is_replaced_is_noticed(tmp_path: Path) -> None:
    shard = read_shard(write_made(tmp_path, "one"))
    write_made(tmp_path, "one", seed=1)
    with pytest.raises(SceneError, match="has changed since"):
        shard.seen("rgb", slice(0, 2))
    with pytest.raises(SceneError, match="has changed since"):
        assert len(shard.table)


def test_a_scene_is_no_shard(tmp_path: Path) -> None:
    write_scene(corridor_scene(), tmp_path / "corridor.h5")
    assert not is_shard(tmp_path / "corridor.h5")


def test_nothing_half_written_stays_behind(tmp_path: Path, monkeypatch) -> None:
    def full(*given: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(shards, "write_sensor", full)
    with pytest.raises(SceneError, match=r"one\.h5: cannot be written .No space left on device"):
        write_made(tmp_path, "one")
    assert list(tmp_path.iterdir()) == []


def test_a_room_s_key_is_that_of_its_plan_and_maker() -> None:
    scene = corridor_scene()
    assert room_key(scene) == room_key(corridor_scene())
    others = (
        corridor_scene(6),
        replace(scene, name="x"),
        replace(scene, made_by=replace(scene.made_by, seed=3)),
        replace(scene, cell_size_m=0.4),
        replace(scene, locations_m=scene.locations_m + 1),
    )
    assert len({room_key(one) for one in (scene, *others)}) == 6
    newer = replace(scene, made_by=replace(scene.made_by, versions={"clearway": "9"}))
    assert room_key(newer) == room_key(scene)
