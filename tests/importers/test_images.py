import csv
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from clearway.errors import SceneError
from clearway.importers import photographs
from clearway.importers.images import read_images
from clearway.scenes.thor_v1 import read_scene, write_scene
from clearway.scenes.validate import SceneWarning, check_scene, pose_quirks
from helpers.made import graph_of_cells

CELLS = np.array([[0, 0], [0, 1], [1, 1]])
Row = Sequence[object]


def write_csv(path: Path, rows: Sequence[Row]) -> Path:
    with path.open("w", newline="") as file:
        csv.writer(file).writerows(rows)
    return path


def photographed(folder: Path, size: tuple[int, int] = (40, 30)) -> tuple[Path, list[list[object]]]:
    """A table of three cells, and a photograph of one colour for every pose."""
    rows: list[list[object]] = []
    (folder / "photos").mkdir(parents=True)
    for index, (x, z) in enumerate(CELLS.tolist()):
        for heading in (0, 90, 180, 270):
            name = f"photos/{index}-{heading}.png"
            Image.new("RGB", size, (10 * index, heading // 2, 7)).save(folder / name)
            rows.append([name, x * 0.5, z * 0.5, heading])
    return write_csv(folder / "flat.csv", [["file", "x", "z", "heading"], *rows]), rows


def test_photographs_become_a_scene(tmp_path: Path) -> None:
    table, _ = photographed(tmp_path)
    scene = read_images(table, step_m=0.5, height_px=15)
    check_scene(scene)
    assert pose_quirks(scene) == []
    assert (scene.name, scene.state_count, scene.cell_size_m) == ("flat", 12, 0.5)
    np.testing.assert_array_equal(scene.graph, graph_of_cells(CELLS))
    assert scene.observations.shape == (12, 15, 20, 3)
    np.testing.assert_array_equal(scene.observations[6][3, 4], [10, 90, 7])
    assert scene.observations[np.array([[0, 6], [6, 0]])].shape == (2, 2, 15, 20, 3)


def test_the_scene_survives_its_file(tmp_path: Path) -> None:
    table, _ = photographed(tmp_path)
    scene = read_images(table, step_m=0.5, height_px=15)
    write_scene(scene, tmp_path / "flat.h5")
    back = read_scene(tmp_path / "flat.h5")
    np.testing.assert_array_equal(back.graph, scene.graph)
    np.testing.assert_array_equal(back.observations[:], scene.observations[:])
    assert back.made_by.source == "images"


def test_columns_may_stand_in_any_order_beside_others(tmp_path: Path) -> None:
    _, rows = photographed(tmp_path)
    turned = write_csv(
        tmp_path / "turned.csv",
        [["Heading", "note", "z", "x", "FILE"], *([h, "", z, x, file] for file, x, z, h in rows)],
    )
    np.testing.assert_array_equal(read_images(turned, step_m=0.5).graph, graph_of_cells(CELLS))


def test_blocked_edges_come_from_their_own_table(tmp_path: Path) -> None:
    table, _ = photographed(tmp_path)
    blocked = write_csv(tmp_path / "blocked.csv", [["x1", "z1", "x2", "z2"], [0, 0, 0, 0.5]])
    with pytest.warns(SceneWarning, match=r"flat\.csv: the locations form 2 parts"):
        scene = read_images(table, step_m=0.5, blocked=blocked)
    assert scene.components.max() == 1  # the first cell is cut off
    with pytest.raises(SceneError, match=r"blocked\.csv.*joins no two"):
        read_images(table, step_m=0.5, blocked=write_csv(blocked, [["x1", "z1", "x2", "z2"], [0, 0, 9, 9]]))


def test_faults_of_the_poses_are_not_blamed_on_the_blocked_edges(tmp_path: Path) -> None:
    table, rows = photographed(tmp_path)
    blocked = write_csv(tmp_path / "blocked.csv", [["x1", "z1", "x2", "z2"], [0, 0, 0, 0.5]])
    write_csv(table, [["file", "x", "z", "heading"], *rows[:-1]])
    with pytest.raises(SceneError, match=r"flat\.csv: the location \(0\.5, 0\.5\) lacks the heading 270"):
        read_images(table, step_m=0.5, blocked=blocked)


def test_pictures_too_large_for_a_scene_file_are_refused(tmp_path: Path) -> None:
    table, _ = photographed(tmp_path)
    with pytest.raises(SceneError, match=r"4000 x 3000 pixels.*Give another --height"):
        read_images(table, step_m=0.5, height_px=3000)


def test_a_photograph_taken_upright_is_shown_upright(tmp_path: Path) -> None:
    table, _ = photographed(tmp_path, size=(30, 40))
    for path in (tmp_path / "photos").iterdir():
        picture = Image.open(path).convert("RGB").resize((40, 30))
        exif = Image.Exif()
        exif[0x0112] = 6  # the camera was turned
        picture.save(path, exif=exif)
    assert read_images(table, step_m=0.5, height_px=40).observations.shape == (12, 40, 30, 3)


def test_photographs_of_other_shapes_are_cut_to_fit(tmp_path: Path) -> None:
    table, _ = photographed(tmp_path)
    wide = np.zeros((30, 80, 3), np.uint8)
    wide[:, 20:60] = 255
    Image.fromarray(wide).save(tmp_path / "photos" / "0-90.png")
    scene = read_images(table, step_m=0.5, height_px=30)
    assert scene.observations.shape == (12, 30, 40, 3)
    assert (scene.observations[1] == 255).all()


def test_a_photograph_that_changed_since_is_refused(tmp_path: Path) -> None:
    table, _ = photographed(tmp_path)
    scene = read_images(table, step_m=0.5)
    (tmp_path / "photos" / "0-0.png").write_bytes(b"another")
    with pytest.raises(SceneError, match=r"0-0\.png.*has changed"):
        scene.observations[0]


def test_a_picture_too_large_is_refused_before_it_is_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    table, _ = photographed(tmp_path)
    monkeypatch.setattr(photographs, "MAX_PICTURE_PIXELS", 1_000)
    monkeypatch.setattr(Image.Image, "load", lambda self: pytest.fail("unpacked"))
    with pytest.raises(SceneError, match=r"40 x 30 pixels"):
        read_images(table, step_m=0.5)


@pytest.mark.parametrize(
    ("rows", "parts"),
    [
        ([], ("lacks the column file",)),
        ([["file", "x", "z"]], ("lacks the column heading", "file,x,z,heading")),
        ([["file", "x", "z", "heading"]], ("has 0 rows",)),
        ([["file", "x", "z", "heading"], ["photos/0-0.png", 0, 0]], ("line 2 has fewer values",)),
        ([["file", "x", "z", "heading"], ["photos/0-0.png", 0, 5, 0, 5, 90]], ("line 2 has 6 values in 4", "a point")),
        ([["file", "x", "z", "heading"], ["photos/0-0.png", 0, "here", 0]], ("line 2 holds '0,here,0'",)),
        ([["file", "x", "z", "heading"], ["photos/0-0.png", 0, "nan", 0]], ("line 2 holds",)),
        ([["file", "x", "z", "heading"], ["photos/0-0.png", 0, 1e9, 0]], ("line 2 holds",)),
        ([["file", "x", "z", "heading"], ["gone.png", 0, 0, 0]], ("line 2", "gone.png", "no file")),
        ([["file", "x", "z", "heading"], ["a\0b.png", 0, 0, 0]], ("line 2", "no file")),
        ([["file", "x", "z", "heading"], ["a" * 9000, 0, 0, 0]], ("line 2", "no file")),
        ([["file", "x", "z", "heading"], ["../flat.csv", 0, 0, 0]], ("no file in the table's folder",)),
        ([["file", "x", "z", "heading"], ["/etc/hostname", 0, 0, 0]], ("no file in the table's folder",)),
    ],
)
def test_tables_that_do_not_fit_are_refused(rows: list[Row], parts: tuple[str, ...], tmp_path: Path) -> None:
    table, _ = photographed(tmp_path)
    with pytest.raises(SceneError) as caught:
        read_images(write_csv(table, rows), step_m=0.5)
    for part in ("flat.csv", *parts):
        assert part in str(caught.value)


@pytest.mark.parametrize(
    "content", [b"", b"not a picture", b"\x89PNG\r\n\x1a\n" + bytes(40), b"\xff\xd8\xff" + bytes(99)]
)
def test_what_is_no_picture_is_refused(content: bytes, tmp_path: Path) -> None:
    table, _ = photographed(tmp_path)
    (tmp_path / "photos" / "0-0.png").write_bytes(content)
    with pytest.raises(SceneError, match=r"0-0\.png: cannot be read as a picture"):
        read_images(table, step_m=0.5)


@pytest.mark.parametrize("step_m", [0.0, -1.0, float("nan"), float("inf")])
def test_a_step_is_a_length(step_m: float, tmp_path: Path) -> None:
    table, _ = photographed(tmp_path)
    with pytest.raises(SceneError, match="Give a length above 0"):
        read_images(table, step_m=step_m)


@pytest.mark.parametrize(("mode", "value"), [("I;16", 30_000), ("I", 30_000), ("F", 0.5)])
def test_deep_pictures_are_refused_not_made_white(tmp_path: Path, mode: str, value: float) -> None:
    path = tmp_path / "deep.tiff"
    Image.new(mode, (40, 30), value).save(path)
    with pytest.raises(SceneError, match=r"deep\.tiff: has more than 8 bits a channel \(mode .*Save it with 8 bits"):
        photographs.photographs([path])


def test_blank_lines_count_where_a_line_is_named(tmp_path: Path) -> None:
    table, _ = photographed(tmp_path)
    lines = table.read_text().splitlines()
    table.write_text("\n".join([lines[0], "", "", *lines[1:5], "", "photos/gone.png,0,0,0"]))
    with pytest.raises(SceneError, match=r"line 9 names 'photos/gone\.png'"):
        read_images(table, step_m=0.5)
    table.write_text("\n".join([lines[0], "", "photos/0-0.png,0,0"]))
    with pytest.raises(SceneError, match="line 3 has fewer values"):
        read_images(table, step_m=0.5)


@pytest.mark.parametrize("count", [7, 16])
def test_headings_that_are_no_whole_degrees_are_no_quirk(tmp_path: Path, count: int) -> None:
    rows: list[Row] = [["file", "x", "z", "heading"]]
    Image.new("RGB", (4, 3)).save(tmp_path / "a.png")
    rows += [["a.png", 0, z, 360 * n / count] for z in (0, 0.5) for n in range(count)]
    scene = read_images(write_csv(tmp_path / "poses.csv", rows), step_m=0.5)
    assert pose_quirks(scene) == []
    turned = replace(scene, headings_deg=np.roll(scene.headings_deg, 1))
    assert len(pose_quirks(turned)) > 0
    off = replace(scene, headings_deg=(scene.headings_deg + 2) % 360)
    assert any("no multiples" in quirk for quirk in pose_quirks(off))
