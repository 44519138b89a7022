"""Experiments of other packages: what they give is checked, what they raise is told as their fault."""

import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from clearway.api.training import chosen_learner
from clearway.errors import PluginError, RunError, SceneError
from clearway.experiments.catalogue import experiment, in_order
from clearway.experiments.groups import compared
from clearway.experiments.navigation_tables import navigation_tables
from clearway.reward import COLLISION_AWARE
from helpers.own_algorithm import SOURCE, offer_algorithm, with_body
from helpers.plugin_package import write_package
from helpers.small_setting import small_setting

MADE = """
from clearway.experiments.experiment import Experiment
from clearway.experiments.section import Claim, ReportFigure, ReportMap, ReportTable, Section
def table(name): return ReportTable(name, "Seeds", ("seed",), ((1,),))
def drawn(**parts): return lambda setting: Section("odd", "", "", **parts)
"""


@pytest.fixture
def offered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Offers what an expression makes as the experiment odd."""

    def offer(made: str):
        folder = tmp_path / "site"
        entry_points = "[clearway.experiments]\nodd = others:Made\n"
        write_package(folder, package="others", module=f"{MADE}Made = {made}\n", entry_points=entry_points)
        monkeypatch.syspath_prepend(str(folder))
        return experiment("odd")

    sys.modules.pop("others", None)
    yield offer
    sys.modules.pop("others", None)


@pytest.mark.parametrize(
    ("made", "part"),
    [
        ("3", "is 3, expected an Experiment"),
        ("Experiment(lambda setting: 1 / 0, None)", r"jobs failed \(ZeroDivisionError: division by zero\)"),
        ("Experiment(lambda setting: None, None)", r"jobs failed \(TypeError"),
        ("Experiment(lambda setting: [7], None)", "jobs gives 7, expected jobs"),
        ("Experiment(lambda setting: [], lambda setting: setting.nothing)", r"section failed \(AttributeError"),
        ("Experiment(lambda setting: [], lambda setting: 7)", "section gives 7, expected a Section"),
        ("Experiment(lambda s: [], lambda s: __import__('sys').exit(0))", r"section failed \(SystemExit: 0\)"),
        ("Experiment(lambda s: [], lambda s: Section('fig5', '', ''))", "its section is called 'fig5', expected 'odd'"),
        ("Experiment(lambda s: [], lambda s: Section('odd', 7, ''))", "its section has 7 where a text is expected"),
        (
            "Experiment(lambda s: [], drawn(unjudged=7))",
            "its section has 7 where a text is expected",
        ),
        (
            "Experiment(lambda s: [], lambda s: Section('odd', '', '', 7))",
            "its section's tables are 7, expected a tuple of Rep",
        ),
        (
            "Experiment(lambda s: [], lambda s: Section('odd', '', '', claims=('it holds',)))",
            r"its section's claims are \('it holds',\), expected a tuple of Claim",
        ),
        ("Experiment(lambda s: [], lambda s: Section('odd', '', '', (table(3),)))", "no file can be called 3"),
        (
            "Experiment(lambda s: [], lambda s: Section('odd', '', '', (table('../a'),)))",
            r"no file can be called '\.\./a', as a table or figure is",
        ),
        (
            "Experiment(lambda s: [], drawn(claims=(Claim('it is better', 'holds', 'seen'),)))",
            "its claim 'it is better' has a verdict, and neither p nor that it was counted",
        ),
        (
            "Experiment(lambda s: [], drawn(claims=(Claim('it is better', 'Holds', 'seen', p=0.01),)))",
            "its claim 'it is better' has verdict 'Holds' and p 0.01, expected one of holds, ",
        ),
        (
            "Experiment(lambda s: [], drawn(claims=(Claim('it is better', 'holds', 'seen', p='0.01'),)))",
            "its claim 'it is better' has verdict 'holds' and p '0.01', expected one of holds, .*from 0 to 1 or None",
        ),
        (
            "Experiment(lambda s: [], drawn(claims=(Claim('it is better', 'holds', 'seen', p=float('nan')),)))",
            "its claim 'it is better' has verdict 'holds' and p nan, expected one of holds, ",
        ),
        (
            "Experiment(lambda s: [], drawn(figures=(ReportFigure('a', 'A', 'x', 'y', ()),)))",
            "its figure 'a' has no series",
        ),
        (
            "Experiment(lambda s: [], drawn(maps=(ReportMap('a', 'A', 'attic', 0, {}),)))",
            "it has a map of 'attic', expected one of bathroom, kitchen",
        ),
    ],
)
def test_what_cannot_be_used_is_told_with_the_package(offered, tmp_path: Path, made: str, part: str) -> None:
    setting = small_setting(tmp_path, seeds=1)
    with pytest.raises(PluginError, match=rf"experiment odd of the package others 1\.2: {part}") as caught:
        found = offered(made)
        found.jobs(setting)
        found.section(setting)
    assert "\n" not in str(caught.value)


def test_a_fault_is_told_with_its_innermost_line_in_the_package(offered, tmp_path: Path) -> None:
    """Not the line of the standard library that raises it, nor the one further out that called."""
    calls = "(lambda text:\n__import__('json').loads(text))"  # the second line calls
    found = offered(f"Experiment(lambda setting: [], lambda setting:\n{calls}(''))")
    line = MADE.count("\n") + 3
    file = re.escape(str(tmp_path / "site" / "others.py"))
    with pytest.raises(
        PluginError, match=rf"section failed \(JSONDecodeError: .*\) at {file}:{line}\. Ask its authors"
    ):
        found.section(small_setting(tmp_path, seeds=1))
    sys.modules.pop("others")
    with pytest.raises(PluginError, match=rf"cannot be imported \(NameError: .*\) at {file}:{line - 2}\. Ask its"):
        (tmp_path / "site" / "others.py").write_text("\n" * (line - 3) + "Made = nothing\n")
        experiment("odd")


def test_a_fault_that_is_not_raised_in_the_package_names_no_line(offered, tmp_path: Path) -> None:
    found = offered("Experiment(lambda setting: None, None)")
    with pytest.raises(PluginError, match=r"jobs failed \(TypeError: .*\)\. Ask its authors"):
        found.jobs(small_setting(tmp_path, seeds=1))


def test_a_learner_of_a_package_that_fails_at_its_reward_is_told_of_by_the_tables(tmp_path: Path, monkeypatch) -> None:
    offer_algorithm(tmp_path, monkeypatch, with_body("def paid(self, reward): 1 / 0"))
    setting = replace(small_setting(tmp_path, seeds=1), learners={"odd": chosen_learner("odd")})
    groups = compared(setting, (COLLISION_AWARE,))
    with pytest.raises(PluginError, match=rf"^{SOURCE}: paid failed \(ZeroDivisionError: division by zero\) at "):
        navigation_tables("odd", "Odd", setting, setting.targets, groups, {})


def test_errors_of_ours_pass(offered, tmp_path: Path) -> None:
    module = "__import__('clearway').errors.SceneError('hall.h5', 'has no features', 'Encode it')"
    found = offered(f"Experiment(lambda setting: (_ for _ in ()).throw({module}), None)")
    with pytest.raises(SceneError, match=r"hall\.h5: has no features\. Encode it"):
        found.jobs(small_setting(tmp_path, seeds=1))


def test_names_stand_in_the_order_of_the_report() -> None:
    assert in_order({"twice", "fig5", "alike", "table1"}) == ["table1", "fig5", "alike", "twice"]
    with pytest.raises(RunError, match=r"experiment 'fig9': no such experiment\. Did .* Use one of table1, .*off-grid"):
        experiment("fig9")
