"""`take_views` and `open_views`: refusals name the argument that they are about."""

import pytest

import clearway


def test_refusals_name_the_argument_that_was_given(tmp_path) -> None:
    for wrong in ([], 3):
        with pytest.raises(clearway.ClearwayError, match=r"^scenes(=3)?: "):
            clearway.take_views(wrong, out=tmp_path / "views")  # type: ignore[arg-type]
        with pytest.raises(clearway.ClearwayError, match=r"^views(=3)?: "):
            clearway.open_views(wrong)  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())
