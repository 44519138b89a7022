"""Reads the whole corpus in child processes and sums up what came of it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass

OUTCOMES = ("refused", "read", "wrong")


@dataclass(frozen=True)
class Result:
    """What came of one file: an outcome, and why where it is "wrong"; by how many bytes the process grew."""

    number: int
    group: str
    name: str
    outcome: str
    why: str
    grown: int


def results(flips: int) -> list[Result]:
    """Of every case. A child that dies counts as a wrong one, and the next goes on behind it."""
    found: list[Result] = []
    while True:
        command = [sys.executable, "-m", "hostile.child", str(flips), str(len(found))]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
        child = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=3600, check=False)
        found += [Result(*json.loads(line)) for line in child.stdout.splitlines()]
        if child.returncode == 0:
            return found
        if child.returncode > 0:  # not a signal's doing: the corpus itself is at fault
            raise RuntimeError(f"after {found[-1:]}: {child.stderr[-2000:]}")
        why = f"the process ended by signal {-child.returncode}"
        found.append(Result(len(found), "crashed", "the file after the last", "wrong", why, 0))


def table(found: list[Result]) -> str:
    """Files tried, refused, read and wrong, a line a group, and the most memory that one took."""
    lines = [f"{'files':<46}{'tried':>7}{'refused':>9}{'read':>7}{'wrong':>7}{'most memory':>13}"]
    for group in dict.fromkeys(result.group for result in found):
        lines.append(_line(group, [result for result in found if result.group == group]))
    lines.append(_line("all", found))
    lines += [f"wrong: {each.group}, {each.name}: {each.why}" for each in found if each.outcome == "wrong"]
    return "\n".join(lines)


def _line(title: str, own: list[Result]) -> str:
    refused, read, wrong = (sum(result.outcome == outcome for result in own) for outcome in OUTCOMES)
    most = max(result.grown for result in own) >> 20
    return f"{title:<46}{len(own):>7}{refused:>9}{read:>7}{wrong:>7}{most:>9} MiB"
