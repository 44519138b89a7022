"""Strangers' picture files."""

import io
import struct
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from clearway.deploy.agent import MAX_PICTURE_SIDE
from clearway.serve import decoding
from clearway.serve.decoding import Bounds, Refused, scans_of
from helpers.serving import many_scans, picture_bytes

NOISE = np.random.default_rng(0).integers(0, 256, (20, 30, 3), np.uint8)
LIMIT, MOST_SCANS = 10_000, 100


def decoded(content: bytes, most_pixels: int) -> np.ndarray:
    return np.asarray(decoding.decoded(content, Bounds(most_pixels, MAX_PICTURE_SIDE, MOST_SCANS)))


def code(content: bytes, most_pixels: int = LIMIT) -> str:
    with pytest.raises(Refused) as caught:
        decoded(content, most_pixels)
    return caught.value.code


def png(width: int, height: int, rows: bytes = b"") -> bytes:
    """A PNG of a size that its rows need not fill: 8-bit grey."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


def test_lossless_formats_give_the_picture_back() -> None:
    assert np.array_equal(decoded(picture_bytes(NOISE), LIMIT), NOISE)
    assert np.array_equal(decoded(picture_bytes(NOISE, "WEBP", lossless=True), LIMIT), NOISE)
    smooth = np.full((20, 30, 3), (200, 100, 50), np.uint8)
    found = decoded(picture_bytes(smooth, "JPEG", quality=95), LIMIT)
    assert found.shape == (20, 30, 3) and np.abs(found.astype(int) - smooth).max() < 5


@pytest.mark.parametrize("mode", ["L", "P", "RGBA", "1", "LA"])
def test_other_colours_become_rgb(mode) -> None:
    file = io.BytesIO()
    Image.fromarray(NOISE).convert(mode).save(file, "PNG")
    found = decoded(file.getvalue(), LIMIT)
    assert (found.shape, found.dtype) == ((20, 30, 3), np.uint8)


@pytest.mark.parametrize("kind", ["GIF", "BMP", "TIFF", "PPM", "ICO", "TGA", "PDF"])
def test_other_formats_are_refused(kind) -> None:
    assert code(picture_bytes(NOISE, kind)) == "unsupported_picture"


@pytest.mark.parametrize("content", [b"", b"x", b"\x89PNG", b"<svg/>", b"%!PS-Adobe-3.0 EPSF-3.0\n", bytes(1000)])
def test_what_is_no_picture_is_refused(content) -> None:
    assert code(content) in ("unsupported_picture", "unreadable_picture")


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP"])
def test_files_that_were_cut_off(kind) -> None:
    content = picture_bytes(NOISE, kind)
    for share in (0.02, 0.1, 0.5, 0.9):
        assert code(content[: int(share * len(content))]) in ("unsupported_picture", "unreadable_picture")


@pytest.mark.parametrize(("width", "height"), [(60_000, 60_000), (100_001, 1), (101, 100), (2**31 - 1, 2**31 - 1)])
def test_sizes_are_checked_before_decoding(width, height, monkeypatch) -> None:
    """A few bytes that would unpack to gigabytes."""
    monkeypatch.setattr(Image.Image, "convert", lambda *_: pytest.fail("it was decoded"))
    assert code(png(width, height)) == "picture_too_large"


def test_deeper_greys_are_refused() -> None:
    """Converted to 8 bits, all but the darkest would be white."""
    file = io.BytesIO()
    Image.fromarray(np.full((4, 5), 20_000, np.uint16)).save(file, "PNG")
    assert code(file.getvalue()) == "unsupported_picture"


def test_pictures_are_no_longer_than_a_navigator_takes() -> None:
    """Their resizing takes memory by the side, not by the area."""
    for width, height in ((MAX_PICTURE_SIDE + 1, 1), (1, MAX_PICTURE_SIDE + 1)):
        assert code(png(width, height, bytes((width + 1) * height))) == "picture_too_large"
    assert decoded(png(MAX_PICTURE_SIDE, 1, bytes(MAX_PICTURE_SIDE + 1)), LIMIT).shape == (1, MAX_PICTURE_SIDE, 3)


def test_a_file_larger_inside_than_it_says_is_not_unpacked_further() -> None:
    rows = bytes(30_000_000)  # zlib makes 30 kB of it
    found = decoded(png(10, 10, rows), LIMIT)
    assert found.shape == (10, 10, 3)


def test_text_that_unpacks_without_end_is_refused() -> None:
    """PNG text chunks may be compressed too."""
    content = picture_bytes(NOISE)
    text = b"comment\0\0" + zlib.compress(bytes(80_000_000), 9)
    chunk = struct.pack(">I", len(text)) + b"zTXt" + text + struct.pack(">I", zlib.crc32(b"zTXt" + text))
    assert code(content[:33] + chunk + content[33:]) == "unreadable_picture"


@settings(max_examples=150, deadline=None)
@given(
    st.sampled_from(["PNG", "JPEG", "WEBP"]),
    st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 255)), max_size=8),
)
def test_damaged_files_are_decoded_or_refused(kind, changes) -> None:
    content = bytearray(picture_bytes(NOISE[:8, :8], kind))
    for place, value in changes:
        content[place % len(content)] = value
    try:
        found = decoded(bytes(content), LIMIT)
    except Refused:
        return
    assert found.dtype == np.uint8 and found.ndim == 3 and found.shape[2] == 3
    assert found.shape[0] * found.shape[1] <= LIMIT


def test_scans_of_a_jpeg_are_counted_before_it_is_decoded(monkeypatch) -> None:
    plainly, progressive = picture_bytes(NOISE, "JPEG"), picture_bytes(NOISE, "JPEG", progressive=True)
    assert (scans_of(plainly, MOST_SCANS), scans_of(progressive, MOST_SCANS)) == (1, 10)
    assert scans_of(many_scans(NOISE, 90), MOST_SCANS) == 100
    assert scans_of(many_scans(NOISE, 500), MOST_SCANS) == MOST_SCANS + 1  # counted no further
    assert decoded(many_scans(NOISE, 90), LIMIT).shape == NOISE.shape
    monkeypatch.setattr(Image.Image, "convert", lambda *_: pytest.fail("it was decoded"))
    with pytest.raises(Refused, match="more than 100 scans"):
        decoded(many_scans(NOISE, 91), LIMIT)


def test_what_looks_like_a_scan_inside_a_comment_is_none() -> None:
    file = io.BytesIO()
    Image.fromarray(NOISE).save(file, "JPEG", comment=b"\xff\xda" * 300)
    assert scans_of(file.getvalue(), MOST_SCANS) == 1
