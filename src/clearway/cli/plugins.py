"""`clearway plugins`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Plugins:
    """List encoders, rewards, agents, importers, algorithms and experiments: our own, and other installed packages'.

    Example: clearway plugins
    """

    json: bool = False
    """Print JSON."""

    def run(self) -> None:
        """Print them, built-in ones first."""
        from clearway.cli.console import print_json, stdout_console

        rows = _rows()
        if self.json:
            print_json(rows)
            return
        from rich.table import Table
        from rich.text import Text

        from clearway.errors import printable

        table = Table(show_header=True, box=None, padding=(0, 2, 0, 0))
        for heading in ("kind", "name", "package", "problem"):
            table.add_column(heading)
        for row in rows:
            package = f"{row['package']} {row['version']}"
            table.add_row(*(Text(printable(text)) for text in (row["kind"], row["name"], package, row["problem"])))
        stdout_console().print(table)


def _rows() -> list[dict[str, str]]:
    """Kind, name, package, version and problem (empty where there is none) of each, kind after kind."""
    from clearway.plugins import BUILT_IN, KINDS, plugins, problem
    from clearway.version import __version__

    rows = []
    for kind in KINDS:
        named = {"kind": kind, "package": "clearway", "version": __version__, "problem": ""}
        rows += [{**named, "name": name} for name in BUILT_IN[kind]]
        offered = plugins(kind)
        rows += [
            {
                "kind": kind,
                "package": plugin.package,
                "version": plugin.version,
                "problem": problem(plugin, offered),
                "name": plugin.name,
            }
            for plugin in offered
        ]
    return rows
