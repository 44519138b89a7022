"""Classes of other packages' algorithms: their settings, what is refused, and whose faults are told."""

from inspect import signature
from pathlib import Path

import pytest
import yaml

import clearway
from clearway.api.training import chosen_learner
from clearway.cli.config import with_config
from clearway.cli.main import Command
from clearway.errors import ArgumentError, PluginError, RunError
from clearway.learn.algorithms import algorithm
from clearway.learn.learner import Learner
from clearway.learn.plugged import ARGUMENTS, faults_of
from clearway.learn.ppo import PPO
from clearway.learn.settings import with_settings
from helpers.made import corridor_scene
from helpers.own_algorithm import CLASS, HEAD, OPTIONAL, SMALL, SOURCE, offer_algorithm, with_body
from helpers.small_runs import CORRIDOR_TARGETS

UNDECORATED = CLASS.replace("@dataclass(frozen=True)\n", "")
ELSEWHERE = """
class Between(QLearning):
    extra: int = 3

@dataclass(frozen=True)
class Odd(Between):
    algorithm: ClassVar[str] = "odd"
"""


@pytest.mark.parametrize(
    ("source", "told"),
    [
        ("Odd = 3", "is 3, expected a class derived from clearway.Learner"),
        ("class Odd: pass", "expected a class derived from clearway.Learner"),
        (UNDECORATED + "    extra: int = 3\n", "Odd is no dataclass, and loses its settings"),
        (ELSEWHERE, "Between is no dataclass, and loses its settings"),
        (CLASS.replace("ClassVar[str]", "str"), r"algorithm is among its settings. Write algorithm: ClassVar\[str\]"),
        (with_body('acts_on: str = "table"'), r"acts_on is among its settings. Write acts_on: ClassVar\[str\]"),
        (CLASS.replace('"odd"', '"other"'), r"its algorithm is 'other'. Write algorithm: ClassVar\[str\] = 'odd'"),
        ("@dataclass(frozen=True)\nclass Odd(clearway.Learner): pass", "its algorithm is None"),
        (with_body("layers: int = field(kw_only=True)"), "its setting layers has no default"),
        (with_body("layers: int = field(init=False, default=3)"), "its setting layers has no default, or no place"),
        (with_body("seed: int = 3"), "its setting seed has the name of an argument of clearway.train. Rename it"),
        (CLASS.replace("QLearning", "clearway.Learner"), "has no method trainer"),
        (with_body("layers: tuple[int, ...] = (3,)"), "layers is of the type tuple"),
        (with_body("level: Literal[1, 2] = 1"), "level is of the type 1 or 2, and settings are"),
        (with_body("layers: Thing | None = None"), "the type of a setting is unknown .*'Thing'"),
        (with_body("envs: int = 0"), "envs is 0, expected at least 1"),
        (with_body("def __post_init__(self): 1 / 0"), r"its class failed \(ZeroDivisionError: division by zero\)"),
    ],
)
def test_a_class_that_could_not_be_kept_is_refused_in_a_line_with_its_package(tmp_path, monkeypatch, source, told):
    offer_algorithm(tmp_path, monkeypatch, source)
    with pytest.raises(PluginError, match=f"^{SOURCE}: .*{told}") as caught:
        chosen_learner("odd")
    assert "\n" not in str(caught.value)


def test_arguments_whose_names_no_setting_can_have_are_those_of_train() -> None:
    of_train = set(signature(clearway.train).parameters)
    assert set(ARGUMENTS) == of_train - {"algorithm", "frames", "settings"}


@pytest.fixture
def optional(tmp_path, monkeypatch):
    offer_algorithm(tmp_path, monkeypatch, OPTIONAL)
    return algorithm("odd")()


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("note=x", "x"),
        ("note=null", None),
        ("note=", ""),
        ('note="null"', "null"),
        ('note=""null""', '"null"'),
        ('note="', '"'),
        ('note=""', '""'),
        ('note="x"', '"x"'),
        ('note=""null"', '""null"'),
        ("note=" + '"' * 10_000, '"' * 10_000),
        ('plain="a"', '"a"'),
        ('plain="a" or "b"', '"a" or "b"'),
        ('plain="a","b"', '"a","b"'),
        ('plain=""', '""'),
        ("plain=", ""),
        ("plain=null", "null"),
        ('limit="null"', None),
        ("limit=3", 3),
        ("limit=2.5", 2.5),
        ("limit=null", None),
        ("temperature=0.5", 0.5),
        ("temperature=2", 2.0),
        ("style=loud", "loud"),
        ("style=null", None),
    ],
)
def test_words_are_read_by_the_types_of_settings(optional, word, expected) -> None:
    name = word.partition("=")[0]
    found = getattr(with_settings(optional, [word]), name)
    assert found == expected and type(found) is type(expected)


def of_file(optional: Learner, folder: Path, name: str, value: object) -> object:
    """The value of a setting that a file gives so."""
    (folder / "set.yaml").write_text(yaml.safe_dump({"set": {name: value}}))
    *_, word = with_config(["train", "x.h5", "--config", str(folder / "set.yaml")], Command)
    return getattr(with_settings(optional, [word]), name)


TEXTS = ["null", '"null"', '""null""', '""null"', '"', '""', '"x"', '"a" or "b"', '"a","b"', "", "x", "3", " null "]


@pytest.mark.parametrize("text", TEXTS)
def test_a_run_s_settings_give_its_texts_again(optional, tmp_path, text) -> None:
    assert of_file(optional, tmp_path, "note", text) == text
    assert of_file(optional, tmp_path, "plain", text) == text


def test_null_in_a_file_is_none_and_in_quotes_where_there_is_no_text(optional, tmp_path) -> None:
    assert of_file(optional, tmp_path, "note", None) is None
    assert of_file(optional, tmp_path, "limit", None) is None
    assert of_file(optional, tmp_path, "limit", "null") is None
    assert of_file(optional, tmp_path, "plain", ["a", "null", '"b"']) == 'a,null,"b"'


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ('limit="3"', "expected a whole number or a number or null"),
        ("limit=many", "expected a whole number or a number or null"),
        ('limit=""null""', "expected a whole number or a number or null"),
        ("style=soft", "expected plain or loud or null"),
        ('style="loud"', "expected plain or loud or null"),
        ('temperature="null"', "expected a number"),
        ("temperature=null", "expected a number"),
        ("known=3", "expected name=value with a name among odd's settings"),
    ],
)
def test_words_of_no_type_are_refused(optional, word, told) -> None:
    with pytest.raises(RunError, match=f"^--set {word}: {told}"):
        with_settings(optional, [word])


def test_from_python_settings_go_by_their_types_too(optional) -> None:
    given = {"note": "x", "limit": 2.5, "temperature": 2, "style": None}
    learner = chosen_learner(optional, settings=given)
    assert (learner.note, learner.limit, learner.temperature, learner.style) == ("x", 2.5, 2.0, None)
    assert type(learner.temperature) is float
    assert chosen_learner(learner, settings={"note": None}).note is None
    for wrong, told in (({"note": 3}, "expected a text or None"), ({"style": "soft"}, "'plain' or 'loud' or None")):
        with pytest.raises(ArgumentError, match=told):
            chosen_learner(optional, settings=wrong)


def test_what_a_class_raises_of_values_is_told_as_its_fault(tmp_path, monkeypatch) -> None:
    body = "heat: int = 1\ndef __post_init__(self):\n    if self.heat > 1:\n        raise ValueError('too\\nhot')"
    offer_algorithm(tmp_path, monkeypatch, with_body(body))
    line = f"{HEAD}{with_body(body)}".partition("raise")[0].count("\n") + 1
    told = rf"^{SOURCE}: settings failed \(ValueError: too hot\) at .*/odd_learner\.py:{line}\. Ask its authors"
    for set_hot in (
        lambda: chosen_learner("odd", settings={"heat": 2}),
        lambda: with_settings(algorithm("odd")(), ["heat=2"]),
    ):
        with pytest.raises(PluginError, match=told):
            set_hot()


def test_a_run_goes_on_by_the_same_settings_alone_however_its_class_compares_them(tmp_path, monkeypatch) -> None:
    source = CLASS.replace("frozen=True", "frozen=True, eq=False")
    offer_algorithm(tmp_path, monkeypatch, f"{source}    extra: int = 3\n")
    how = {"algorithm": "odd", "out": tmp_path / "run", **SMALL}
    clearway.train(corridor_scene(5), list(CORRIDOR_TARGETS), **how)
    with pytest.raises(RunError, match="holds another experiment"):
        clearway.train(corridor_scene(5), list(CORRIDOR_TARGETS), **how, resume=True, extra=7)
    clearway.train(corridor_scene(5), list(CORRIDOR_TARGETS), **how, resume=True, extra=3)


def test_faults_of_ours_and_interruptions_pass(tmp_path, monkeypatch) -> None:
    offer_algorithm(tmp_path, monkeypatch, CLASS)
    with pytest.raises(ZeroDivisionError), faults_of(PPO, "update"):
        raise ZeroDivisionError
    for passing in (KeyboardInterrupt(), RunError("known"), MemoryError()):
        with pytest.raises(type(passing)), faults_of(algorithm("odd"), "update"):
            raise passing


def test_unknown_algorithms_are_answered_with_the_names_of_other_packages_too(tmp_path, monkeypatch) -> None:
    offer_algorithm(tmp_path, monkeypatch, CLASS)
    with pytest.raises(
        ArgumentError, match=r"no such algorithm\. Did you mean odd\? Use one of ppo, .*paper-a3c, odd$"
    ):
        chosen_learner("od")
    with pytest.raises(RunError, match=r"no such algorithm\. .*Use one of ppo, .*adapt, odd$"):
        algorithm("od")
