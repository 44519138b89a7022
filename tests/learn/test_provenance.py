"""Records name the commit of the checkout that made them."""

import subprocess
from pathlib import Path

import pytest

from clearway.learn import provenance

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
