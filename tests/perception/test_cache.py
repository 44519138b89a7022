import threading
import time
from pathlib import Path

import numpy as np
import pytest

from clearway.errors import EncoderError
from clearway.perception.cache import Entry, cached, content_key, joint_key


class Maker:
    """Counts how often it is asked."""

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self) -> Entry:
        self.calls += 1
        time.sleep(0.05)
        return Entry({"a": np.arange(6, dtype=np.float32).reshape(2, 3).T}, {"seed": 3, "names": ["x"]})


def test_an_entry_is_made_once_and_kept_whole(own_cache: Path) -> None:
    make = Maker()
    first, second = (cached("things", "k", make) for _ in range(2))
    assert make.calls == 1
    for entry in (first, second):
        assert np.array_equal(entry.arrays["a"], [[0, 3], [1, 4], [2, 5]])
        assert entry.note == {"seed": 3, "names": ["x"]}
    assert (own_cache / "things" / "k.safetensors").is_file()


def test_a_damaged_entry_is_made_again(own_cache: Path) -> None:
    make = Maker()
    cached("things", "k", make)
    path = own_cache / "things" / "k.safetensors"
    whole = path.read_bytes()
    flipped = bytearray(whole)
    flipped[-3] ^= 1
    for count, content in enumerate((bytes(flipped), whole[:20], b"", b"nonsense" * 50), start=2):
        path.write_bytes(content)
        assert np.array_equal(cached("things", "k", make).arrays["a"][0], [0, 3])
        assert make.calls == count
        cached("things", "k", make)
        assert make.calls == count


def test_others_wait_for_the_one_that_makes_it() -> None:
    make = Maker()
    threads = [threading.Thread(target=cached, args=("things", "k", make)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert make.calls == 1


def test_a_failure_leaves_nothing(own_cache: Path) -> None:
    def fail() -> Entry:
        raise EncoderError("no")

    with pytest.raises(EncoderError):
        cached("things", "k", fail)
    assert not list(own_cache.rglob("*.safetensors"))


def test_a_folder_that_cannot_be_written_is_one_error(own_cache: Path) -> None:
    own_cache.write_text("a file, not a folder")
    with pytest.raises(EncoderError, match="CLEARWAY_CACHE"):
        cached("things", "k", Maker())


def test_keys_depend_on_content_and_shape_alone() -> None:
    pictures = np.random.default_rng(0).integers(0, 256, (130, 4, 6, 3), np.uint8)
    assert content_key(pictures) == content_key(pictures.copy())
    changed = pictures.copy()
    changed[129, 3, 5, 2] ^= 1
    assert content_key(changed) != content_key(pictures)
    assert content_key(pictures.reshape(130, 6, 4, 3)) != content_key(pictures)
    assert joint_key("a", "bc") != joint_key("ab", "c")
