"""Tables with notes for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table


def noted(table: Table, notes: Sequence[str]) -> Group:
    """The table and, below it, a line or more a note, as wide as the terminal.

    Not the table's caption: rich makes that as wide as the table asks to be, and cuts off what the terminal lacks.
    """
    from rich.console import Group
    from rich.text import Text

    return Group(table, Text("\n".join(notes), style="table.caption"))
