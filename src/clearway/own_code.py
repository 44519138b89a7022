"""Classes of somebody's own, such as terms of a reward: their code, and whether other processes can import them."""

from __future__ import annotations

import ast
import hashlib
import inspect
import linecache
import re
import sys
from collections.abc import Iterator

DIGEST_LENGTH = 16
MAIN = "__main__"
DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)


def code_of(kind: type) -> str | None:
    """Digest of the source of a class and its bases, as it stands in their files now.

    To it belong the parts of the same files that the class names: functions, constants, imports, and what these name,
    with what assigns to them or calls a method of theirs, also one that only reads. The rest of the file may change
    without being told of, and so may what is imported, or what is done to a constant by a function called there or
    under another name.

    Returns:
        None for a class of clearway's or Python's, and where no source can be had.
    """
    parts = [part for own in kind.__mro__ if not _has_a_version(own) for part in _parts(own)]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:DIGEST_LENGTH] if parts else None


def not_importable(kind: type, main_too: bool = False) -> str:
    """Where a class stands, if other processes cannot import it from there; else empty.

    Args:
        kind: the class.
        main_too: they import the program that was started, too.
    """
    if "<locals>" in kind.__qualname__:
        return "inside a function"
    if kind.__module__ == MAIN:
        return "" if main_too else "in the program that was started"
    found: object = sys.modules.get(kind.__module__)
    for name in kind.__qualname__.split("."):
        found = getattr(found, name, None)
    return "" if found is kind else f"where {kind.__module__} holds another of its name, or none"


def _has_a_version(kind: type) -> bool:
    """It is clearway's or Python's, of which records tell by the version."""
    package = kind.__module__.partition(".")[0]
    return package == "clearway" or package in sys.stdlib_module_names


def _parts(kind: type) -> list[str]:
    """The class and what it names in its file, in the file's order; empty where its source cannot be had."""
    text = _text_around(kind)
    try:
        found = list(_definitions(text))
    except (SyntaxError, ValueError):
        return []
    wanted, taken = {kind.__qualname__.partition(".")[0], "*"}, set[int]()  # of what `import *` binds nothing is known
    while new := {place for place, (bound, _, _) in enumerate(found) if bound & wanted} - taken:
        taken |= new
        wanted = wanted.union(*(found[place][1] for place in new))
    return [found[place][2] for place in sorted(taken)]


def _definitions(text: str) -> Iterator[tuple[set[str], set[str], str]]:
    """Every statement of a module, each import alone: the names that it binds or changes, those it uses, its text."""
    lines = re.split(r"\r\n|\r|\n", text)  # as `ast` counts them; `splitlines` splits at form feeds, too
    body = ast.parse(text).body
    imported = set[str]().union(*(_bound(each) for each in body if isinstance(each, ast.Import | ast.ImportFrom)))
    for statement in body:
        if isinstance(statement, ast.Import | ast.ImportFrom):
            for alias in statement.names:
                level, module = getattr(statement, "level", 0), getattr(statement, "module", None)
                yield _bound(alias), set(), f"{'.' * level}{module or ''}:{alias.name}:{alias.asname or ''}"
        else:
            first = min([statement.lineno, *(each.lineno for each in getattr(statement, "decorator_list", ()))])
            bound = _bound(statement) | (_called_on(statement) - imported)
            yield bound, _names(statement), "\n".join(lines[first - 1 : statement.end_lineno])


def _bound(statement: ast.AST) -> set[str]:
    """Names that a statement binds, or changes: `TABLE["turn"] = 3` changes TABLE."""
    if isinstance(statement, DEFINITIONS):
        return {statement.name}
    found = set[str]()
    loops = [node.target for node in ast.walk(statement) if isinstance(node, ast.comprehension)]
    inside = {id(node) for target in loops for node in ast.walk(target) if isinstance(node, ast.Name)}  # its own names
    for node in ast.walk(statement):
        if isinstance(node, DEFINITIONS):
            found.add(node.name)
        elif isinstance(node, ast.alias):
            found.add(node.asname or node.name.partition(".")[0])
        elif isinstance(getattr(node, "ctx", None), ast.Store) and id(node) not in inside:
            found |= _names(node)
    return found


def _called_on(statement: ast.AST) -> set[str]:
    """Names whose methods a statement calls, and so may change: of `TABLE.update(turn=3)` TABLE. None if it defines."""
    if isinstance(statement, DEFINITIONS):
        return set()
    found = set[str]()
    for node in ast.walk(statement):
        owner: ast.AST | None = node.func if isinstance(node, ast.Call) else None
        if isinstance(owner, ast.Attribute):
            while isinstance(owner, ast.Attribute | ast.Subscript | ast.Call):
                owner = owner.func if isinstance(owner, ast.Call) else owner.value
            found |= {owner.id} if isinstance(owner, ast.Name) else set()
    return found


def _names(tree: ast.AST) -> set[str]:
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}


def _text_around(kind: type) -> str:
    """What the file, or the cell of a notebook, holds in which a class stands; empty where it cannot be had."""
    module = vars(sys.modules[kind.__module__]) if kind.__module__ in sys.modules else {}
    cells = [own.__code__.co_filename for own in vars(kind).values() if inspect.isfunction(own)]
    for name in (module.get("__file__"), *cells):
        if isinstance(name, str):
            linecache.checkcache(name)
            if lines := linecache.getlines(name, module):
                return "".join(lines)
    return ""
