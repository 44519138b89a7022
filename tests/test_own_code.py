import linecache
import sys
from abc import ABC
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import pytest

from clearway.own_code import code_of, not_importable
from clearway.reward import Term, Zones
from helpers.own_terms import DEARER, NAME, SOURCE, imported


@pytest.mark.parametrize(
    "edit",
    [
        DEARER,
        ("cost: float = 0.005", "cost: float = 0.006"),
        ("@dataclass(frozen=True)", "@dataclass(frozen=True, repr=False)"),
        ("SHARE = 0.5", "SHARE = 0.6"),
        ("earned * SHARE", "earned / SHARE"),
        ('ACTIONS["right"] = 1', 'ACTIONS["right"] = 2'),
        ("ACTIONS.update(left=0)", "ACTIONS.update(left=2)"),
        ("ACTIONS.update(left=0)", "ACTIONS.update(left=0)\nACTIONS.setdefault('up', []).append(2)"),
        ("UNUSED = 1\n", "UNUSED = 1\nfor side in 'ab':\n    ACTIONS.update({side: 1})\n"),
        ("UNUSED = 1\n", "UNUSED = 1\nif UNUSED:\n    ACTIONS.update(up=1)\n"),
        ("UNUSED = 1\n", "UNUSED = 1\n_ = ACTIONS.setdefault('up', 1)\n"),
        ("UNUSED = 1\n", "UNUSED = 1\nfor _, side in ACTIONS.items():\n    side.bit_length()\n"),
        ("UNUSED = 1\n", "UNUSED = 1\n_ = [side.bit_length() for side in ACTIONS.values()]\n"),
        ("UNUSED = 1\n", "UNUSED = 1\nif __name__ == '__main__':\n    ACTIONS.pop('left')\n"),
        ("UNUSED = 1\n", "UNUSED = 1\nLEFT = ACTIONS.get('left')\n"),
        ("UNUSED = 1\n", "UNUSED = 1\n_ = [0 for ACTIONS['left'] in (5,)]\n"),
        ("return share(earned)", "return share(earned) / 2"),
        ("floor as rounded", "trunc as rounded"),
        ("from math import floor", "from numpy import floor"),
        ("import numpy as np", "import torch as np"),
        ("SHARE = 0.5", "if np.pi > 3:\n    SHARE = 0.6\nelse:\n    SHARE = 0.5"),
        ("SHARE = 0.5", "try:\n    from os import sep as SHARE\nexcept ImportError:\n    SHARE = 0.5"),
        ("UNUSED = 1\n", "UNUSED = 1\nif UNUSED:\n    def rounded(x):\n        return x\n"),
        ("floor as rounded, ceil", "floor, ceil as rounded"),
        ("UNUSED = 1\n", "UNUSED = 1\nfrom math import *\n"),
    ],
)
def test_what_a_class_uses_of_its_file_is_its_code(edit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = code_of(imported(tmp_path / "before.py", monkeypatch).Turning)
    after = code_of(imported(tmp_path / "after.py", monkeypatch, edit).Turning)
    assert before is not None and after is not None
    assert before != after


@pytest.mark.parametrize(
    "edit",
    [
        ("UNUSED = 1\n", "UNUSED = 2\n"),
        ("UNUSED = 1\n", "UNUSED = 1\nnp.seterr()\nprint(ACTIONS)\n"),
        ("return UNUSED", "return 7"),
        ("return UNUSED", "rounded = UNUSED\n    return rounded"),
        ("UNUSED = 1\n", "UNUSED = 1\nSIDES = [SHARE for SHARE in range(3)]\n"),
        ('"few-turns"', '"fewer"'),
        (", ceil", ""),
        ("import Arrival, Reward", "import Arrival, Bump, Reward"),
        ("print(REWARD)", "print(7)"),
        ("\n\n\nclass Base", "\n\n\n# so that halves are told\n\n\nclass Base"),
    ],
)
def test_the_rest_of_the_file_is_not(edit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = code_of(imported(tmp_path / "before.py", monkeypatch).Turning)
    assert before == code_of(imported(tmp_path / "after.py", monkeypatch, edit).Turning) is not None


def test_ends_of_lines_do_not_matter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = imported(tmp_path / "turning.py", monkeypatch)
    before = code_of(module.Turning)
    (tmp_path / "turning.py").write_bytes(SOURCE.replace("\n", "\r\n").encode())
    assert code_of(module.Turning) == before


def test_a_base_in_another_file_is_part_of_the_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    codes = set()
    for number, edits in enumerate(([], [DEARER])):
        base = imported(tmp_path / f"{number}.py", monkeypatch, *edits).Turning
        codes.add(code_of(type("Derived", (base,), {"__module__": "somewhere"})))
    assert len(codes) == 2 and None not in codes


def test_code_that_cannot_be_had_or_is_ours_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert code_of(Zones) is None
    assert code_of(type("Abstract", (Term, ABC), {"__module__": "clearway.reward"})) is None
    assert code_of(type("Made", (Term,), {})) is None
    assert code_of(type("Made", (Term,), {"__module__": "not_imported"})) is None
    module = imported(tmp_path / "turning.py", monkeypatch)
    (tmp_path / "turning.py").write_text("def broken(:")
    assert code_of(module.Turning) is None
    (tmp_path / "turning.py").write_bytes(b"\xff\x00")
    assert code_of(module.Turning) is None
    (tmp_path / "turning.py").unlink()
    assert code_of(module.Turning) is None


def test_a_cell_of_a_notebook_is_a_file_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its module has no file, but the lines of every cell are kept."""
    codes = []
    for number, source in enumerate((SOURCE, SOURCE.replace(*DEARER), SOURCE.replace("print", "repr"))):
        module, cell = ModuleType(NAME), f"<cell {number}>"
        monkeypatch.setitem(sys.modules, NAME, module)
        monkeypatch.setitem(linecache.cache, cell, (len(source), None, source.splitlines(keepends=True), cell))
        exec(compile(source, cell, "exec"), vars(module))
        codes.append(code_of(module.Turning))
    assert None not in codes
    assert codes[0] != codes[1] and codes[0] == codes[2]


def test_where_no_process_can_import_a_class_from(monkeypatch: pytest.MonkeyPatch) -> None:
    @dataclass(frozen=True)
    class Inner(Term):
        pass

    started = type("Started", (Term,), {"__module__": "__main__"})
    assert not_importable(Inner) == not_importable(Inner, main_too=True) == "inside a function"
    assert not_importable(started) == "in the program that was started"
    assert not_importable(started, main_too=True) == not_importable(Zones) == ""


def test_form_feeds_end_no_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pages = ("SHARE = 0.5\n", "SHARE = 0.5\n\f\f\n")
    before = code_of(imported(tmp_path / "before.py", monkeypatch, pages).Turning)
    assert before != code_of(imported(tmp_path / "after.py", monkeypatch, pages, DEARER).Turning) is not None


def test_a_class_that_its_module_holds_no_more_is_not_importable(tmp_path: Path, monkeypatch) -> None:
    module = imported(tmp_path / "turning.py", monkeypatch)
    first = module.Turning
    assert not not_importable(first)
    monkeypatch.setattr(module, "Turning", type("Turning", (Term,), {"__module__": module.__name__}))
    assert not_importable(first) == f"where {module.__name__} holds another of its name, or none"
    monkeypatch.delitem(sys.modules, module.__name__)
    assert "or none" in not_importable(first)


def test_names_of_imports_that_change_places_are_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    used = ("earned * SHARE", "earned * SHARE + other(rounded(SHARE))")
    one, two = (
        ("floor as rounded, ceil", names)
        for names in ("floor as rounded, ceil as other", "floor as other, ceil as rounded")
    )
    before = code_of(imported(tmp_path / "before.py", monkeypatch, used, one).Turning)
    assert before != code_of(imported(tmp_path / "after.py", monkeypatch, used, two).Turning) is not None
