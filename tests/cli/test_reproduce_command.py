import importlib
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import numpy as np
import pytest

from clearway.choices import BudgetName, LearnerName
from clearway.errors import ClearwayError, SceneError
from clearway.experiments import reproduce, request_file, setting
from clearway.experiments.budget import BUDGETS
from clearway.experiments.catalogue import EXPERIMENTS
from clearway.experiments.groups import all_jobs, compared
from clearway.experiments.plan import Job
from clearway.experiments.reproduce import ReproduceRequest
from clearway.experiments.section import Claim, Section
from clearway.learn.presets import DEFAULT, PAPER_A2C, PAPER_A3C
from clearway.learn.run_folder import RunFolder
from clearway.reward import RewardError
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import write_scene
from helpers import own_terms
from helpers.plugin_package import write_package
from helpers.small_runs import small_learner
from helpers.small_setting import BUDGET, do_here, small_rooms


@contextmanager
def small_experiments() -> Iterator[None]:
    """Budget and learners are small."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(BUDGETS, "smoke", BUDGET)
        patch.setattr(setting, "_budgeted", lambda name, budget: small_learner(setting.LEARNERS[name]))
        yield


@pytest.fixture
def small() -> Iterator[None]:
    with small_experiments():
        yield


def write_rooms(folder: Path) -> Path:
    folder.mkdir()
    for scene in small_rooms():
        write_scene(scene, folder / f"{scene.name}.h5")
    return folder


@pytest.fixture
def dumps(small, tmp_path: Path) -> Path:
    """A folder of two small scenes."""
    return write_rooms(tmp_path / "dumps")


@pytest.fixture(scope="module")
def first(clearway, tmp_path_factory: pytest.TempPathFactory) -> SimpleNamespace:
    """fig5, reproduced once, by a process of its own: its words, its answer and the folder that it left."""
    folder = tmp_path_factory.mktemp("reproduced")
    words = ("--scenes", write_rooms(folder / "dumps"), "--seeds", 1, "--workers", 1, "--json")
    with small_experiments():
        answer = clearway("reproduce", "fig5", *words, "--learners", "default", "--out", folder / "out")
    return SimpleNamespace(words=words, answer=answer, out=folder / "out")


@pytest.fixture
def out(small, first, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of what fig5 left; what is still to be done there, this process does."""
    monkeypatch.setattr(reproduce, "run_jobs", do_here)
    return shutil.copytree(first.out, tmp_path / "out")


def test_an_experiment_from_dumps_to_report(clearway, first, out: Path) -> None:
    assert first.answer.code == 0, first.answer
    content = first.answer.json
    assert content == json.loads((out / "report.json").read_text())
    (section,) = content["sections"]
    assert section["name"] == "fig5" and not section["missing"]
    assert "Smoke" in content["warning"]
    assert content["facts"]["scenes"].startswith("bathroom (")
    assert "kitchen" not in content["facts"]["scenes"]  # smoke takes one scene
    assert (out / "report.html").exists()
    runs = {path: path.stat().st_mtime_ns for path in (out / "runs").rglob("*.safetensors")}
    assert len(list((out / "runs").iterdir())) == 2  # two rewards, one seed
    again = clearway("reproduce", "fig5", *first.words, "--learners", "default", "--out", out)
    assert again.json["sections"] == content["sections"]
    assert {path: path.stat().st_mtime_ns for path in (out / "runs").rglob("*.safetensors")} == runs


@pytest.mark.slow
def test_a_report_from_what_is_complete(clearway, first, out: Path) -> None:
    gone, _ = sorted((out / "runs").iterdir())
    shutil.rmtree(gone)
    (section,) = clearway("report", out, "--json").json["sections"]
    assert section["missing"] == [gone.name]
    commands = json.loads((out / "report.json").read_text())["facts"]["commands"]
    assert "reproduce fig5" in commands  # not the report's own
    assert not gone.exists()  # nothing was trained
    whole = clearway("reproduce", "fig5", *first.words, "--learners", "default", "--out", out)
    assert whole.json["sections"] == first.answer.json["sections"]


@pytest.mark.slow
def test_a_second_experiment_joins_the_report(clearway, first, out: Path) -> None:
    def names(answer) -> list[str]:
        return [section["name"] for section in answer.json["sections"]]

    both = clearway("reproduce", "fig3", *first.words, "--learners", "default", "--out", out)
    assert names(both) == ["fig3", "fig5"]
    assert "reproduce fig5" in both.json["facts"]["commands"] and "reproduce fig3" in both.json["facts"]["commands"]
    assert names(clearway("report", out, "--json")) == ["fig3", "fig5"]
    changed = "--set", "lr_start=0.002"
    alone = clearway("reproduce", "fig4", *first.words, "--learners", "default", *changed, "--out", out)
    assert names(alone) == ["fig4"]  # another question: a report of its own
    assert alone.json["warning"].endswith("Changed in every learner compared: lr_start=0.002.")
    assert "(PAPER_A2C)" not in alone.json["facts"]["learners"] and ", changed, " in alone.json["facts"]["learners"]
    rates = [RunFolder(run).read_record().learner.lr_start for run in (out / "runs").iterdir()]
    assert rates.count(0.002) == 2 and len(rates) == 4  # two rewards, trained anew
    assert not (out / "tables" / "fig5.csv").exists()


def test_a_report_says_what_made_its_runs_not_what_wrote_it(clearway, first, out: Path) -> None:
    assert "(2 runs)" in first.answer.json["facts"]["hardware"]
    for folder, threads in zip(sorted((out / "runs").iterdir()), (7, 8), strict=True):
        record = json.loads((folder / "run.json").read_text())
        record["hardware"]["threads"] = threads
        (folder / "run.json").write_text(json.dumps(record))
    facts = clearway("report", out, "--json").json["facts"]
    assert "threads 7" in facts["hardware"] and "threads 8" in facts["hardware"]
    assert facts["hardware"].count("(1 run)") == 2
    assert "(2 runs)" in facts["versions"] and "torch" in facts["versions"]
    assert facts["on the grid"].endswith("steps where a section does not say otherwise")
    assert facts["first and last run begun"].count("+00:00") == 2
    assert "say so" not in facts["first and last run begun"]
    first_run = sorted((out / "runs").iterdir())[0] / "run.json"
    first_run.write_text(json.dumps(json.loads(first_run.read_text()) | {"begun": None}))
    facts = clearway("report", out, "--json").json["facts"]
    assert facts["first and last run begun"].endswith(" (of the 1 of 2 runs that say so)")
    for folder, command in zip(sorted((out / "runs").iterdir()), (["/tmp/bump.py", "5"], ["-c"]), strict=True):
        record = json.loads((folder / "run.json").read_text())
        (folder / "run.json").write_text(json.dumps(record | {"command": command}))
    facts = clearway("report", out, "--json").json["facts"]
    assert set(facts["runs begun by"].split("; ")) == {"bump.py 5 (1 run)", "python -c (1 run)"}


FOREIGN = (
    ("budget", "huge"),
    ("budget", ["paper"]),
    ("names", ["nosuch"]),
    ("names", "fig5"),
    ("names", None),
    ("names", [["fig5"]]),
    ("learners", ["mine"]),
    ("rooms", ["attic"]),
    ("seeds", "x"),
    ("seeds", 0),
    ("frames", 1.5),
    ("encoder", 7),
    ("commands", [3]),
    ("packages", ["tiny-plugins"]),
    ("packages", {"fig5": 3}),
)


@pytest.mark.parametrize(
    "content",
    [
        None,
        "{",
        "[]",
        '{"names": ["fig5"]}',
        '{"dumps": [], "unknown": 1}',
        *(json.dumps({"names": ["fig5"], "budget": "smoke", "dumps": [], name: value}) for name, value in FOREIGN),
    ],
)
def test_a_folder_without_a_reproduction_is_refused(clearway, tmp_path: Path, content: str | None) -> None:
    if content is not None:
        (tmp_path / "reproduction.json").write_text(content)
    assert clearway("report", tmp_path).refusal(str(tmp_path), "clearway reproduce")


def test_a_file_is_no_folder_of_a_reproduction(clearway, tmp_path: Path) -> None:
    (tmp_path / "report.md").write_text("# Report")
    assert clearway("report", tmp_path / "report.md").refusal("report.md: no reproduction here. Name a folder")


def test_scenes_without_features_are_refused(clearway, dumps: Path, tmp_path: Path) -> None:
    (scene, _) = small_rooms()
    write_scene(replace(scene, features=None, encoder=None), dumps / "bathroom.h5")
    answer = clearway("reproduce", "table1", "--scenes", dumps, "--out", tmp_path / "out")
    assert answer.refusal("bathroom.h5", "no features", "clearway scenes import")


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("--seeds", 0), "seeds"),
        (("--workers", 0), "workers"),
        (("--threads", 0), "threads"),
        (("--set", "nosuch=1"), "--set nosuch=1: expected name=value"),
        (("--set", "epochs=2"), "--set epochs=2: expected name=value with a name among paper's settings: frames, "),
        (("--set", "frames=5"), "--set frames=5: frames are the budget's. Give --frames"),
        (("--rewards", "shortest", "bump"), "rewards are those of the experiment rewards. Name it, too"),
    ],
)
def test_what_cannot_be_asked_is_refused(clearway, words: tuple, part: str, tmp_path: Path) -> None:
    assert clearway("reproduce", "table1", "--out", tmp_path / "out", *words).refusal(part)
    assert not (tmp_path / "out").exists()


def test_rewards_that_nobody_knows_are_refused(clearway, tmp_path: Path) -> None:
    answer = clearway("reproduce", "rewards", "--out", tmp_path / "out", "--rewards", "shortest", "bumb")
    assert answer.refusal("reward='bumb' is unknown. Did you mean bump?")
    assert not (tmp_path / "out").exists()


def test_a_seed_out_of_range_is_refused_before_anything_is_trained(clearway, dumps: Path, tmp_path: Path) -> None:
    words = ("--scenes", dumps, "--budget", "smoke", "--out", tmp_path / "out")
    answer = clearway("reproduce", "table1", *words, "--first-seed", 2**31 - 2, "--seeds", 3)
    assert answer.refusal(f"seed is {2**31}", f"0 to {2**31 - 1}")
    assert not (tmp_path / "out" / "runs").exists()


@pytest.mark.parametrize("words", [("reproduce", "table1", "--out"), ("report",)])
def test_graphics_that_are_not_there_are_told_in_one_line(words: tuple[str, ...], tmp_path: Path) -> None:
    """By a process of its own, as MuJoCo looks at it once."""
    command = [sys.executable, "-m", "clearway", *words, str(tmp_path / "out")]
    environment = {**os.environ, "MUJOCO_GL": "nonsense"}
    answer = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    (line,) = answer.stderr.splitlines()
    assert answer.returncode and "MUJOCO_GL=nonsense" in line and "Unset MUJOCO_GL" in line
    assert not (tmp_path / "out").exists()


def test_the_learners_of_the_command_line_are_the_named_ones() -> None:
    own_goals = replace(DEFAULT, goals="seen")
    assert {
        "paper": PAPER_A2C,
        "paper-a3c": PAPER_A3C,
        "default": DEFAULT,
        "own-goals": own_goals,
    } == setting.LEARNERS
    assert set(setting.LEARNERS) == set(get_args(LearnerName))
    assert set(BUDGETS) == set(get_args(BudgetName))


def test_the_command_s_help_names_all_experiments(clearway) -> None:
    told = " ".join(clearway("reproduce", "--help").out.replace("│", " ").split())
    (listed,) = re.findall(r"Some of (.*?); all:", told)
    assert listed.split(", ") == list(EXPERIMENTS)


@pytest.mark.parametrize("names", [("fig9",), ("all", "fig9"), ("fig5", "fig9")])
def test_an_experiment_that_nobody_offers_is_refused(clearway, tmp_path: Path, names: tuple[str, ...]) -> None:
    answer = clearway("reproduce", *names, "--out", tmp_path / "out")
    assert answer.refusal("experiment 'fig9'", "table1", "Did you mean fig", "no such experiment")
    assert not (tmp_path / "out").exists()


def test_another_package_s_experiment_stands_after_ours_in_the_report(
    clearway, first, out: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(write_package(tmp_path / "site")))
    both = clearway("reproduce", "twice", *first.words, "--learners", "default", "--out", out)
    assert [section["name"] for section in both.json["sections"]] == ["fig5", "twice"]
    assert not both.json["sections"][1]["missing"]
    assert (out / "tables" / "twice_seeds.csv").read_text().splitlines() == ["seed", "0"]
    assert clearway("report", out, "--json").json["sections"] == both.json["sections"]
    shutil.rmtree(tmp_path / "site")  # uninstalled
    without = clearway("report", out, "--json")
    assert [section["name"] for section in without.json["sections"]] == ["fig5"]
    gone = "experiment 'twice' of the package tiny-plugins 1.2, which is not installed here. Install it"
    assert f"reproduction.json: the report leaves out {gone}" in without.err
    again = clearway("reproduce", "fig5", *first.words, "--learners", "default", "--out", out)
    assert gone in again.err  # what others asked for, and whose it was, is kept
    (out / "reproduction.json").write_text((out / "reproduction.json").read_text().replace('"fig5",', ""))
    assert clearway("report", out).refusal(f"reproduction.json: asks for {gone}")
    request = json.loads((out / "reproduction.json").read_text())
    assert (request["names"], request.pop("packages")) == (["twice"], {"twice": "tiny-plugins 1.2"})
    (out / "reproduction.json").write_text(json.dumps(request))  # as it was written before, or by a program
    told = "asks for experiment 'twice', which nothing that is installed here offers. Install the package that does, or"
    assert clearway("report", out).refusal(told, "run the program that made this folder")
    write_package(tmp_path / "site", module="1 / 0")
    importlib.invalidate_caches()
    sys.modules.pop("tiny_plugins", None)
    assert clearway("report", out).refusal("asks for experiment twice of the package tiny-plugins 1.2: tiny_plugins:")


def test_a_program_s_own_experiment_is_of_no_package(first, out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = replace(EXPERIMENTS["fig3"], section=lambda setting: Section("mine", "", ""), jobs=lambda setting: [])
    scenes = sorted(first.words[1].iterdir())
    with monkeypatch.context() as program:
        program.setitem(EXPERIMENTS, "mine", own)
        reproduce.reproduce(ReproduceRequest(["mine"], out, "smoke", scenes, seeds=1, learners=["default"]))
    assert json.loads((out / "reproduction.json").read_text())["packages"] == {}
    with pytest.warns(UserWarning, match="leaves out experiment 'mine', which nothing .* run the program that made"):
        reproduce.gather(out)


def test_two_tables_of_one_name_are_refused(clearway, first, out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    named = replace(EXPERIMENTS["fig5"], section=lambda setting: replace(fig5(setting), name="fig3"))
    fig5 = EXPERIMENTS["fig5"].section
    monkeypatch.setitem(EXPERIMENTS, "fig3", named)
    answer = clearway("reproduce", "fig3", *first.words, "--learners", "default", "--out", out)
    assert answer.code == 2
    assert "error: experiments fig3 and fig5: both call one of their tables 'fig5'. Rename one" in answer.err


def test_no_experiment_is_refused(clearway, tmp_path: Path) -> None:
    assert clearway("reproduce", "--out", tmp_path / "out").refusal("no experiment", "table1", "all")
    assert not (tmp_path / "out").exists()


def test_rooms_beside_dumps_are_refused(clearway, dumps: Path, tmp_path: Path) -> None:
    answer = clearway("reproduce", "fig5", "--scenes", dumps, "--rooms", "kitchen", "--out", tmp_path / "out")
    assert answer.refusal("--rooms", "--scenes")


def test_other_frames_and_rooms_show_on_top() -> None:
    changed = BUDGETS["paper"].changed(("kitchen",), 2_000_000)
    assert (changed.frames, changed.default_frames, changed.rooms) == (2_000_000, 2_000_000, ("kitchen",))
    told = changed.warning(1)
    assert told == (
        "Less than the paper's budget: 1 of 4 scenes; 2,000,000 frames in the main experiment instead of the paper's "
        "10,000,000."
    )
    assert BUDGETS["paper"].changed() == BUDGETS["paper"]
    assert BUDGETS["paper"].changed(frames=20_000_000).warning(4) == ""  # no less than the paper's
    assert BUDGETS["paper"].changed(("kitchen", "kitchen")).rooms == ("kitchen",)


def test_a_smoke_run_of_more_frames_learns_something() -> None:
    smoke = BUDGETS["smoke"]
    for few in (None, 100, smoke.frames + 1, 99_999):
        told = f"after {few or smoke.frames:,} frames in the main experiment, before anything is learnt."
        assert smoke.changed(frames=few).warning(1).endswith(f"and judges nothing: its trainings end, {told}")
    assert "after 400 to 12,000 frames" in replace(smoke, default_frames=400).warning(1)
    assert "before anything is learnt" not in smoke.changed(frames=100_000).warning(1)
    assert smoke.changed(frames=5_000_000).warning(4) == (
        "Less than the paper's budget: 5,000,000 frames in the main experiment instead of the paper's 10,000,000; "
        "10 episodes a target instead of 100, of 500 steps at most."
    )


def test_what_learns_nothing_is_not_judged(clearway, first, out: Path, small, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reproduce, "run_jobs", lambda *_, **__: None)
    claims = (
        Claim("paper: less", "holds", "0 against 1.", p=0.01),
        Claim("paper: all", "holds", "4 of 4.", counted=True),
    )
    judging = replace(EXPERIMENTS["fig5"], section=lambda setting: Section("fig5", "Five", "", claims=claims))
    monkeypatch.setitem(EXPERIMENTS, "fig5", judging)
    words = ("reproduce", "fig5", *first.words, "--learners", "default", "--out", out, "--frames")
    few, many = clearway(*words, 99_999), clearway(*words, 100_000)
    assert [claim["verdict"] for claim in many.json["sections"][0]["claims"]] == ["holds", "holds"]
    found = few.json["sections"][0]["claims"]
    assert {(claim["verdict"], claim["p"], claim["counted"]) for claim in found} == {("undecided", None, False)}
    assert [claim["evidence"] for claim in found] == [f"{claim.evidence} Not judged: a smoke run." for claim in claims]
    assert "after 99,999 frames" in few.json["warning"]
    clearway(*words, 99_999)
    told = "- No claim is judged (2 asked): a smoke run's trainings end before anything is learnt. The tables hold"
    report = (out / "report.md").read_text()
    assert told in report and "holds" not in report


def test_requests_agree_after_a_trip_through_their_file(tmp_path: Path) -> None:
    settings = {"out": tmp_path, "budget": "paper", "rooms": ("bathroom",), "learners": ("paper",)}
    first = ReproduceRequest(names=("fig3",), frames=8, commands=("one",), **settings)
    request_file.keep_request(first)
    content = json.loads((tmp_path / request_file.REQUEST_FILE).read_text())
    second = ReproduceRequest(names=("table1",), frames=8, commands=("two",), workers=2, **settings)
    joined = request_file.with_earlier(second)
    assert (list(joined.names), joined.commands) == (["table1", "fig3"], ("one", "two"))
    other = replace(second, frames=9)
    assert request_file.with_earlier(other) == other
    fresh = replace(second, first_seed=5)
    assert request_file.with_earlier(fresh) == fresh
    spelt = replace(second, seeds=5)  # the budget's own number
    assert list(request_file.with_earlier(spelt).names) == ["table1", "fig3"]
    (tmp_path / request_file.REQUEST_FILE).write_text(json.dumps(content | {"learners": ["default", "paper"]}))
    turned = replace(second, learners=("paper", "default"))
    assert list(request_file.with_earlier(turned).names) == ["table1", "fig3"]
    (tmp_path / request_file.REQUEST_FILE).write_text(json.dumps(content | {"changes": ["lr_start=0.002", "envs=5"]}))
    assert request_file.with_earlier(second) == second
    respelt = replace(second, changes=("envs=5", "lr_start=2e-3"))
    assert list(request_file.with_earlier(respelt).names) == ["table1", "fig3"]


def test_a_report_that_takes_another_s_place_is_told(
    clearway, small, first, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reproduce, "run_jobs", lambda *_, **__: None)
    words = *first.words, "--learners", "default", "--out", out
    told = f"warning: {out} held a reproduction of fig5, seed 0; this one takes its place in the report. Its runs stay;"
    same = clearway("reproduce", "fig3", *words)
    assert same.code == 0 and "takes its place" not in same.err
    named = told.replace("fig5", "fig3, fig5")
    other = clearway("reproduce", "fig3", *words, "--seeds", 2, "--first-seed", 1)
    assert f"{named} use another --out to keep both" in other.err.splitlines()
    back = clearway("reproduce", "fig5", *words)
    assert told.replace("fig5, seed 0", "fig3, seeds 1 to 2") in back.err


def test_a_request_that_may_not_warn_leaves_the_one_before(
    dumps: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reproduce, "run_jobs", lambda *_, **__: None)
    request = ReproduceRequest(
        names=("fig3",), out=tmp_path / "out", budget="smoke", dumps=sorted(dumps.iterdir()), seeds=1
    )
    reproduce.reproduce(request)
    before = (tmp_path / "out" / request_file.REQUEST_FILE).read_bytes()
    with pytest.raises(UserWarning, match="held a reproduction of fig3, seed 0; this one takes its place"):
        reproduce.reproduce(replace(request, seeds=2))
    assert (tmp_path / "out" / request_file.REQUEST_FILE).read_bytes() == before


@pytest.mark.parametrize("stopped", ["run_jobs", "told_time", "_gathered"])
def test_who_interrupts_it_is_told_how_to_go_on(
    clearway, first, out: Path, stopped: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(reproduce, stopped, interrupted)
    gone, _ = sorted((out / "runs").iterdir())
    if stopped != "_gathered":
        shutil.rmtree(gone)
    answer = clearway("reproduce", "fig5", *first.words, "--learners", "default", "--out", out)
    done = 2 if stopped == "_gathered" else 1
    assert (answer.code, answer.out) == (130, "")
    *_, told, last = answer.err.splitlines()
    assert told == f"{out}: interrupted; {done} of 2 runs are complete. The same command goes on"
    assert last == "interrupted"


def test_seeds_begin_where_they_are_told_to(dumps: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Job] = []
    monkeypatch.setattr(reproduce, "run_jobs", lambda _, jobs, **__: asked.extend(jobs))
    request = ReproduceRequest(
        names=("fig4",), out=tmp_path, budget="smoke", dumps=sorted(dumps.iterdir()), seeds=2, first_seed=5
    )
    assert reproduce.reproduce(request).setting.seeds == (5, 6)
    assert {job.run.seed for job in asked} == {5, 6}
    assert reproduce.gather(tmp_path).setting.seeds == (5, 6)


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"budget": "papr"}, "budget='papr': expected one of smoke, paper. Did you mean paper?"),
        ({"learners": ["defualt"]}, "learners='defualt': expected one of paper, .*. Did you mean default?"),
        ({"learners": "default"}, "learners='default': expected a list"),
        ({"learners": []}, r"learners=\[\]: expected some of paper, "),
        ({"rooms": ()}, r"rooms=\(\): expected some of bathroom, "),
        ({"names": "fig3"}, "names='fig3': expected a list"),
        ({"names": []}, "names: no experiment is named"),
        ({"names": ["fig3", 3]}, "names: holds 3, expected texts"),
        ({"names": ["fig8"]}, "experiment 'fig8': no such experiment. Did you mean fig"),
        ({"changes": "lr_start=0.002"}, "changes='lr_start=0.002': expected a list"),
        ({"dumps": "hall.h5"}, "dumps='hall.h5': expected a list"),
        ({"dumps": [3]}, "dumps: holds 3, expected a path"),
        ({"out": None}, "out: holds None, expected a path"),
        ({"encoder": 7}, "encoder=7: expected a text"),
        ({"ray": True}, "ray=True: expected a text"),
        ({"seeds": 0}, "seeds=0: expected a whole number of at least 1"),
        ({"seeds": True}, "seeds=True: expected a whole number"),
        ({"first_seed": -1}, "first_seed=-1: expected a whole number of at least 0"),
        ({"first_seed": None}, "first_seed=None: expected a whole number"),
        ({"frames": 1.5}, "frames=1.5: expected a whole number"),
        ({"workers": 0}, "workers=0: expected a whole number of at least 1"),
        ({"threads": 0}, "threads=0: expected a whole number of at least 1"),
    ],
)
def test_python_is_told_what_is_wrong_and_the_folder_stays_as_it_was(
    first, out: Path, asked: dict[str, object], told: str
) -> None:
    def files() -> dict[Path, bytes]:
        return {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}

    before = files()
    scenes = sorted(first.words[1].iterdir())
    request = {"names": ["fig5"], "out": out, "budget": "smoke", "dumps": scenes, "seeds": 1, "learners": ["default"]}
    with pytest.raises(ClearwayError, match=told) as caught:
        reproduce.reproduce(ReproduceRequest(**request | asked))
    assert "\n" not in str(caught.value)
    assert files() == before


def test_an_experiment_that_nobody_offers_is_told_before_the_scenes_are_had(tmp_path: Path) -> None:
    request = ReproduceRequest(["fig5", "fig9"], tmp_path, "smoke", dumps=[tmp_path / "nowhere.h5"])
    with pytest.raises(ClearwayError, match="experiment 'fig9': no such experiment"):
        reproduce.reproduce(request)


def test_python_takes_paths_as_texts(first, out: Path) -> None:
    scenes = sorted(map(str, first.words[1].iterdir()))
    found = reproduce.reproduce(ReproduceRequest(["fig5"], str(out), "smoke", scenes, seeds=1, learners=["default"]))
    assert not found.sections[0].missing
    assert reproduce.gather(str(out)).sections == found.sections


def test_what_cannot_be_asked_of_the_scenes_is_refused_and_not_kept(
    dumps: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(setting: object) -> list[Job]:
        raise SceneError("bathroom", "no", "Leave tables 2 and 3 out")

    monkeypatch.setattr(reproduce, "run_jobs", lambda *_, **__: None)
    monkeypatch.setitem(EXPERIMENTS, "table2", replace(EXPERIMENTS["table2"], jobs=refused))
    out = tmp_path / "out"
    request = ReproduceRequest(names=("table2",), out=out, budget="smoke", dumps=sorted(dumps.iterdir()), seeds=1)
    with pytest.raises(SceneError, match="Leave tables 2 and 3 out"):
        reproduce.reproduce(request)
    found = reproduce.reproduce(replace(request, names=("fig3",)))
    assert [section.name for section in found.sections] == ["fig3"]


def test_a_reward_that_no_worker_could_import_is_refused_before_anything_is_trained(
    dumps: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A reproduction that is complete needs no worker."""
    reward = own_terms.imported(tmp_path / "turning.py", monkeypatch).REWARD
    monkeypatch.setitem(
        EXPERIMENTS, "fig3", replace(EXPERIMENTS["fig3"], jobs=lambda found: all_jobs(compared(found, (reward,))))
    )
    request = ReproduceRequest(("fig3",), tmp_path / "out", "smoke", sorted(dumps.iterdir()), seeds=1)
    monkeypatch.setattr(own_terms.sys.modules[own_terms.NAME].Turning, "__module__", "__main__")
    monkeypatch.setattr(reproduce, "run_jobs", lambda *_, **__: pytest.fail("asked for workers"))
    told = (
        "^reward few-turns: its term Turning stands in the program that was started, which worker processes cannot "
        "import. Put it into a module of its own, such as turning.py, and import it$"
    )
    for ray in (None, "local"):
        with pytest.raises(RewardError, match=told):
            reproduce.reproduce(replace(request, ray=ray))
    assert not (tmp_path / "out" / "runs").exists()
    assert not (tmp_path / "out" / request_file.REQUEST_FILE).exists()
    monkeypatch.setattr(reproduce, "is_done", lambda out, job: True)
    monkeypatch.setattr(reproduce, "run_jobs", lambda out, jobs, **_: jobs and pytest.fail("asked for workers"))
    assert reproduce.reproduce(request).jobs


def test_the_command_that_ends_last_reports_what_others_asked_for_meanwhile(
    dumps: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    request = ReproduceRequest(
        names=("fig3",), out=tmp_path / "out", budget="smoke", dumps=sorted(dumps.iterdir()), seeds=1
    )

    def another_meanwhile(*_: object, **__: object) -> None:
        monkeypatch.setattr(reproduce, "run_jobs", lambda *_, **__: None)
        reproduce.reproduce(replace(request, names=("fig5",)))

    monkeypatch.setattr(reproduce, "run_jobs", another_meanwhile)
    found = reproduce.reproduce(request)
    assert [section.name for section in found.sections] == ["fig3", "fig5"]


def test_commands_that_begin_together_lose_nothing_of_each_other(
    dumps: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    request = ReproduceRequest(
        names=("fig3",), out=tmp_path / "out", budget="smoke", dumps=sorted(dumps.iterdir()), seeds=1
    )
    read = request_file.with_earlier

    def read_slowly(request: ReproduceRequest) -> ReproduceRequest:
        found = read(request)
        time.sleep(0.3)
        return found

    monkeypatch.setattr(request_file, "with_earlier", read_slowly)
    monkeypatch.setattr(reproduce, "run_jobs", lambda *_, **__: None)
    monkeypatch.setattr(reproduce, "_gathered", lambda request, setting: request.names)
    with ThreadPoolExecutor(2) as both:
        list(both.map(reproduce.reproduce, [request, replace(request, names=("fig5",))]))
    assert json.loads((tmp_path / "out" / request_file.REQUEST_FILE).read_text())["names"] == ["fig3", "fig5"]


def test_features_of_rooms_depend_on_what_is_asked_for_not_on_what_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A random encoder is calibrated on the rooms together; another encoder's files are not taken for its own."""
    by_name = {scene.name: scene for scene in small_rooms()}
    monkeypatch.setattr(setting, "cached_room_scene", lambda name, progress: by_name[name])

    def encoded(scenes: list[Scene], encoder: str, progress: bool) -> list[Scene]:
        level = np.float32(len(scenes) + len(encoder))
        return [replace(scene, features=scene.features + level) for scene in scenes]

    monkeypatch.setattr(setting, "encode_scenes", encoded)

    def digests(encoder: str, *rooms: str) -> dict[str, str]:
        budget = BUDGETS["paper"].changed(rooms)
        found = setting.prepare(tmp_path, budget, encoder=encoder, learners=("default",))
        return {file.name: file.digest for file in found.files}

    alone = digests("random-resnet50", "bathroom")
    both = digests("random-resnet50", "bathroom", "kitchen")
    assert both["bathroom"] != alone["bathroom"]
    assert digests("random-resnet50", "bathroom") == alone
    assert digests("random-resnet50", "bathroom", "kitchen") == both
    assert digests("some/other/encoder", "bathroom") != alone


def test_options_that_would_do_nothing_are_refused(clearway, dumps: Path, tmp_path: Path) -> None:
    words = ("reproduce", "fig5", "--out", tmp_path / "out")
    assert clearway(*words, "--scenes", dumps, "--encoder", "random-resnet50").refusal("--encoder", "--scenes")
    assert clearway(*words, "--ray", "auto", "--workers", 2).refusal("--workers", "--ray auto")
    assert not (tmp_path / "out").exists()
