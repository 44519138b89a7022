"""The bill of materials holds what is pinned, and the same each time."""

import json
import subprocess
import sys

import pytest

from helpers.documents import ROOT
from helpers.locked import pins


def printed(*words: str) -> str:
    return subprocess.run(
        [sys.executable, "scripts/sbom.py", *words], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout


@pytest.mark.parametrize(
    ("words", "lists"),
    [
        (["view"], ["torch-cpu", "view"]),
        (["serve"], ["torch-cpu", "serve"]),
        (["dev", "--cuda"], ["torch", "cuda", "dev"]),
    ],
)
def test_every_pinned_package_is_in_it_with_its_hashes(words, lists) -> None:
    text = printed(*words)
    assert text == printed(*words)
    found = json.loads(text)
    assert (found["bomFormat"], found["specVersion"]) == ("CycloneDX", "1.6")
    by_name = {part["name"]: part for part in found["components"]}
    wanted = {name: pin for one in lists for name, pin in pins(one).items()}
    assert by_name.keys() == wanted.keys()
    for name, part in by_name.items():
        (source,) = part["externalReferences"]
        assert (part["version"], len(source["hashes"])) == wanted[name]
        assert part["purl"] == f"pkg:pypi/{name}@{part['version'].replace('+', '%2B')}"
    assert set(found["dependencies"][0]["dependsOn"]) == {part["bom-ref"] for part in found["components"]}
