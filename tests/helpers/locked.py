"""The pinned packages, locked/*.txt."""

from __future__ import annotations

import re

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from helpers.documents import ROOT


def pins(name: str) -> dict[str, tuple[str, int]]:
    """(version, number of hashes) by package."""
    found = {}
    text = re.sub(r"^#.*\n", "", (ROOT / f"locked/{name}.txt").read_text(), flags=re.MULTILINE)
    for entry in re.split(r"\n(?=\S)", text.strip()):
        first, *hashes = entry.split(" \\\n")
        assert all(re.fullmatch(r" {4}--hash=sha256:[0-9a-f]{64}", line) for line in hashes), entry
        package = Requirement(first)
        (version,) = package.specifier
        assert version.operator == "==", entry
        found[canonicalize_name(package.name)] = version.version, len(hashes)
    return found
