"""Certificates for TLS on this machine."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

ELLIPTIC = ("ec", "-pkeyopt", "ec_paramgen_curve:prime256v1")


def certified(folder: Path, kind: tuple[str, ...] = ELLIPTIC) -> tuple[Path, Path]:
    """A certificate for 127.0.0.1 that is its own authority, and its key of a kind, in openssl's words."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl, which makes the certificate, is not installed")
    certificate, key = folder / "cert.pem", folder / "key.pem"
    words = [
        "openssl",
        "req",
        "-x509",
        "-newkey",
        *kind,
        "-nodes",
        "-days",
        "1",
        "-subj",
        "/CN=127.0.0.1",
    ]
    more = ["-addext", "subjectAltName=IP:127.0.0.1", "-keyout", str(key), "-out", str(certificate)]
    subprocess.run([*words, *more], check=True, capture_output=True)
    return certificate, key
