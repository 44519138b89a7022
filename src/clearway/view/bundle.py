"""The page's JavaScript modules as one script, for pages that are opened from a file: browsers load no modules there.

It reads what our own modules hold: imports by name from a module beside them, and exports of functions and constants,
each on a line of its own.
"""

from __future__ import annotations

import re

IMPORT = re.compile(r'^import \{ ?([\w, ]+?) ?\} from "\./([\w-]+\.js)";$', re.MULTILINE)
EXPORT = re.compile(r"^export ((?:async )?(?:function|const) (\w+))", re.MULTILINE)
OTHER = re.compile(r"^\s*(?:import|export)\b", re.MULTILINE)


def bundled(modules: dict[str, str], entry: str) -> str:
    """One script of the modules that `entry` needs, each in a scope of its own, after those that it imports.

    Args:
        modules: source by file name.
        entry: file name of the first.
    """
    done: dict[str, str] = {}
    _add(entry, modules, done, ())
    return '"use strict";\n' + "".join(done.values())


def _add(name: str, modules: dict[str, str], done: dict[str, str], above: tuple[str, ...]) -> None:
    assert name not in above, f"{name} imports itself, by way of {above}"
    if name in done:
        return
    source = modules[name]
    for _, other in IMPORT.findall(source):
        _add(other, modules, done, (*above, name))
    body = IMPORT.sub(lambda found: f"const {{ {found[1]} }} = {_variable(found[2])};", source)
    exported = [match[1] for match in EXPORT.findall(body)]
    body = EXPORT.sub(lambda found: found[1], body)
    assert not OTHER.search(body), f"{name} imports or exports in a way that is not known here"
    done[name] = f"const {_variable(name)} = (() => {{\n{body}\nreturn {{ {', '.join(exported)} }};\n}})();\n"


def _variable(name: str) -> str:
    return f"of_{name.removesuffix('.js').replace('-', '_')}"
