"""Records name the commit of the checkout that made them."""

import subprocess
from pathlib import Path

import pytest

import clearway
from clearway.errors import RunError
from clearway.learn import provenance
from clearway.learn.run_folder import RunFolder
from clearway.reward import BUMP, Arrival, Reward, Term
from helpers.made import corridor_scene
from helpers.own_algorithm import CLASS, SMALL, forget_algorithm, offer_algorithm
from helpers.plugin_package import write_package

IDENTITY = ("-c", "user.name=a", "-c", "user.email=a@b.c")


def git(folder: Path, *words: str) -> str:
    return subprocess.run(["git", "-C", str(folder), *words], capture_output=True, text=True, check=True).stdout.strip()


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A repository with one file, which has the module's place in it."""
    module = tmp_path / "src" / "clearway" / "learn" / "provenance.py"
    module.parent.mkdir(parents=True)
    module.write_text("1")
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, *IDENTITY, "commit", "-qm", "first")
    monkeypatch.setattr(provenance, "__file__", str(module))
    provenance._commit.cache_clear()
    return tmp_path


def test_a_checkout_is_named_by_its_commit(checkout: Path) -> None:
    assert provenance.package_versions()["commit"] == git(checkout, "rev-parse", "--short=10", "HEAD")


def test_a_checkout_that_was_changed_says_so(checkout: Path) -> None:
    (checkout / "src" / "clearway" / "learn" / "provenance.py").write_text("2")
    assert provenance.package_versions()["commit"].endswith("-dirty")


def test_who_has_no_git_gets_versions_alone(checkout: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    assert "commit" not in provenance.package_versions()


@pytest.mark.parametrize("where", ["vendor", "lib/site-packages"])
def test_a_package_installed_in_another_s_repository_has_no_commit(
    where: str, checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(provenance, "__file__", str(checkout / where / "clearway" / "learn" / "x.py"))
    assert "commit" not in provenance.package_versions()


class Own(Term):
    """A term that stands in this module."""


def test_packages_of_an_algorithm_and_of_a_reward_s_own_terms_are_named(tmp_path, monkeypatch) -> None:
    top = __name__.partition(".")[0]
    offers = f"[clearway.rewards]\nmine = {top}.rewards:MINE\n[clearway.algorithms]\nodd = others:Odd\n"
    monkeypatch.syspath_prepend(str(write_package(tmp_path, package="others", entry_points=offers)))
    own = Reward("mine", (Own(), Arrival()))
    assert provenance.plugin_versions("odd", own) == {"algorithm": "others 1.2", "reward": "others 1.2"}
    assert provenance.plugin_versions("ppo", BUMP) == {}


def test_a_run_says_whose_algorithm_it_needs(tmp_path, monkeypatch) -> None:
    site = offer_algorithm(tmp_path, monkeypatch, CLASS)
    scene = corridor_scene(5, feature_count=12)
    clearway.train(scene, algorithm="odd", out=tmp_path / "run", **SMALL)
    folder = RunFolder(tmp_path / "run")
    assert folder.read_record().versions["algorithm"] == "odd-learner 1.2"
    forget_algorithm(site, monkeypatch)
    told = r"run\.json: algorithm 'odd': the package odd-learner 1\.2 that offers it is not installed\. Install it$"
    with pytest.raises(RunError, match=told):
        clearway.load_agent(tmp_path / "run")
