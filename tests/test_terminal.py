"""Notes below tables are whole, also where a table asks for more room than there is."""

import io

import pytest
from rich.console import Console
from rich.table import Table

from clearway.terminal import noted

NOTE = "one two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen seventeen"


@pytest.mark.parametrize("columns", [30, 43, 200])
def test_notes_are_as_wide_as_the_terminal(columns: int) -> None:
    table = Table()
    table.add_column("figure", min_width=60)
    console = Console(width=columns, record=True, file=io.StringIO())
    console.print(noted(table, [NOTE, "second note"]))
    lines = console.export_text().splitlines()
    assert max(map(len, lines)) <= columns
    assert f"{NOTE} second note" in " ".join(" ".join(lines).split())
