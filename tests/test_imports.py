"""Data flows one way: a module imports only from its own folder or from what stands before it in `ORDER`."""

import ast
from pathlib import Path

import pytest

import clearway
from helpers.imported import imported_by

ORDER = (
    {
        "version",
        "errors",
        "choices",
        "files",
        "plugins",
        "markdown",
        "own_code",
        "colours",
        "progress",
        "regular_files",
        "children",
        "ray_cluster",
        "remote",
        "settings_file",
        "spelling",
        "spread",
        "terminal",
        "torch_device",
        "torch_threads",
    },
    {"scenes"},
    {"rooms"},
    {"importers"},
    {"perception"},
    {"generation"},
    {"zones"},
    {"clearance"},
    {"reward"},
    {"world"},
    {"envs"},
    {"model"},
    {"mapping"},
    {"agents"},
    {"learn"},
    {"evaluation"},
    {"live"},
    {"live_envs"},
    {"views"},
    {"pretraining"},
    {"experiments"},
    {"deploy"},
    {"viz"},
    {"web"},
    {"view"},
    {"examples"},
    {"serve"},
    {"api", "gymnasium_hook"},
    {"cli"},
    {"__main__"},
)
PACKAGE = Path(clearway.__file__).parent
MODULES = sorted(PACKAGE.rglob("*.py"))


def part_of(path: Path) -> str:
    """The folder or module right under the package, for example "envs" or "zones"."""
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def rank(part: str) -> int:
    ranks = [place for place, parts in enumerate(ORDER) if part in parts]
    assert ranks, f"clearway.{part} has no place in the order of imports: add it to ORDER in this test"
    return ranks[0]


def imported_parts(source: str, module: str) -> set[str]:
    """Parts of clearway that a module imports anywhere in its source, inside functions too."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module} imports relatively; write the whole name"
            # `from clearway import x` may name a module or what the package's __init__ offers
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        parts = [name.split(".") for name in names]
        found |= {part[1] for part in parts if part[0] == "clearway" and len(part) > 1}
    return {"version" if part == "__version__" else part for part in found}


def test_imports_are_found_wherever_they_stand() -> None:
    source = """
import clearway.learn.rollout
from clearway import __version__, zones
def f():
    from clearway.cli.main import main
"""
    assert imported_parts(source, "source") == {"learn", "version", "zones", "cli"}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_point_backwards(path: Path) -> None:
    imported = imported_parts(path.read_text(encoding="utf-8"), path.name)
    if path == PACKAGE / "__init__.py":
        offered = {home.split(".")[1] for home in clearway._HOME.values()}  # loaded once asked for: tests/test_door.py
        assert imported <= {"version", "gymnasium_hook"} | offered
        return
    here = part_of(path)
    forward = sorted(part for part in imported if part != here and rank(part) >= rank(here) and rank(here) > 0)
    assert not forward, f"clearway.{here} imports {forward}, which come after it or stand beside it"


WITHOUT_TORCH = (
    "clearway.agents.agent",
    "clearway.agents.chance",
    "clearway.agents.memory",
    "clearway.agents.selection",
    "clearway.deploy.agent",
    "clearway.deploy.navigator",
    "clearway.deploy.onnx_file",
    "clearway.world.randomness",
)


@pytest.mark.parametrize("module", WITHOUT_TORCH)
def test_what_a_robot_imports_needs_no_torch(module: str) -> None:
    loaded = imported_by(f"import {module}")
    assert module in loaded
    assert not loaded & {"torch", "scipy", "h5py", "gymnasium", "transformers", "onnx", "onnxruntime"}


@pytest.mark.slow
def test_a_module_that_needs_torch_would_be_noticed() -> None:
    assert "torch" in imported_by("import clearway.agents.by_pose")
