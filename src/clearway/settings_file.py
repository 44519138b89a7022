"""Files of settings in YAML, such as a run's `run.yaml`: read within limits, as plain values only, and written."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from clearway.errors import ClearwayError
from clearway.files import written_whole
from clearway.regular_files import read_bytes

MAX_BYTES = 8 * 1024**2  # the settings of a run on some 50,000 scenes
_Dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)  # several times as fast, where PyYAML comes with libyaml


class _Loader(yaml.SafeLoader):
    """Plain values alone; a key that occurs twice is refused, and so is what refers to another place of the file."""

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Refuse aliases, by which a small file could become a large one."""
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark
            raise yaml.MarkedYAMLError(problem="an alias (*), which is not read here", problem_mark=mark)
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Refuse a key that occurs twice."""
        found = set()
        for key, _ in node.value:
            if key.value in found:
                problem = f"the key {str(key.value)[:40]} occurs twice"
                raise yaml.MarkedYAMLError(problem=problem, problem_mark=key.start_mark)
            if isinstance(key.value, str):
                found.add(key.value)
        return super().construct_mapping(node, deep)


def read_settings(path: Path) -> dict[str, Any]:
    """What a YAML file of settings holds, by key; empty where it holds nothing.

    Raises:
        ClearwayError: there is no such file, it is too large, no YAML, or no mapping with words as keys.
    """
    try:
        content = read_bytes(path, MAX_BYTES)
    except OSError as fault:
        raise ClearwayError(f"{path}: not readable ({fault.strerror}). Name a YAML file of settings") from fault
    try:
        read = yaml.load(content.decode("utf-8"), _Loader)
    except yaml.MarkedYAMLError as fault:
        where = f", line {fault.problem_mark.line + 1}" if fault.problem_mark else ""
        raise ClearwayError(f"{path}{where}: not read ({fault.problem}). Correct it") from fault
    except (yaml.YAMLError, ValueError, RecursionError, TypeError) as fault:
        reason = " ".join(str(fault).split())[:200]
        raise ClearwayError(f"{path}: not read ({reason}). Correct it") from fault
    if read is None:
        return {}
    if not isinstance(read, dict) or not all(isinstance(key, str) for key in read):
        raise ClearwayError(f"{path}: expected an option a line, such as frames: 600000. Correct it")
    return read


def write_settings(path: Path, settings: Mapping[str, Any], head: str) -> None:
    """Write settings, plain values by key, under a comment of one line."""
    text = yaml.dump(dict(settings), Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)
    with written_whole(path) as part:
        part.write_text(f"# {head}\n{text}", encoding="utf-8")
