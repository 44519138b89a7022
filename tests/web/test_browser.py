"""A browser is opened beside the service, and its command line, which every user of the machine sees, has no token."""

import stat
import threading
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

import pytest

from clearway.web.browser import opened_in_browser

PATIENT_S = 60
ADDRESS = "http://127.0.0.1:8123/a-secret-token/#start=3&seed=2"


def test_the_browser_gets_a_file_of_the_user_s_own_that_leads_to_the_address(monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[tuple[str, Path, str]] = []
    serving, looked = threading.Event(), threading.Event()

    def look(url: str) -> bool:
        assert serving.wait(PATIENT_S)  # as a browser in the terminal blocks
        path = Path(url2pathname(urlsplit(url).path))
        found.append((url, path, path.read_text()))
        assert stat.S_IMODE(path.stat().st_mode) == 0o600 and stat.S_IMODE(path.parent.stat().st_mode) == 0o700
        looked.set()
        return True

    monkeypatch.setattr("webbrowser.open", look)
    with opened_in_browser(ADDRESS):
        serving.set()
        assert looked.wait(PATIENT_S)
    ((url, path, content),) = found
    assert url.startswith("file:///") and "token" not in url
    assert 'content="0; url=http://127.0.0.1:8123/a-secret-token/#start=3&amp;seed=2"' in content
    assert not path.parent.exists()
