"""The pinned packages run on every Python that clearway promises, Debian's 3.11.2 included."""

import tomllib
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from packaging.specifiers import SpecifierSet
from packaging.version import Version

ROOT = Path(__file__).parent.parent


def pins() -> dict[str, str]:
    """Versions by package."""
    lines = (line.split("#")[0].strip() for line in (ROOT / "constraints.txt").read_text().splitlines())
    return dict(line.split(";")[0].strip().split("==") for line in lines if line)


def test_pinned_packages_run_on_the_oldest_python_promised() -> None:
    promised = SpecifierSet(tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["requires-python"])
    oldest = Version("3.11.0")
    assert oldest in promised
    assert Version("3.10.99") not in promised
    looked_at, refusing = 0, []
    for name, version in pins().items():
        try:
            found = distribution(name)
        except PackageNotFoundError:  # of an extra, or for another system
            continue
        wanted = found.metadata["Requires-Python"]
        if found.version.split("+")[0] == version and wanted:
            looked_at += 1
            if oldest not in SpecifierSet(wanted):
                refusing.append(f"{name}=={version} wants {wanted}")
    assert not refusing
    assert looked_at > 100
