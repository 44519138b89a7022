"""The example that runs an exported agent without clearway."""

from __future__ import annotations

import runpy
from pathlib import Path

from PIL import Image

import clearway
from helpers.imported import imported_by

EXAMPLE = Path(__file__).parents[2] / "examples" / "run_onnx.py"


def test_the_example_does_what_a_navigator_does(deployed, tmp_path, capsys) -> None:
    states = (3, 20, 21, 22, 30)
    paths = [tmp_path / f"{state}.png" for state in states]
    for state, path in zip(states, paths, strict=True):
        Image.fromarray(deployed.pictures[state]).save(path)
    found = runpy.run_path(str(EXAMPLE))["main"]([str(deployed.agent), *map(str, paths)])

    navigator = clearway.Navigator(deployed.agent, selection="argmax")
    navigator.set_target(deployed.pictures[states[0]])
    decisions = [navigator.act(deployed.pictures[state]) for state in states[1:]]
    assert found == [decision.action.name.lower().replace("_", " ") for decision in decisions]
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "scene cellar, encoder random-resnet50"
    assert lines[-1].endswith(f"value {decisions[-1].value:.2f})")


def test_the_example_imports_nothing_of_clearway() -> None:
    loaded = imported_by(f"import runpy; runpy.run_path({str(EXAMPLE)!r})")
    assert {"onnxruntime", "PIL.Image"} <= loaded
    brought = loaded - imported_by("pass")  # an installed clearway is there from Python's start, see gymnasium_hook
    assert not [name for name in brought if name.split(".")[0] in ("clearway", "torch", "onnx")]
