import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from clearway.errors import SceneError
from clearway.importers.avd import _laid_out, read_avd
from clearway.scenes.actions import BLOCKED, Action
from clearway.scenes.thor_v1 import read_scene, write_scene
from clearway.scenes.validate import SceneWarning, pose_quirks
from clearway.zones import Zone, scene_zones

HEADINGS = 12
CORRIDOR = 3  # locations, one step apart along heading 0 (pictures 0, 12, 24)


def picture_name(location: int, heading: int) -> str:
    return f"{HEADINGS * location + heading:015d}.jpg"


def annotations() -> dict[str, dict]:
    """A corridor: forward where heading 0 looks along it, and for heading 6 back."""
    found = {}
    for location in range(CORRIDOR):
        for heading in range(HEADINGS):
            ahead, behind = (location + 1, location - 1) if heading == 0 else (location - 1, location + 1)
            ends = [end if heading in (0, 6) and 0 <= end < CORRIDOR else None for end in (ahead, behind)]
            forward, backward = ("" if end is None else picture_name(end, heading) for end in ends)
            found[picture_name(location, heading)] = {
                "bounding_boxes": [[1, 2, 3, 4, 5, 6]],
                "rotate_cw": picture_name(location, (heading + 1) % HEADINGS),
                "rotate_ccw": picture_name(location, (heading - 1) % HEADINGS),
                "forward": forward,
                "backward": backward,
                "left": "",
                "right": "",
            }
    return found


def made_folder(folder: Path, content: object = None) -> Path:
    (folder / "jpg_rgb").mkdir(parents=True)
    (folder / "annotations.json").write_text(json.dumps(annotations() if content is None else content))
    for location in range(CORRIDOR):
        for heading in range(HEADINGS):
            path = folder / "jpg_rgb" / picture_name(location, heading)
            Image.new("RGB", (64, 36), (80 * location, 20 * heading, 0)).save(path)
    return folder


def test_links_become_the_graph_and_twelve_headings(tmp_path: Path) -> None:
    scene = read_avd(made_folder(tmp_path / "Home_001_1"), height_px=18)
    assert (scene.name, scene.state_count, scene.heading_count, scene.turn_deg) == ("Home_001_1", 36, 12, 30)
    assert pose_quirks(scene) == []
    assert scene.graph[0].tolist() == [12, 1, 11, -1]
    assert scene.graph[18].tolist() == [6, 19, 17, 30]
    assert scene.graph[3, Action.MOVE_FORWARD] == scene.graph[24, Action.MOVE_FORWARD] == -1
    np.testing.assert_allclose(scene.locations_m[::12], [[0, 0], [0, 0.3], [0, 0.6]], atol=1e-9)
    assert scene.headings_deg[:12].tolist() == list(range(0, 360, 30))
    assert scene.observations.shape == (36, 18, 32, 3)
    assert np.abs(scene.observations[13].mean((0, 1)) - [80, 20, 0]).max() < 3  # JPEG
    assert scene_zones(scene)[3] == Zone.COLLISION


def test_a_location_photographed_from_another_first_heading_is_turned_into_place(tmp_path: Path) -> None:
    """The order of pictures in the file does not matter: the links say which way a picture looks."""
    content = annotations()
    names = list(content)
    turned = names[:12] + names[17:24] + names[12:17] + names[24:]
    scene = read_avd(made_folder(tmp_path / "home", {name: content[name] for name in turned}))
    assert pose_quirks(scene) == []
    assert scene.headings_deg[12] == 150
    assert scene.graph[0, Action.MOVE_FORWARD] == 12 + 7  # picture 12 is the eighth of its location now


def test_a_part_that_nothing_leads_to_stands_to_the_right_of_the_others(tmp_path: Path) -> None:
    content = annotations()
    for location, other in ((1, 2), (2, 1)):
        for heading in (0, 6):
            for move in ("forward", "backward"):
                if content[picture_name(location, heading)][move] == picture_name(other, heading):
                    content[picture_name(location, heading)][move] = ""
    scene = read_avd(made_folder(tmp_path / "Home_001_1", content), height_px=18)
    first, second = (scene.locations_m[scene.components == part] for part in (0, 1))
    assert len(first) == 24 and len(second) == 12
    assert second[:, 0].min() > first[:, 0].max()


def test_a_part_that_grows_to_the_left_meets_no_other() -> None:
    graph = np.full((4 * 4, 4), BLOCKED)  # one location, then three in a row whose rightmost comes first
    for right in (1, 2):
        graph[4 * right + 1, Action.MOVE_BACKWARD], graph[4 * (right + 1) + 1, Action.MOVE_FORWARD] = (
            4 * (right + 1) + 1,
            4 * right + 1,
        )
    cells, _ = _laid_out(graph, 4)
    assert cells[:, 0].round(6).tolist() == [0, 5, 4, 3] and np.allclose(cells[:, 1], 0)


def test_the_scene_survives_its_file(tmp_path: Path) -> None:
    scene = read_avd(made_folder(tmp_path / "home"), height_px=18)
    write_scene(scene, tmp_path / "home.h5")
    back = read_scene(tmp_path / "home.h5")
    np.testing.assert_array_equal(back.graph, scene.graph)
    assert back.heading_count == 12


def test_a_location_whose_turns_do_not_lead_round_is_left_out_with_a_warning(tmp_path: Path) -> None:
    content = annotations()
    content[picture_name(2, 4)]["rotate_cw"] = ""
    with pytest.warns(SceneWarning, match="12 of 36 pictures are left out"):
        scene = read_avd(made_folder(tmp_path / "home", content))
    assert scene.cell_count == 2
    assert scene.graph[12, Action.MOVE_FORWARD] == -1  # what it led to is gone


def change(edit: Callable[[dict], object]) -> Callable[[Path], None]:
    def damage(folder: Path) -> None:
        content = annotations()
        edit(content)
        (folder / "annotations.json").write_text(json.dumps(content))

    return damage


def unturned(content: dict) -> None:
    for entry in content.values():
        entry["rotate_cw"] = ""


@pytest.mark.parametrize(
    ("damage", "parts"),
    [
        (lambda folder: (folder / "annotations.json").unlink(), ("no such file",)),
        (lambda folder: (folder / "annotations.json").write_text("no"), ("cannot be read as JSON",)),
        (lambda folder: (folder / "annotations.json").write_text("[]"), ("lacks the links",)),
        (change(lambda content: content[picture_name(0, 0)].pop("forward")), ("lacks the links", "forward")),
        (change(lambda content: content[picture_name(0, 0)].update(forward=3)), ("lacks the links", "forward is 3")),
        (change(unturned), ("no picture can be turned round from",)),
        (change(dict.clear), ("no picture can be turned round from",)),
        (lambda folder: (folder / "jpg_rgb" / picture_name(1, 1)).unlink(), (picture_name(1, 1), "no file in jpg_rgb")),
    ],
)
def test_what_is_broken_is_named(damage: Callable, parts: tuple[str, ...], tmp_path: Path) -> None:
    folder = made_folder(tmp_path / "home")
    damage(folder)
    with pytest.raises(SceneError) as caught:
        read_avd(folder)
    for part in ("annotations.json", *parts):
        assert part in str(caught.value)


def test_pictures_outside_the_folder_are_refused(tmp_path: Path) -> None:
    """The names lead to files that are there, one folder up."""
    folder = made_folder(tmp_path / "home")
    (folder / "jpg_rgb").rename(folder / "elsewhere")
    (folder / "jpg_rgb").mkdir()
    text = json.dumps(annotations()).replace('"0000', '"../elsewhere/0000')
    (folder / "annotations.json").write_text(text)
    assert (folder / "jpg_rgb" / "../elsewhere" / picture_name(0, 0)).exists()
    with pytest.raises(SceneError, match="which is no file in jpg_rgb"):
        read_avd(folder)


def test_a_stray_picture_does_not_drop_the_circle_that_it_turns_into(tmp_path: Path) -> None:
    stray = {**annotations()[picture_name(0, 3)], "forward": "", "backward": ""}
    folder = made_folder(tmp_path / "home", {"stray.jpg": stray, **annotations()})
    with pytest.warns(SceneWarning, match="1 of 37 pictures are left out"):
        scene = read_avd(folder, height_px=18)
    assert (scene.state_count, scene.cell_count) == (36, 3)
