import json
import subprocess
import sys
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from clearway.errors import RunError
from clearway.learn.presets import PAPER_A2C
from clearway.learn.run_folder import RunFolder
from clearway.learn.run_record import RunRecord, record_of
from clearway.learn.train import check_can_begin
from clearway.reward import BUMP
from clearway.scenes.digest import scene_digest
from helpers import own_terms
from helpers.made import corridor_scene
from helpers.small_runs import small_learner, small_request


def made_record() -> RunRecord:
    return record_of(small_request(learner=PAPER_A2C, reward=BUMP, paths={"grid": Path("grid.h5")}))


def test_record_round_trip(tmp_path: Path) -> None:
    folder, record = RunFolder(tmp_path / "run"), made_record()
    assert not folder.exists
    folder.write_record(record)
    assert folder.exists
    again = folder.read_record()
    assert again == record
    assert again.learner == PAPER_A2C
    assert again.reward == replace(BUMP, clip=True)  # as the published settings pay it
    assert again.targets == {"corridor": (0, 8, 16), "grid": (5, 22)}
    assert [scene.encoder for scene in again.scenes] == ["made-up", "made-up"]
    assert again.scenes[0].path is None
    assert again.scenes[1].path == str(Path("grid.h5").resolve())
    assert set(again.versions) >= {"python", "clearway", "torch", "numpy"}
    assert again.hardware["threads"] == 1
    assert again.begun is not None
    assert timedelta(0) <= datetime.now(UTC) - datetime.fromisoformat(again.begun) < timedelta(minutes=10)


def test_the_same_experiment_may_run_elsewhere_but_not_with_other_settings() -> None:
    record = made_record()
    elsewhere = replace(record, versions={}, hardware={}, command=("x",), begun=None)
    scenes = tuple(replace(scene, path="/elsewhere") for scene in record.scenes)
    assert record.same_experiment(replace(elsewhere, scenes=scenes))
    others = [
        replace(record, seed=record.seed + 1),
        replace(record, zone_level="cell"),
        replace(record, reward=BUMP.with_changes(blocked=-0.2)),
        replace(record, learner=replace(PAPER_A2C, envs=99)),
        replace(record, scenes=scenes[:1]),
        replace(record, scenes=(replace(scenes[0], digest="0"), scenes[1])),
        replace(record, scenes=(replace(scenes[0], targets=(0, 8)), scenes[1])),
    ]
    assert not any(record.same_experiment(other) for other in others)


def test_a_run_whose_term_s_code_has_changed_is_another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def record(*edits: tuple[str, str], **changes: object) -> RunRecord:
        reward = own_terms.imported(tmp_path / "turning.py", monkeypatch, *edits).REWARD
        return record_of(small_request(reward=reward, **changes))

    folder = RunFolder(tmp_path / "run")
    folder.path.mkdir()
    folder.write_record(record())
    assert folder.check_begin(record(), resume=True) == folder.read_record()
    told = (
        "run: the code of own_turning:Turning, a term of its reward, has changed since the run began. "
        "Undo the change, or give another --out"
    )
    for dearer in (record(own_terms.DEARER), record(own_terms.DEARER, learner=small_learner(frames=1600))):
        assert not folder.read_record().same_experiment(dearer)
        with pytest.raises(RunError, match=f"{told}$") as caught:
            folder.check_begin(dearer, resume=True)
        assert "\n" not in str(caught.value)
    with pytest.raises(RunError, match="another experiment"):
        folder.check_begin(record(("Turning(), Arr", "Turning(0.006), Arr")), resume=True)
    content = json.loads((folder.path / "run.json").read_text())
    del content["reward"]["code"]  # as earlier versions wrote it
    (folder.path / "run.json").write_text(json.dumps(content))
    before = folder.check_begin(record(own_terms.DEARER), resume=True)
    assert before is not None and record(own_terms.DEARER).same_experiment(before)


def test_digest_changes_with_what_training_sees() -> None:
    scene = corridor_scene()
    assert scene_digest(scene) == scene_digest(replace(scene, name="other", observations=None, top_view=None))
    features, graph, places = scene.features.copy(), scene.graph.copy(), scene.locations_m.copy()
    features[3, 2] = np.nextafter(features[3, 2], np.float32(9))
    graph[0, 0] = 8
    places[0, 0] += 0.5
    changed = [{"features": features}, {"graph": graph}, {"locations_m": places}, {"features": None}]
    digests = {scene_digest(replace(scene, **change)) for change in changed} | {scene_digest(scene)}
    assert len(digests) == 5


def test_a_folder_without_a_run_is_refused(tmp_path: Path) -> None:
    (tmp_path / "holiday.jpg").write_bytes(b"")
    with pytest.raises(RunError, match=r"no run here \(run.json is missing\)"):
        RunFolder(tmp_path).read_record()
    with pytest.raises(RunError, match="no run here"):
        RunFolder(tmp_path / "nowhere").read_record()


def written(folder: Path) -> dict:
    """What run.json of the record holds."""
    RunFolder(folder).write_record(made_record())
    return json.loads((folder / "run.json").read_text())


def changed(content: dict, name: str, value: object) -> str:
    return json.dumps(content | {name: value})


UNFIT_FOR_FILES = ("", ".", "..", "../../attic", "/attic", "room/attic", "..\\attic", "attic\0")


OF_ANOTHER_TYPE: tuple[tuple[str, object], ...] = (
    ("seed", "1"),
    ("seed", True),
    ("zone_level", "room"),
    ("versions", 5),
    ("hardware", "a Xeon"),
    ("hardware", [1]),
    ("command", "clearway train"),
    ("begun", 20261127),
)


def located(content: dict, path: object) -> str:
    """A run.json whose first scene lies there."""
    first, *others = content["scenes"]
    return changed(content, "scenes", [first | {"path": path}, *others])


def renamed(content: dict, name: str) -> str:
    """A run.json whose first scene has this name: pictures and exported agents are files named by it."""
    first, *others = content["scenes"]
    return changed(content, "scenes", [first | {"name": name}, *others])


def test_a_run_json_that_is_damaged_foreign_or_newer_is_refused(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path)
    content = written(tmp_path)
    cases = [
        ("", "not readable"),
        ("{", "not readable"),
        ("[]", "not readable"),
        ('{"name": "somebody else\'s run"}', "not readable"),
        (changed(content, "format_version", 3), "newer clearway"),
        (changed(content, "learner", {"frames": 5}), "missing or unknown"),
        (changed(content, "learner", content["learner"] | {"algorithm": "dqn"}), "algorithm 'dqn'"),
        (changed(content, "learner", content["learner"] | {"epochs": 2}), "epochs"),
        (changed(content, "learner", content["learner"] | {"magic": 1}), "magic"),
        (changed(content, "scenes", [{"name": "x"}]), "missing or unknown"),
        (json.dumps({k: v for k, v in content.items() if k != "seed"}), "seed"),
        *((renamed(content, name), "cannot be part of a file's name") for name in UNFIT_FOR_FILES),
        *((changed(content, name, value), f"{name} is") for name, value in OF_ANOTHER_TYPE),
        *((located(content, path), "scene 'corridor'") for path in (0, False, [], {}, 1.5)),
        (changed(content, "learner", content["learner"] | {"discount": 10**400}), "unknown.*is 1000"),
        (changed(content, "learner", content["learner"] | {"discount": "0.9"}), "discount is '0.9'"),
    ]
    for text, message in cases:
        (tmp_path / "run.json").write_text(text)
        with pytest.raises(RunError, match=message):
            folder.read_record()
    (tmp_path / "run.json").write_text(json.dumps(content))
    read = folder.read_record()
    assert read == replace(made_record(), begun=read.begun)


def test_metrics_leave_out_a_line_cut_off_and_forget_what_comes_again(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path)
    assert folder.metrics() == []
    rows = [{"frames": frames, "seconds": 0.5, "loss": frames / 7} for frames in (80, 160, 240)]
    text = "".join(json.dumps(row) + "\n" for row in rows)
    folder.metrics_path.write_text(text + '{"frames": 320, "lo')
    assert folder.metrics() == rows
    folder.forget_metrics_after(160)
    assert folder.metrics() == rows[:2]
    assert folder.metrics_path.read_text().endswith("}\n")
    folder.forget_metrics_after(-1)
    assert folder.metrics_path.read_text() == ""


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (b"not a row", "not JSON"),
        (b'{"frames": 160, "seconds": 2, "note": "\xff"}', "not JSON.*utf-8"),
        (b"[160]", "no row of figures"),
        (b'{"frames": 160}', "no row of figures with its frames and seconds"),
        (b'{"frames": 160, "seconds": 2, "loss": "x"}', "loss is 'x'"),
        (b'{"frames": 160, "seconds": 2, "loss": null}', "loss is None"),
        (b'{"frames": 160, "seconds": NaN}', "seconds is nan"),
    ],
)
def test_metrics_that_are_no_rows_of_figures_are_refused(line: bytes, message: str, tmp_path: Path) -> None:
    folder = RunFolder(tmp_path)
    folder.metrics_path.write_bytes(b'{"frames": 80, "seconds": 1}\n' + line + b"\n")
    with pytest.raises(RunError, match=rf"metrics.jsonl, line 2: {message}.*Remove the line"):
        folder.metrics()


def test_settings_of_another_clearway_are_told_apart_from_damage(tmp_path: Path) -> None:
    content = written(tmp_path)
    content["learner"] |= {"magic": 1}
    (tmp_path / "run.json").write_text(json.dumps(content))
    with pytest.raises(RunError, match=r"magic.*Restore it"):
        RunFolder(tmp_path).read_record()
    (tmp_path / "run.json").write_text(changed(content, "versions", {"clearway": "99.1"}))
    with pytest.raises(RunError, match=r"magic.*clearway 99\.1 wrote it, this is .*: use that one"):
        RunFolder(tmp_path).read_record()


HOLD = """
import sys
from pathlib import Path
from clearway.learn.run_folder import RunFolder
with RunFolder(Path(sys.argv[1])).held():
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.mark.slow
def test_a_second_process_is_refused_until_the_first_lets_go(tmp_path: Path) -> None:
    command = [sys.executable, "-c", HOLD, str(tmp_path)]
    environment = {"PYTHONPATH": ":".join(sys.path)}
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
    ) as process:
        assert process.stdout.readline() == "held\n"
        with pytest.raises(RunError, match="another process trains here"):
            with RunFolder(tmp_path).held():
                pass
        process.kill()  # the lock of a killed process holds nobody up
    with RunFolder(tmp_path).held():
        pass


def test_half_written_files_of_a_killed_process_are_swept(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path)
    folder.write_record(made_record())
    for name in (".run.json.x7_a.part", ".metrics.jsonl.q.part"):
        (tmp_path / name).write_text("half")
    (tmp_path / "mine.part").write_text("the user's")
    with folder.held():
        assert {path.name for path in tmp_path.iterdir()} == {".lock", "run.json", "mine.part"}


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_to_check_that_a_run_can_begin_or_go_on_leaves_nothing_behind(tmp_path: Path) -> None:
    request = small_request()
    folder = RunFolder(tmp_path / "run")
    check_can_begin(request, folder.path, resume=True, copy_to=None)
    assert not folder.path.exists()
    folder.path.mkdir()
    folder.write_record(record_of(request))
    (folder.path / ".run.json.x7_a.part").write_text("half")
    before = contents(folder.path)
    check_can_begin(request, folder.path, resume=True, copy_to=None)
    with pytest.raises(RunError, match=r"run: holds a run already\. Give --resume"):
        check_can_begin(request, folder.path, resume=False, copy_to=None)
    assert contents(folder.path) == before
    with folder.held(), pytest.raises(RunError, match="another process trains here"):
        check_can_begin(request, folder.path, resume=True, copy_to=None)


def test_a_file_where_the_folder_should_be_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("")
    with pytest.raises(RunError, match="out"):
        with RunFolder(tmp_path / "out").held():
            pass


def test_a_run_that_fails_at_once_takes_away_what_it_wrote_alone(tmp_path: Path) -> None:
    record = record_of(small_request())
    for name, own in (("new", {}), ("own", {"run.yaml": "seed: 3", "notes.txt": "mine", "milestones/5/kept": "mine"})):
        folder = RunFolder(tmp_path / name)
        for path, text in own.items():
            (folder.path / path).parent.mkdir(parents=True, exist_ok=True)
            (folder.path / path).write_text(text)
        with pytest.raises(ZeroDivisionError), folder.held(), folder.begun(record, resume=False):
            assert folder.exists
            folder.metrics_path.write_text("")
            raise ZeroDivisionError
        left = {path.relative_to(folder.path).as_posix() for path in folder.path.rglob("*") if path.is_file()}
        assert left - {".lock"} == set(own)
    assert not (tmp_path / "new").exists()
