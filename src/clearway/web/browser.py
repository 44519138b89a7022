"""Opening the user's browser at an address with a token."""

from __future__ import annotations

import os
import tempfile
import threading
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from clearway.viz.html import rendered_html


@contextmanager
def opened_in_browser(address: str) -> Iterator[None]:
    """Open the browser, which may take its time, while the context goes on.

    The browser's command line, which every user of the machine can see, names a file that leads to the address: only
    this user can read it, and it is removed at the end.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "clearway.html"
        with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as file:
            file.write(rendered_html("redirect", address=address))
        threading.Thread(target=webbrowser.open, args=(path.as_uri(),), daemon=True).start()
        yield
