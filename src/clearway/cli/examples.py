"""`clearway examples`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from clearway.cli.console import print_json, say, stdout_console


@dataclass(frozen=True)
class Examples:
    """List what comes along to be opened at once, with the command that opens each.

    Example: clearway examples
    """

    json: bool = False
    """Print JSON: how each was made, its figures, the sums of its files."""
    remake: Path | None = None
    """Make the example again, in this new folder: a minute. The package's own lies in
    src/clearway/examples/data."""

    def run(self) -> None:
        """Print the list, or make the example."""
        if self.remake is not None:
            self._make(self.remake)
            return
        from clearway.examples.shipped import read_card

        card = read_card()
        if self.json:
            print_json({**card, "open": {name: command for name, _, command in _rows(card)}})
            return
        from rich.table import Table

        table = Table(box=None, padding=(0, 2, 0, 0))
        for title in ("example", "what", "open it"):
            table.add_column(title, no_wrap=title != "what")
        for row in _rows(card):
            table.add_row(*row)
        stdout_console().print(table)

    def _make(self, folder: Path) -> None:
        from clearway.examples.make import make_example, shipped_recipe
        from clearway.files import check_free

        check_free(folder)
        make_example(shipped_recipe(show_progress=True), folder, show_progress=True)
        say(f"{folder}: made. To ship it, put it in place of src/clearway/examples/data")


def _rows(card: dict) -> list[tuple[str, str, str]]:
    """Name, description and command of every example."""
    bumps = ", ".join(f"{name} {row['collisions'][0]:.3f}" for name, row in card["agents"].items())
    return [
        (
            card["name"],
            f"two agents of the published settings, collisions an episode: {bumps}",
            "clearway view --example",
        ),
        ("generalist", f"in the same {card['name']}, which it has never entered", "clearway view generalist --example"),
    ]
