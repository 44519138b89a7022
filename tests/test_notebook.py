"""The notebook in `examples`: its cells run in order, and it holds no outputs."""

import ast
import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from helpers.documents import ROOT, shortened

NOTEBOOK = ROOT / "examples/first_agent.ipynb"


def cells(kind: str) -> list[dict]:
    kept = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    assert (kept["nbformat"], kept["nbformat_minor"]) == (4, 5)
    return [cell for cell in kept["cells"] if cell["cell_type"] == kind]


def shown(text: str, names: dict[str, object]) -> object:
    """Run a cell; what its last expression gives, which a notebook shows."""
    tree = ast.parse(text)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, str(NOTEBOOK), "exec"), names)
    return None if last is None else eval(compile(ast.Expression(last.value), str(NOTEBOOK), "eval"), names)


def test_it_is_small_and_keeps_no_outputs() -> None:
    assert NOTEBOOK.stat().st_size < 10_000
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in cells("code"))
    everything = [cell["id"] for kind in ("code", "markdown") for cell in cells(kind)]
    assert len(set(everything)) == len(everything)


def test_it_goes_by_the_public_door_alone() -> None:
    imported = set()
    for cell in cells("code"):
        for node in ast.walk(ast.parse("".join(cell["source"]))):
            if isinstance(node, ast.Import):
                imported |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                imported.add(node.module)
    assert imported == {"clearway", "numpy", "PIL", "pathlib"}


@pytest.mark.slow
def test_the_cells_run_in_order_and_show_what_they_say(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    found = []
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        for cell in cells("code"):
            text = "".join(cell["source"])
            fewer = {"frames=200_000": "frames=20_000", "episodes=20": "episodes=2"}
            here = {old: new for old, new in fewer.items() if old in text}
            found.append(shown(shortened(text, here), names))
    first, last = (picture for picture in found if isinstance(picture, Image.Image))
    assert np.asarray(first).shape[1] == 4 * np.asarray(names["scene"].observations[0]).shape[1]
    assert np.asarray(last).std() > 0
    assert "shortest path" in next(one for one in found if hasattr(one, "markdown")).markdown()
