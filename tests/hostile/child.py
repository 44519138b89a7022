"""Reads the corpus, one line of JSON a file, in a process of its own, which may crash.

    python -m hostile.child FLIPS FIRST     bits flipped in a scene file of ours; the first case to read

Memory is what the process grew by at its peak since it began, so whatever is kept or lost on the way counts too.
"""

from __future__ import annotations

import json
import re
import resource
import signal
import sys
import tempfile
import warnings
from pathlib import Path

from clearway.errors import ClearwayError, SceneError
from clearway.scenes.memory_limits import MIB, memory_limit
from hostile import corpus
from hostile.cases import Case

LONGEST_S = 60  # of processor time, for a case; the process then ends by a signal
SPARE_BYTES = 16 * 1024 * MIB  # of address space, so that a bomb that goes off does no harm


def main() -> None:
    flips, first = int(sys.argv[1]), int(sys.argv[2])
    warnings.simplefilter("error")
    resource.setrlimit(resource.RLIMIT_AS, (memory("VmSize") + SPARE_BYTES,) * 2)
    before = memory("VmRSS")
    for number, case in enumerate(corpus.cases(flips)):
        if number >= first:
            signal.setitimer(signal.ITIMER_PROF, LONGEST_S)
            print(json.dumps([number, case.group, case.name, *tried(case, before)]), flush=True)


def tried(case: Case, before: int) -> tuple[str, str, int]:
    """What came of a case ("refused", "read" or "wrong"), why, and by how many bytes the process grew."""
    with tempfile.TemporaryDirectory() as folder:
        path = case.make(Path(folder))
        limit = memory_limit(sum(file.stat().st_size for file in Path(folder).rglob("*") if file.is_file()))
        Path("/proc/self/clear_refs").write_text("5")  # the peak counts anew
        try:
            found = case.read(path)
        except ClearwayError as error:
            outcome, why = "refused", wrong_words(error, case, folder)
        except Exception as error:
            outcome, why = "wrong", f"{type(error).__name__}: {error}"
        else:
            outcome, why = "read", "was read" if case.says else "differs" if case.same not in ("", found) else ""
        grown = memory("VmHWM") - before
        if grown > limit:
            why += f"; took {grown >> 20} MiB, the limit is {limit >> 20} MiB"
        return "wrong" if why else outcome, why, grown


def wrong_words(error: ClearwayError, case: Case, folder: str) -> str:
    """What a refusal lacks: it names the file (and the dataset, in `says`) and the remedy, in one line."""
    message = str(error)
    faults = {
        "does not name the file": folder not in message,
        "is no single line": not message.isprintable() or len(message) > 800,
        "has no remedy": not re.search(r"\. [A-Z][^.]*(\.[^.]+)*$", message),
        "loses its remedy": isinstance(error, SceneError) and not (error.remedy and message.endswith(error.remedy)),
        f"does not say {case.says!r}": case.says not in message,
    }
    lacking = [fault for fault, found in faults.items() if found]
    return f"{', '.join(lacking)}: {message}" if lacking else ""


def memory(key: str) -> int:
    """A figure of /proc/self/status, bytes."""
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(key))
    return int(line.split()[1]) * 1024


if __name__ == "__main__":
    main()
