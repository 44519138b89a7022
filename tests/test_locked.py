"""The pinned packages, locked/*.txt: whole, of one mind, for every Python promised; and what the scripts install."""

import ast
import os
import re
import subprocess
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, distribution, packages_distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name
from packaging.version import Version

from helpers.documents import ROOT
from helpers.locked import pins

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]
LOCKED = ["dev", "serve", "view"]


def wanted(extra: str) -> list[Requirement]:
    """What an extra asks for, the package's own needs among it."""
    found = [Requirement(line) for line in [*PROJECT["dependencies"], *EXTRAS[extra]]]
    inner = [requirement for requirement in found if requirement.name == PROJECT["name"]]
    rest = [requirement for requirement in found if requirement.name != PROJECT["name"]]
    return rest + [one for requirement in inner for other in requirement.extras for one in wanted(other)]


@pytest.mark.parametrize("name", [*LOCKED, "torch", "cuda", "torch-cpu"])
def test_every_package_has_its_hashes(name: str) -> None:
    assert [package for package, (_, hashes) in pins(name).items() if not hashes] == []


@pytest.mark.parametrize("extra", LOCKED)
def test_what_the_project_asks_for_is_pinned_in_a_version_that_suits(extra: str) -> None:
    found = pins(extra) | pins("torch")
    missing = [str(one) for one in wanted(extra) if canonicalize_name(one.name) not in found]
    assert not missing, "run scripts/lock"
    refused = [str(one) for one in wanted(extra) if found[canonicalize_name(one.name)][0] not in one.specifier]
    assert not refused, "run scripts/lock"


def test_the_files_are_of_one_mind() -> None:
    largest = pins("dev")
    for extra in LOCKED:
        assert pins(extra).items() <= largest.items()
    cuda = [name for name in largest if name == "torch" or re.match("nvidia-|cuda-|triton", name)]
    assert cuda == []
    assert pins("torch-cpu")["torch"][0] == f"{pins('torch')['torch'][0]}+cpu"


def test_pinned_packages_run_on_the_oldest_python_promised() -> None:
    oldest = Version("3.11.0")  # Debian has 3.11.2
    assert oldest in SpecifierSet(PROJECT["requires-python"])
    assert Version("3.10.99") not in SpecifierSet(PROJECT["requires-python"])
    looked_at, refusing = 0, []
    for name, (version, _) in pins("dev").items():
        try:
            found = distribution(name)
        except PackageNotFoundError:  # for another system
            continue
        python = found.metadata["Requires-Python"]
        if found.version == version and python:
            looked_at += 1
            if oldest not in SpecifierSet(python):
                refusing.append(f"{name}=={version} wants {python}")
    assert not refusing
    assert looked_at > 100


def test_every_import_of_another_package_is_a_declared_dependency() -> None:
    extras = [Requirement(line) for lines in EXTRAS.values() for line in lines]
    declared = {canonicalize_name(one.name) for one in [*map(Requirement, PROJECT["dependencies"]), *extras]}
    of_module = packages_distributions()
    unknown = set()
    for path in (ROOT / "src").rglob("*.py"):
        for module in imported(path) - set(sys.stdlib_module_names) - {PROJECT["name"]}:
            names = {canonicalize_name(name) for name in of_module.get(module, [module])}
            if not names & declared:
                unknown.add((path.name, module))
    assert not unknown


def imported(path: Path) -> set[str]:
    """The outermost names of the modules that a file imports, wherever in it."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names.add(node.module)
    return {name.partition(".")[0] for name in names}


PYTHON = """#!/bin/sh
case "$*" in
*"-m venv "*) mkdir -p "$3/bin" && cp "$0" "$3/bin/python" ;;
*"-m pip "*) echo "$*" >>pip.log; case "$*" in *torch-cpu*) exit "$NO_INDEX" ;; esac ;;
esac
"""


def installed(
    folder: Path, extra: str, gpu: bool = False, index: bool = True, system: str = "Linux"
) -> list[list[str]]:
    """Which lists scripts/setup installs, call by call, beside a Python that only writes down what it is asked."""
    programs = folder / "programs"
    programs.mkdir(exist_ok=True)
    made = {
        "python3.13": PYTHON,
        "nvidia-smi": f"#!/bin/sh\nexit {int(not gpu)}\n",
        "uname": f"#!/bin/sh\necho {system}\n",
    }
    for name, text in made.items():
        (programs / name).write_text(text)
        (programs / name).chmod(0o755)
    for name in ("scripts", "locked", "pyproject.toml"):
        if not (folder / name).exists():
            (folder / name).symlink_to(ROOT / name)
    subprocess.run(
        ["sh", "-euc", f"extra={extra}; . scripts/setup"],
        cwd=folder,
        check=True,
        env={"PATH": f"{programs}:{os.environ['PATH']}", "MUJOCO_GL": "egl", "NO_INDEX": str(int(not index))},
    )
    log = folder / "pip.log"
    calls = log.read_text().splitlines() if log.exists() else []
    log.unlink(missing_ok=True)
    lists = [re.findall(r"locked/([\w-]+)\.txt", call) for call in calls if "--editable" not in call]
    assert all("--require-hashes" in call for call in calls if "--editable" not in call)
    return lists


def test_without_an_nvidia_gpu_the_small_build_is_installed(tmp_path: Path) -> None:
    assert installed(tmp_path, "view") == [["torch-cpu"], ["view"]]


def test_with_an_nvidia_gpu_the_build_with_cuda_is_installed(tmp_path: Path) -> None:
    assert installed(tmp_path, "dev", gpu=True) == [["torch", "cuda"], ["dev"]]


def test_without_the_small_build_s_index_pypi_s_is_installed_and_its_size_said(tmp_path: Path, capfd) -> None:
    assert installed(tmp_path, "view", index=False) == [["torch-cpu"], ["torch", "cuda"], ["view"]]
    assert "5 GB" in capfd.readouterr().err


def test_other_systems_have_one_build(tmp_path: Path) -> None:
    assert installed(tmp_path, "view", system="Darwin") == [["torch"], ["view"]]


def test_nothing_is_installed_twice_and_the_larger_extra_serves_the_smaller(tmp_path: Path) -> None:
    assert installed(tmp_path, "view") and installed(tmp_path, "view") == []
    assert installed(tmp_path, "dev") == [["torch-cpu"], ["dev"]]
    assert installed(tmp_path, "view") == []
