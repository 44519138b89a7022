from pathlib import Path

import pytest

from clearway.remote.address import address_of, addresses_without_secrets, file_name, without_secrets
from clearway.remote.records import origin


@pytest.mark.parametrize(
    "address", ["s3://rooms/a/b.h5", "gs://rooms/a", "https://example.org/a.h5?signature=b%2Fc", "http://[::1]:80/a"]
)
def test_an_address_is_the_same_as_text_and_as_path(address: str) -> None:
    assert address_of(address) == address_of(Path(address)) == address


@pytest.mark.parametrize("path", ["rooms/a.h5", "/s3/a.h5", "s3/a.h5", "ftp://a/b.h5", "s3:", "s3://", "C:/a.h5"])
def test_paths_are_no_addresses(path: str) -> None:
    assert address_of(path) is None
    assert address_of(Path(path)) is None


def test_names_are_last_parts() -> None:
    assert file_name("s3://rooms/a/b c?.h5") == "b c?.h5"
    assert file_name("https://example.org/a%20b.h5?signature=c/d") == "a b.h5"
    assert without_secrets("https://example.org/a.h5?signature=c") == "https://example.org/a.h5"
    assert without_secrets("https://me:secret@example.org/@/a.h5") == "https://example.org/@/a.h5"
    assert without_secrets("s3://rooms/what?.h5") == "s3://rooms/what?.h5"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("404, url='https://a.org/b.h5?signature=c'", "404, url='https://a.org/b.h5'"),
        (
            "(https://me:secret@a.org/b.h5), see (http://b.org/?c=d(e)f'g).",
            "(https://a.org/b.h5), see (http://b.org/).",
        ),
        ("https:/me:secret@a.org/b?signature=c", "https://a.org/b"),
        ("nothing at https://a.org/b.h5", "nothing at https://a.org/b.h5"),
    ],
)
def test_addresses_in_words_tell_no_secrets(words: str, told: str) -> None:
    assert addresses_without_secrets(words) == told


def test_a_file_of_this_machine_comes_from_its_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert origin(Path("a.h5")) == str(tmp_path.resolve() / "a.h5")
