"""Settings in YAML: plain values, within limits; whatever else is one clear error."""

import time

import pytest

from clearway.errors import ClearwayError
from clearway.settings_file import MAX_BYTES, read_settings, write_settings


def test_what_is_written_is_read_again(tmp_path):
    settings = {"files": ["ä b.h5"], "frames": 600_000, "set": {"lr_start": 5e-4, "lr_end": 1e-05, "hindsight": True}}
    write_settings(tmp_path / "run.yaml", settings, "A head")
    assert (tmp_path / "run.yaml").read_text().startswith("# A head\nfiles:")
    assert read_settings(tmp_path / "run.yaml") == settings


def test_an_empty_file_holds_nothing(tmp_path):
    (tmp_path / "a.yaml").write_text("# frames: 5\n")
    assert read_settings(tmp_path / "a.yaml") == {}


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"frames: [1", "not read ("),
        (b"frames: 1\nseed: 2\nframes: 3", "line 3: not read (the key frames occurs twice)"),
        (b"a: &x [1]\nb: [*x, *x]", "line 2: not read (an alias"),
        (b"a: !!python/object/apply:os.system ['true']", "not read"),
        (b"- frames", "expected an option a line, such as frames: 600000"),
        (b"1: 2", "expected an option a line, such as"),
        (b"a: !!bool zzz", "line 1: not read (the tag tag:yaml.org,2002:bool, which is not read here)"),
        (b'a: 1\nb: !!timestamp "zzz"', "line 2: not read (the tag tag:yaml.org,2002:timestamp"),
        (b'!!float ".nan": 1', "the tag"),
        (b"a: !!omap [b: 1]", "the tag"),
        (b"a: ! b", "the tag !"),
        (b"a: 0b_", "not read"),
        (b"? [1]\n: 2", "line 1: not read (a key that is no word)"),
        (b"a: 1\n---\nb: 2", "a second document"),
        (b"a: 1\nb: " + 21 * b"[" + 21 * b"]", "line 2: not read (more than 20 lists and mappings in each other)"),
        (b"\xff\xfe\xfa", "not read"),
        (b"[" * 5000, "not read"),
        (b"a: 1\n" + b"#" * MAX_BYTES, "larger than 8 MiB"),
    ],
)
def test_what_is_no_file_of_settings_is_one_line(tmp_path, content, told):
    path = tmp_path / "a.yaml"
    path.write_bytes(content)
    with pytest.raises(ClearwayError) as refused:
        read_settings(path)
    assert str(refused.value).startswith(str(path)) and told in str(refused.value)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ClearwayError, match=r"none\.yaml: not readable"):
        read_settings(tmp_path / "none.yaml")
    with pytest.raises(ClearwayError, match="not readable"):
        read_settings(tmp_path)


def test_dates_sexagesimal_numbers_and_what_is_too_long_for_a_number_are_texts(tmp_path):
    texts = ("2020-13-45", "2020-12-24", "1:30", "1:30.5", "0x" + 200 * "f", "<<", "=")
    (tmp_path / "a.yaml").write_text("".join(f"- {text}\n" for text in texts).join(("a:\n", "")))
    assert read_settings(tmp_path / "a.yaml") == {"a": list(texts)}
    write_settings(tmp_path / "b.yaml", {"a": list(texts)}, "A head")
    assert read_settings(tmp_path / "b.yaml") == {"a": list(texts)}


def test_plain_words_mean_what_yaml_says(tmp_path):
    words = "1, 0x1f, 1_000, -2.5, 1.0e-05, .inf, yes, off, null, ~, '1', \"true\", 6e5"
    (tmp_path / "a.yaml").write_text(f"a: [{words}]\nb:\n")
    found = [1, 31, 1000, -2.5, 1e-05, float("inf"), True, False, None, None, "1", "true", "6e5"]
    assert read_settings(tmp_path / "a.yaml") == {"a": found, "b": None}


@pytest.mark.parametrize(
    "content",
    [
        b"a: " + b"59:" * 100_000 + b"59",
        b"".join(b"a%d: 1\n" % number for number in range(20_000)),
    ],
    ids=["base 60", "many keys"],
)
def test_large_files_are_read_soon(tmp_path, content):
    """They took from seconds to minutes: the second ten times as long as now."""
    (tmp_path / "a.yaml").write_bytes(content)
    begun = time.process_time()
    read_settings(tmp_path / "a.yaml")
    assert time.process_time() - begun < 1


@pytest.mark.slow
def test_the_settings_of_a_run_on_fifty_thousand_scenes(tmp_path):
    numbers = range(50_000)
    files = [f"/data/rooms/of/many/kinds/train/room-{number:06d}.h5" for number in numbers]
    settings = {"files": files, "targets": {f"room-{number:06d}": [1, 22, 333, 4444, 5555] for number in numbers}}
    write_settings(tmp_path / "run.yaml", settings, "A head")
    assert read_settings(tmp_path / "run.yaml") == settings
