"""No file that a user opens may run code: nothing in the package unpickles, evaluates or executes what it reads."""

import ast
from pathlib import Path

import pytest

import clearway

PACKAGE = Path(clearway.__file__).parent
MESSAGES = PACKAGE / "spread/messages.py"  # between processes of ours alone: nothing of a file ever becomes one
SETTINGS = PACKAGE / "settings_file.py"  # YAML, by a loader of plain values: see below
MODULES = sorted(set(PACKAGE.rglob("*.py")) - {MESSAGES, SETTINGS})
UNSAFE_MODULES = {"pickle", "cPickle", "_pickle", "dill", "cloudpickle", "joblib", "shelve", "marshal", "yaml"}
UNSAFE_CALLS = {"eval", "exec", "torch.load", "numpy.load", "np.load", "pandas.read_pickle", "torch.hub.load"}


def unsafe(source: str) -> list[str]:
    """What a module's source uses that can run code out of data."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found += [each.name for each in node.names if each.name.split(".")[0] in UNSAFE_MODULES]
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in UNSAFE_MODULES:
            found.append(str(node.module))
        elif isinstance(node, ast.Call) and ast.unparse(node.func) in UNSAFE_CALLS:
            found.append(ast.unparse(node.func))
        elif isinstance(node, ast.keyword) and node.arg in ("allow_pickle", "trust_remote_code"):
            found += [] if ast.unparse(node.value) == "False" else [f"{node.arg}={ast.unparse(node.value)}"]
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_no_module_can_run_code_out_of_data(path: Path) -> None:
    assert unsafe(path.read_text(encoding="utf-8")) == []


def test_messages_between_processes_are_read_where_work_is_spread_alone() -> None:
    readers = [path for path in MODULES if "spread.messages" in path.read_text(encoding="utf-8")]
    others = {path.relative_to(PACKAGE).as_posix() for path in readers if path.parent != MESSAGES.parent}
    assert others == {"learn/crew.py", "learn/ray_workers.py"}  # the first only sends
    assert unsafe(MESSAGES.read_text(encoding="utf-8")) == ["pickle"]


def test_yaml_is_read_by_a_loader_of_plain_values_alone() -> None:
    source = SETTINGS.read_text(encoding="utf-8")
    assert unsafe(source) == ["yaml"]
    used = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Attribute)]
    names = {node.attr for node in used if ast.unparse(node.value) == "yaml"}
    kept = {"SafeLoader", "SafeDumper", "dump", "parse", "ScalarNode", "MarkedYAMLError", "YAMLError", "Event"}
    assert names == kept | {name for name in names if name.endswith("Event")}
    assert 'getattr(yaml, "CSafeLoader", yaml.SafeLoader)' in source and source.count("getattr(yaml") == 2


@pytest.mark.parametrize(
    "source",
    [
        "import pickle",
        "from pickle import load",
        "import torch\ntorch.load('x')",
        "eval(text)",
        "f(x, allow_pickle=True)",
        "f(x, allow_pickle=chosen)",
        "import os, dill.detect",
    ],
)
def test_the_search_finds_what_is_unsafe(source: str) -> None:
    assert unsafe(source)


def test_the_search_lets_pass_what_is_safe() -> None:
    assert unsafe("import json\nnp.lib.format.read_array(f, allow_pickle=False)\nmodel.eval()") == []
