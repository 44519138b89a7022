"""What pages say, held against what records hold."""

import re
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def numbers(cell: str) -> list[str]:
    """Those of "93.3 % (92.1-94.4)", as they are written."""
    return re.findall(r"\d+(?:\.\d+)?", cell)


def words_of(pattern: str, page: str, flags: int = 0) -> re.Match[str]:
    """Where a page says something, which it has to."""
    found = re.search(pattern, page, flags)
    assert found is not None, f"no page says {pattern}"
    return found


def assert_written(written: str, value: float, what: str) -> None:
    """A figure is written to its last digit."""
    digits = len(written.partition(".")[2])
    assert abs(float(written) - value) <= 0.5001 * 10**-digits, f"{what}: written {written}, recorded {value}"
