"""Print the bill of materials of an extra's installation, in CycloneDX's JSON: python scripts/sbom.py view > sbom.json.

It says what locked/*.txt say: every package, its version, its files' hashes. The same files give the same bill.
https://cyclonedx.org/docs/1.6/json/
"""

from __future__ import annotations

import argparse
import json
import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
LOCKED = ROOT / "locked"
PACKAGE = re.compile(
    r"(?P<name>[a-z0-9._-]+)==(?P<version>[^ ]+)(?: ; (?P<marker>[^\\]+?))? \\\n(?P<hashes>(?: {4}--hash=.+\n)+)"
)


def components(path: Path) -> list[dict]:
    """The packages of a list, as CycloneDX's components."""
    return [
        component(*found.group("name", "version", "marker", "hashes")) for found in PACKAGE.finditer(path.read_text())
    ]


def component(name: str, version: str, marker: str | None, hashes: str) -> dict:
    """A package. Hashes are of its files, of which a system installs one, and stand beside where those come from."""
    source = "https://download.pytorch.org/whl/cpu" if version.endswith("+cpu") else "https://pypi.org/simple"
    purl = f"pkg:pypi/{name}@{version.replace('+', '%2B')}"
    files = [{"alg": "SHA-256", "content": content} for content in re.findall(r"sha256:([0-9a-f]{64})", hashes)]
    found = {
        "type": "library",
        "bom-ref": purl,
        "name": name,
        "version": version,
        "purl": purl,
        "externalReferences": [{"type": "distribution", "url": f"{source}/{name}/", "hashes": files}],
    }
    return found | ({"properties": [{"name": "clearway:marker", "value": marker}]} if marker else {})


def bill(extra: str, cuda: bool = False) -> dict:
    """The bill of materials of an extra, with PyTorch's build for NVIDIA GPUs or without."""
    lists = ["torch", "cuda"] if cuda else ["torch-cpu"]
    parts = sorted(
        (part for name in [*lists, extra] for part in components(LOCKED / f"{name}.txt")), key=lambda part: part["name"]
    )
    text = (ROOT / "src/clearway/version.py").read_text()
    version = re.search(r'__version__ = "(.+)"', text)[1]
    licence = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["license"]
    itself = {"type": "application", "bom-ref": "clearway", "name": "clearway", "version": version}
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": itself | {"licenses": [{"license": {"id": licence}}]}},
        "components": parts,
        "dependencies": [{"ref": "clearway", "dependsOn": [part["bom-ref"] for part in parts]}],
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Print the bill of materials of an extra's installation.")
    parser.add_argument("extra", nargs="?", default="view", choices=("dev", "serve", "view"))
    parser.add_argument("--cuda", action="store_true", help="with PyTorch's build for NVIDIA GPUs")
    given = parser.parse_args()
    print(json.dumps(bill(given.extra, given.cuda), indent=2))
