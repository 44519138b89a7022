"""Settings in YAML: plain values, within limits; whatever else is one clear error."""

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
        (b"frames: [1", "line 1: not read"),
        (b"frames: 1\nseed: 2\nframes: 3", "line 3: not read (the key frames occurs twice)"),
        (b"a: &x [1]\nb: [*x, *x]", "line 2: not read (an alias"),
        (b"a: !!python/object/apply:os.system ['true']", "not read"),
        (b"- frames", "expected an option a line, such as frames: 600000"),
        (b"1: 2", "expected an option a line, such as"),
        (b"a: 2020-13-45", "not read"),
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
