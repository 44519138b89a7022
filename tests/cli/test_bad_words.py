"""Words that a command cannot use: one line that says which and what to do, exit code 2."""

import os

import pytest

from clearway.cli.parse import one_line
from clearway.learn.checkpoint import newest_checkpoint
from helpers.small_demo import still


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        ((), ("demo", "scenes", "clearway --help")),
        (("dance",), ("dance", "evaluate", "clearway --help")),
        (("scenes",), ("build", "import", "inspect")),
        (("scenes", "inspect"), ("Missing from clearway scenes inspect: PATH",)),
        (("scenes", "build", "--room", "attic", "--out", "x"), ("attic", "bathroom")),
        (("scenes", "build"), ("--out",)),
        (("train", "x.h5", "--out"), ("--out", "Missing value")),
        (("train", "x.h5", "--out", "run", "--nope", "3"), ("--nope",)),
        (("train", "x.h5", "--out", "run", "--alpha", "low"), ("--alpha", "'low'")),
        (
            ("train", "x.h5", "--out", "run", "--frames", "1.5"),
            ("--frames", "'1.5'", "such as 600000 or 6e5"),
        ),
        (("trian", "x.h5"), ("trian", "Did you mean train?")),
        (("scenes", "inspct", "x.h5"), ("inspct", "Did you mean inspect?")),
        (("scenes", "import", "imges"), ("imges", "Did you mean images?")),
        (("train", "x.h5", "--out", "run", "--framse", "3"), ("--framse", "Did you mean --frames?")),
        (("train", "x.h5", "--out", "run", "--aplha=3"), ("--aplha=3", "Did you mean --alpha?")),
        (("evaluate", "run", "--episode", "3"), ("options: --episode, 3. Did you mean --episodes?",)),
        (("view", "run", "--scene", "kitchen"), ("options: --scene, kitchen. Did you mean --scenes?",)),
        (("scenes", "build", "--room", "bathrom", "--out", "x"), ("Did you mean bathroom?", "'kitchen', 'all')")),
        (("train", "x.h5", "--out", "run", "--preset", "best"), ("best", "paper")),
        (("evaluate", "run", "--episodes", "many"), ("--episodes", "'many'")),
    ],
    ids=" ".join,
)
def test_words_that_the_parser_cannot_read(clearway, words, parts):
    line = clearway(*words).refusal(*parts)
    assert "│" not in line and "─" not in line


def test_a_refusal_in_colours_is_one_plain_line():
    framed = "\x1b[31m╭─ Bad ──╮\x1b[0m\n│ \x1b[1mFirst\x1b[0m,   │\n│ still. │\n│ ────── │\n│ See x  │\n╰────────╯\n"
    assert one_line(framed) == "First, still. See x"


def test_a_refusal_without_a_frame_is_one_line_too():
    framed = " Bad         \n -------------\n  First,     \n  still.     \n  -----------\n  See --help \n"
    assert one_line(framed) == "First, still. See --help"


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("--set", "colour=blue"), ("--set colour=blue", "rollout_steps")),
        (("--set", "envs"), ("--set envs", "name=value")),
        (("--set", "envs=many"), ("--set envs=many",)),
        (("--set", "envs=20", "clip_rewards=maybe"), ("clip_rewards=maybe", "true or false")),
        (("--set", "algorithm=magic"), ("algorithm=magic", "default's settings")),
        (("--set", "discount=1.5"), ("discount is 1.5",)),
        (("--set", "rolout_steps=8"), ("--set rolout_steps=8", "Did you mean rollout_steps?")),
        (("--set", "envs=2.5"), ("--set envs=2.5", "a whole number")),
        (("--reward", "colision_aware"), ("colision_aware", "Did you mean collision-aware?")),
        (("--algorithm", "pppo"), ("pppo", "Did you mean ppo?")),
        (("--targets", "bathrom_02=26"), ("bathrom_02", "Did you mean bathroom_02?")),
        (("--perturb", "ligth"), ("ligth", "Did you mean light?")),
        (("--algorithm", "dqn"), ("--algorithm 'dqn': no such algorithm", "a3c", "paper-a3c")),
        (("--algorithm", "paper", "--preset", "paper-a3c"), ("--algorithm paper is a preset itself",)),
        (("--alpha", "nan"), ("--alpha is nan",)),
        (("--terminal", "inf"), ("--terminal is inf",)),
        (("--frames", "-5"), ("frames is -5",)),
        (("--feature-basis", "-1"), ("feature_basis is -1",)),
        (("--seed", "-1"), ("--seed -1: expected", "0 to 2147483647")),
        (("--seed", str(2**31)), ("--seed 2147483648: expected",)),
        (("--threads", "0"), ("--threads 0: expected", "from 1 on")),
        (("--device", "abacus"), ("device abacus",)),
        (("--targets", "bathroom_02=x"), ("--targets bathroom_02=x", "state numbers")),
        (("--targets", "26,,37"), ("--targets 26,,37", "state numbers")),
        (("--targets", "attic=26"), ("targets: no scene 'attic' is given", "bathroom_02")),
        (("--targets", "26", "bathroom_02=37"), ("--targets 26 bathroom_02=37", "in each, or in none")),
        (("--targets", "76"), ("bathroom_02", "target 76 is out of range", "0 to 75")),
        (("--targets", "-1"), ("targets['bathroom_02']=-1: expected a whole number from 0 on",)),
        (("--targets", "26", "26"), ("named twice",)),
    ],
    ids=" ".join,
)
def test_training_that_cannot_be(clearway, trained, tmp_path, words, parts):
    assert clearway("train", trained.scene, "--out", tmp_path / "run", *words).refusal(*parts)
    assert not list(tmp_path.iterdir())


def test_targets_that_leave_open_which_scene(clearway, dump, tmp_path):
    files = [dump(tmp_path / f"{name}.h5") for name in ("one", "two")]
    answer = clearway("train", *files, "--out", tmp_path / "run", "--targets", "26")
    assert answer.refusal("--targets 26", "several scenes", "SCENE=26")


@pytest.mark.parametrize(
    "words",
    [
        ("train", "FILE", "--out", "run"),
        ("scenes", "import", "thor-v1", "FILE", "--out", "x"),
        ("scenes", "inspect", "FILE"),
        ("oracle", "FILE"),
        ("evaluate", "FILE"),
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_missing_files_and_empty_folders(clearway, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    for name in ("missing.h5", "empty"):
        assert clearway(*(name if word == "FILE" else word for word in words)).refusal(name)
    assert os.listdir() == ["empty"]


def test_no_file_at_all(clearway, tmp_path):
    assert clearway("train", "--out", tmp_path / "run").refusal("no scene file given")


def test_a_folder_of_several_files_is_not_one_scene(clearway, dump, tmp_path):
    for name in ("one", "two"):
        dump(tmp_path / f"{name}.h5")
    assert clearway("scenes", "inspect", tmp_path).refusal(str(tmp_path), "2 scene files", "one.h5")


def test_all_rooms_need_a_folder(clearway, tmp_path):
    path = tmp_path / "rooms.h5"
    assert clearway("scenes", "build", "--room", "all", "--out", path).refusal(str(path), "four files", "--out")
    assert not path.exists()


def test_no_other_file_is_lost_to_a_scene(clearway, trained, tmp_path):
    notes = tmp_path / "notes.csv"
    notes.write_text("mine")
    assert clearway("scenes", "export", trained.scene, "--out", notes).refusal("notes.csv", ".h5 or .hdf5", "--out")
    answer = clearway("scenes", "build", "--room", "bathroom", "--out", notes)
    assert answer.refusal("notes.csv", "no scene's", "Give a folder")
    assert notes.read_text() == "mine"


def test_a_scene_that_is_replaced_is_told_of(clearway, trained, tmp_path):
    words = ("scenes", "export", trained.scene, "--out", tmp_path / "again.h5")
    assert [" ".join(clearway(*words).err.split()).endswith("replaces the scene that was there") for _ in range(2)] == [
        False,
        True,
    ]


@pytest.mark.parametrize("words", [("--seed", "-1"), ("--encoder-seed", "-1")], ids=" ".join)
def test_rooms_have_no_negative_seed(clearway, tmp_path, words):
    answer = clearway("scenes", "build", "--room", "bathroom", "--out", tmp_path / "x.h5", *words)
    assert answer.refusal(f"{words[0]} is -1")


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("--episodes", "0"), "--episodes 0: expected"),
        (("--step-limit", "-3"), "--step-limit -3: expected"),
        (("--seed", "-1"), "--seed -1: expected"),
        (("--checkpoint", "nowhere"), "nowhere"),
        (("--scenes", "nowhere"), "nowhere"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_evaluation_that_cannot_be(clearway, trained, words, part):
    assert clearway("evaluate", trained.run, *words).refusal(part)


def test_a_checkpoint_of_another_run_is_one_line_too(clearway, trained, tmp_path, small):
    wider = tmp_path / "wider"
    assert clearway("train", trained.scene, "--out", wider, *small, "width=24").code == 0
    checkpoint = newest_checkpoint(wider / "checkpoints")
    assert clearway("evaluate", trained.run, "--checkpoint", checkpoint).refusal(str(checkpoint), "not a checkpoint of")


def test_places_that_cannot_be_written_to(clearway, trained, dump, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("not a folder")
    below = tmp_path / "file" / "below"
    source = dump(tmp_path / "attic.h5")
    evaluate = ("evaluate", trained.run, "--episodes", 1, "--step-limit", 5)
    assert clearway("scenes", "inspect", trained.scene, "--map", below).refusal(str(tmp_path / "file"))
    assert clearway("scenes", "import", "thor-v1", source, "--out", below).refusal(str(tmp_path / "file"))
    assert clearway("train", trained.scene, "--out", below).refusal(str(tmp_path / "file"))
    assert clearway(*evaluate, "--pictures", below).refusal(str(tmp_path / "file"))
    monkeypatch.setattr("clearway.examples.contrast.contrast", still)
    assert clearway("demo", "--out", below).refusal(str(tmp_path / "file"))


def test_a_scene_is_not_written_over_by_a_map_or_an_exported_agent(clearway, trained):
    before = trained.scene.read_bytes()
    assert clearway("scenes", "inspect", trained.scene, "--map", trained.scene).refusal(".h5", "ends in .png", "--map")
    assert clearway("export", trained.run, "--no-encoder", "--out", trained.scene).refusal(
        ".h5", "ends in .onnx", "--out"
    )
    assert trained.scene.read_bytes() == before


@pytest.mark.parametrize(
    "words", [("--encoder-seed", 3), ("--workers", 2), ("--ray", "local")], ids=lambda words: words[0]
)
def test_flags_of_encoding_need_something_to_encode(clearway, dump, tmp_path, words):
    out = tmp_path / "out"
    answer = clearway("scenes", "import", "thor-v1", dump(tmp_path / "attic.h5"), "--out", out, *words)
    assert answer.refusal(words[0], "--encoder is not given")
    assert not out.exists()
    plan = tmp_path / "plan.txt"
    plan.write_text("...\n...\n...\n")
    answer = clearway("scenes", "import", "floor-plan", plan, "--out", out, "--features", 8, *words)
    assert answer.refusal(words[0], "--features makes features up")
    assert not out.exists()


def test_no_rooms_are_made_for_an_agent_that_knows_its_own_alone(clearway, trained, monkeypatch):
    monkeypatch.setattr("clearway.api.generation.generate", lambda *_, **__: pytest.fail("made"))
    for words in ((), ("--live",), ("--live", "--goals", 2)):
        asked = clearway("evaluate", trained.run, "--rooms", "validation", *words)
        assert asked.refusal("--rooms: an agent of the algorithm ppo walks in its own alone", "generalist")
    assert clearway("evaluate", "nowhere", "--rooms", "validation", "--live").refusal("nowhere: no run here")
    assert clearway("evaluate", "generalist", "--rooms", "train", "--live", "--goals", 0).refusal("--goals 0")


def test_flags_of_the_live_evaluation_that_say_nothing(clearway, trained):
    assert clearway("evaluate", trained.run, "--live", "--strengths", "0.25").refusal("--strengths", "Add --sweep")
    assert clearway("evaluate", trained.run, "--live", "--targets").refusal("--targets", "Leave it out with --live")
    assert clearway("evaluate", trained.run, "--selection", "argmax").refusal("--selection", "Add --live")
    assert clearway("evaluate", trained.run, "--light", 0.1).refusal("--light: walks off the grid", "Add --live")


@pytest.mark.parametrize(
    ("kind", "what"), [("savn", "folder"), ("avd", "folder"), ("ai2thor", "room"), ("miniworld", "environment")]
)
def test_imports_of_nothing(clearway, tmp_path, kind, what):
    assert clearway("scenes", "import", kind, "--out", tmp_path / "out").refusal(f"no {what} given. Name at least one")


def test_a_scene_is_no_run_and_a_folder_no_scene(clearway, trained, tmp_path):
    assert clearway("evaluate", trained.scene).refusal(str(trained.scene), "no run here")
    assert clearway("scenes", "export", trained.scene.parent, "--out", tmp_path / "x.h5").refusal(
        "a folder. Name one scene"
    )
