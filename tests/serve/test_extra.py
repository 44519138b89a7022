"""Without the extra `serve` the command says what to install."""

import subprocess
import sys

import pytest

from clearway.errors import install_hint

SERVE = """
import sys
sys.modules.update(dict.fromkeys(sys.argv[1:]))  # None: not installed
from clearway.cli.main import main
main(["serve", "runs/bathroom"])
"""


@pytest.mark.parametrize(
    "missing", [("prometheus_client",), ("fastapi", "h11", "prometheus_client", "pydantic", "starlette", "uvicorn")]
)
def test_a_missing_package_is_one_line(missing):
    answer = subprocess.run([sys.executable, "-c", SERVE, *missing], capture_output=True, text=True, timeout=120)
    assert answer.returncode == 2
    told = f"error: clearway serve needs prometheus-client. {install_hint('serve')}\n"
    assert answer.stderr == told, answer
