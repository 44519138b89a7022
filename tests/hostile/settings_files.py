"""Hostile files of settings, which `--config` names."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from clearway.cli.config import with_config
from clearway.cli.main import Command
from hostile.cases import Case, Sound

SOUND = b"# settings\nframes: 6e5\nset: {envs: 10, lr_start: 1.0e-05}\nresume: true\n"
SETTINGS: dict[str, tuple[bytes, str]] = {
    "a tag on no truth": (b'frames: !!bool "zzz"', "the tag"),
    "a tag on no time": (b'frames: !!timestamp "zzz"', "the tag"),
    "a tag on no number": (b'frames: !!int "x"', "the tag"),
    "a tag on a key": (b'!!float ".nan": 1', "the tag"),
    "bytes": (b'frames: !!binary "AAAA"', "the tag"),
    "a set": (b"frames: !!set {a, b}", "the tag"),
    "pairs": (b"frames: !!omap [a: 1]", "the tag"),
    "a call": (b"frames: !!python/object/apply:os.system [exit]", "the tag"),
    "a tag that hides": (b"frames: !<%1b%5b2J> 1", "the tag"),
    "a number to the base of 60": (b"frames: " + b"59:" * 100_000 + b"59", "expected a whole number"),
    "a long number of 16 digits": (b"frames: 0x" + b"f" * 400_000, "expected a whole number"),
    "a long number of 10 digits": (b"frames: " + b"9" * 10_000, "expected a whole number"),
    "a number of nothing": (b"frames: 0b_", "not read"),
    "a date": (b"frames: 99999999-01-01", "expected a whole number"),
    "a merge": (b"<<: [{frames: 1}]", "no such option"),
    "many keys": (b"".join(b"a%d: 1\n" % number for number in range(20_000)), "no such option"),
    "a deep key": (b"? " + b"[" * 300 + b"]" * 300 + b"\n: 1", "in each other"),
    "100,000 deep": (b"frames: " + b"[" * 100_000, "in each other"),
    "a key that hides": (b'"\\e[31mred\\u202e": 1', "no such option"),
    "keys of several lines": (b'"a\\nb": 1\n"a\\nb": 1', "occurs twice"),
    "a laugh": (b"a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]", "an alias"),
}


def cases() -> Iterator[Case]:
    """All of them."""
    sound = Sound("files of settings", "run.yaml", SOUND, read)
    yield from sound.flipped(60)
    yield from sound.cut(15)
    yield from sound.overwritten(9)
    for name, (content, says) in SETTINGS.items():

        def make(folder: Path, content: bytes = content) -> Path:
            path = folder / "run.yaml"
            path.write_bytes(content)
            return path

        yield Case("hostile settings", name, make, read, says)


def read(path: Path) -> str:
    return str(with_config(["train", "x.h5", "--config", str(path)], Command))
