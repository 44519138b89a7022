"""Tokens with names, and files of them."""

import os

import pytest

from clearway.errors import ClearwayError
from clearway.serve.tokens import read_tokens

RED, BLUE, NEW = 16 * "r", 16 * "b", 16 * "n"


def written(tmp_path, text: str, mode: int = 0o600):
    path = tmp_path / "tokens"
    path.write_text(text)
    path.chmod(mode)
    return path


def test_a_file_of_tokens(tmp_path) -> None:
    tokens = read_tokens(written(tmp_path, f"# whose\n\nred {RED}\n  blue\t{BLUE}\nred {NEW}\n"))
    assert [tokens.owner_of(given) for given in (RED, BLUE, NEW, "", RED[:-1])] == ["red", "blue", "red", None, None]


@pytest.mark.parametrize(
    ("text", "mode", "part"),
    [
        ("", 0o600, "no tokens in it"),
        ("red\n", 0o600, "line 1: expected a name and a token"),
        (f"red {RED} more\n", 0o600, "line 1: expected a name and a token"),
        (f"red {RED}\nblue short\n", 0o600, "line 2, holds no token of at least 16"),
        (f"{101 * 'r'} {RED}\n", 0o600, "line 1: a name of 101 letters, expected at most 100"),
        (f"red {RED}\nred {RED}\nblue {RED}\n", 0o600, "line 3: the token of blue is that of red, too"),
        (f"red {RED}\n", 0o640, "chmod 600"),
        ("#" * (1 << 20) + "\n", 0o600, "larger than 1 MiB"),
    ],
    ids=["empty", "no token", "three words", "weak", "long name", "of two", "open to others", "large"],
)
def test_files_that_are_none(tmp_path, text, mode, part) -> None:
    path = written(tmp_path, text, mode)
    with pytest.raises(ClearwayError, match=part) as caught:
        read_tokens(path)
    assert str(path) in str(caught.value) and RED not in str(caught.value)


def test_a_pipe_a_device_and_nothing_are_no_file_of_tokens(tmp_path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path, part in ((tmp_path / "pipe", "no regular"), ("/dev/zero", "no regular"), (tmp_path / "x", "cannot be")):
        with pytest.raises(ClearwayError, match=part):
            read_tokens(path)
