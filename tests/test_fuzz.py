"""A minute of fuzzing, in the slow part."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

FUZZ = Path(__file__).parents[1] / "fuzz" / "fuzz_readers.py"


@pytest.mark.slow
def test_a_minute_of_mutated_files_finds_nothing(tmp_path: Path) -> None:
    pytest.importorskip("atheris")
    words = [sys.executable, str(FUZZ), "-max_total_time=60"]
    found = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=400, check=False)
    assert found.returncode == 0, found.stderr[-3000:]
    assert not list(tmp_path.glob("crash-*"))
    (runs,) = re.findall(r"^#(\d+)\s+DONE", found.stderr, re.MULTILINE)
    assert int(runs) > 1000
