"""`--config`: options from a file, for every command."""

import json
from pathlib import Path
from typing import Literal, get_args, get_origin

import pytest

from clearway.cli.config import _options_of, with_config
from clearway.cli.known import command_of
from clearway.cli.main import Command
from clearway.cli.train import Train
from clearway.learn.run_folder import RunFolder
from clearway.settings_file import read_settings
from helpers.own_algorithm import offer_algorithm, with_body

from .test_reading import LEAVES


@pytest.fixture
def config(tmp_path):
    def write(text: str) -> Path:
        path = tmp_path / "settings.yaml"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize("words", LEAVES, ids=" ".join)
def test_every_command_tells_of_it_and_takes_all_its_options(clearway, words):
    assert "--config PATH" in clearway(*words, "--help").out
    kind, _ = command_of(words, Command)
    for option in _options_of(kind).values():
        inner = get_args(option.kind)[0] if get_origin(option.kind) is tuple else option.kind
        assert inner in (bool, int, float, str, Path) or get_origin(inner) is Literal, option


@pytest.mark.parametrize(
    ("text", "words", "expected"),
    [
        ("frames: 6e5\nfiles: [a.h5, b.h5]", "", "a.h5 b.h5 --frames=600000"),
        ("frames: 5\nfiles: a.h5", "x.h5 --frames 7", "x.h5 --frames 7"),
        ("frames: 5", "--frames=7 x.h5", "--frames=7 x.h5"),
        ("feature-store: mapped", "x.h5 --feature_store float16", "x.h5 --feature_store float16"),
        ("feature_store: mapped", "x.h5", "x.h5 --feature-store=mapped"),
        ("resume: true", "x.h5", "x.h5 --resume"),
        ("resume: true", "x.h5 --no-resume", "x.h5 --no-resume"),
        ("resume: false", "x.h5", "x.h5 --no-resume"),
        ("alpha: -1e-2\nuntil: solved", "x.h5", "x.h5 --alpha=-1e-2 --until=solved"),
        ("files: a.h5", "--targets 26 37", "a.h5 --targets 26 37"),
        ("targets: {a: [26, 37], b: 3}", "x.h5", "x.h5 --targets a=26,37 b=3"),
        ("targets: [26, 37]", "x.h5 --targets 4", "x.h5 --targets 4"),
        ("set: {envs: 200, hindsight: true}", "x.h5 --set envs=100", "x.h5 --set envs=200 hindsight=true envs=100"),
        ("frames:\nset: {lr_end: 1.0e-05}", "x.h5", "x.h5 --set lr_end=1e-05"),
        ("set: {note: null, limit: 3}", "x.h5", "x.h5 --set note=null limit=3"),
        ("set: {note: 'null', style: x}", "x.h5", 'x.h5 --set note="null" style=x'),
        ("set: {note: [a, 'null'], plain: '\"a\"'}", "x.h5", 'x.h5 --set note=a,null plain="a"'),
        ("targets: {a: 'null'}", "x.h5", "x.h5 --targets a=null"),
    ],
)
def test_the_file_s_options_become_words_and_the_command_line_s_go_before(config, text, words, expected):
    found = with_config(["train", *words.split(), "--config", str(config(text))], Command)
    assert found == ["train", *expected.split()]


def test_the_words_between_are_shared_out(config):
    path = config("folder: runs/a\nfiles: [b.h5]\nseed: 3")
    assert with_config(["evaluate", f"--config={path}"], Command) == ["evaluate", "runs/a", "b.h5", "--seed=3"]
    found = with_config(["evaluate", "runs/x", "--seed", "4", "--config", str(path)], Command)
    assert found == ["evaluate", "runs/x", "b.h5", "--seed", "4"]
    inside = config("out: imported\nscale: 1")
    with pytest.raises(Exception, match="scale: no such option"):
        with_config(["scenes", "import", "mjcf", "x.xml", "--config", str(inside)], Command)


@pytest.mark.parametrize("words", [["--set", "width=8"], ["--set=width=8"]])
def test_single_settings_of_the_command_line_come_after_those_of_the_file(config, words):
    path = config("set: {envs: 200}")
    found = with_config(["train", "x.h5", *words, "--config", str(path)], Command)
    assert found == ["train", "x.h5", "--set", "envs=200", "width=8"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("frame: 5", "frame: no such option of this command. Did you mean frames? Correct the file"),
        ("frames: many", "frames: found 'many', expected a whole number. Correct the file"),
        ("frames: true", "frames: found True, expected a whole number"),
        ("frames: 1.5", "frames: found 1.5, expected a whole number"),
        ("alpha: [1]", "alpha: found a list, expected a number"),
        ("resume: 1", "resume: found 1, expected true or false"),
        ("reward: no", "reward: found False, expected a text, in quotes"),
        ("until: soled", "until: found 'soled', expected one of solved. Did you mean solved? Correct the file"),
        ("targets: [[1]]", "targets: found a list, expected a text"),
        ("files: {a: 1}", "files: found a mapping, expected a list"),
        ("targets: [--out]", "targets: found '--out', which reads as an option"),
        ("feature-store: memory\nfeature_store: memory", "occurs twice, once with _ and once with -"),
        ("config: other.yaml", "config: no such option"),
    ],
)
def test_a_fault_is_one_line_with_file_and_key(clearway, config, text, told):
    path = config(text)
    assert clearway("train", "x.h5", "--config", path).refusal(f"{path}: ", told)


def test_faults_of_the_option_itself(clearway, config, tmp_path):
    assert clearway("train", "x.h5", "--config").refusal("--config: expected a file")
    assert clearway("train", "--config", tmp_path / "none.yaml").refusal("none.yaml: not readable")
    assert clearway("train", "--config", config("seed: 1"), "--config=b").refusal("--config: given twice")
    assert clearway("train", "x.h5", "--confg", "a").refusal("Did you mean --config?")


def same(one: Path, other: Path) -> bool:
    """Both runs have the same settings, figures but for the time, and weights."""
    first, second = RunFolder(one), RunFolder(other)
    figures = [[{**row, "seconds": 0} for row in run.metrics()] for run in (first, second)]
    weights = [sorted(run.checkpoints.glob("*/network.safetensors"))[-1].read_bytes() for run in (first, second)]
    return (
        first.read_record().same_experiment(second.read_record())
        and figures[0] == figures[1]
        and weights[0] == weights[1]
    )


def test_a_run_is_repeated_by_its_settings(clearway, trained, small, tmp_path):
    one, other, third = tmp_path / "one", tmp_path / "other", tmp_path / "third"
    words = ("--targets", 26, 37, "--reward", "bump", "--alpha", "-0.02", "--seed", 3, "--preset", "paper")
    assert clearway("train", trained.scene, "--out", one, *words, *small).code == 0
    assert clearway("train", "--config", one / "run.yaml", "--out", other).code == 0
    assert same(one, other)
    assert read_settings(one / "run.yaml") == read_settings(other / "run.yaml")
    settings = read_settings(one / "run.yaml")
    assert (settings["algorithm"], settings["reward"], settings["alpha"]) == ("a2c", "bump", -0.02)
    assert "out" not in settings and settings["set"]["optimiser"] == "rmsprop"
    assert clearway("train", "--config", one / "run.yaml", "--out", third, "--seed", 4, "--set", "width=8").code == 0
    record = RunFolder(third).read_record()
    assert (record.seed, record.learner.width, record.learner.optimiser) == (4, 8, "rmsprop")
    assert not same(one, third)


@pytest.mark.parametrize("words", [(), ("--set", "note=x", "goals=4", "temperature=0.5")])
def test_a_run_of_another_package_s_algorithm_is_repeated_by_its_settings(
    clearway, trained, tmp_path, monkeypatch, words
):
    offer_algorithm(tmp_path, monkeypatch, with_body("goals: int = 3\nnote: str | None = None\ntemperature: float = 1"))
    one, other, small = tmp_path / "one", tmp_path / "other", ("--frames", 400, "--algorithm", "odd")
    assert clearway("train", trained.scene, "--out", one, *small, *words).code == 0
    assert clearway("train", "--config", one / "run.yaml", "--out", other).code == 0
    assert RunFolder(one).read_record().same_experiment(RunFolder(other).read_record())
    assert RunFolder(one).read_record().learner.note == ("x" if words else None)


REWARD = "from clearway.reward import Reward, Time, Arrival\nMINE = Reward('mine', (Time(-0.03), Arrival(5.0)))\n"


def test_a_reward_of_one_s_own_is_named_as_it_was(clearway, trained, small, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "own_reward_of_config.py").write_text(REWARD)
    words = ("--reward", "own_reward_of_config:MINE", "--alpha", "-0.5")
    assert clearway("train", trained.scene, "--out", "one", *words, *small).code == 0
    assert read_settings(Path("one/run.yaml"))["reward"] == "own_reward_of_config:MINE"
    assert clearway("train", "--config", "one/run.yaml", "--out", "other").code == 0
    assert same(Path("one"), Path("other"))


def test_json_answers_come_by_the_file_too(clearway, trained, config):
    path = config(f"folder: {json.dumps(str(trained.run))}\nepisodes: 2\nstep_limit: 20\njson: true")
    assert clearway("evaluate", "--config", path).json["step_limit"] == 20


def test_a_file_s_words_reach_the_command(clearway, config, monkeypatch):
    read = []
    monkeypatch.setattr(Train, "run", lambda command: read.append(command))
    assert clearway("train", "--config", config("files: [x.h5]\nframes: 1e6\nalpha: -2e-2\nresume: true")).code == 0
    (command,) = read
    assert (command.files, command.frames, command.resume) == ((Path("x.h5"),), 1_000_000, True)
    assert command.parameters.alpha == -0.02
