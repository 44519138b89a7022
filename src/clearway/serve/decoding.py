"""Strangers' picture files to pixels: three formats, sizes and scans checked first, every decoder fault a refusal.

Decoder processes import this, and start the sooner the less stands here: Pillow alone.
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass

from PIL import Image

FORMATS = ("JPEG", "PNG", "WEBP")
CONTENT_TYPES = ("image/jpeg", "image/png", "image/webp")
TOO_LARGE = (Image.DecompressionBombError, Image.DecompressionBombWarning)
MARKER = re.compile(rb"\xff+([^\x00\xff\xd0-\xd7])", re.DOTALL)  # of JPEG; \xff\x00 is data, \xd0 to \xd7 restart it
START_OF_SCAN, END_OF_IMAGE, ALONE = 0xDA, 0xD9, (0x01, 0xD8)  # the last: markers without content


@dataclass(frozen=True)
class Bounds:
    """What is looked for before a picture is decoded.

    Attributes:
        pixels: height times width, at most.
        side: height and width, at most.
        scans: of a JPEG, at most; each goes over the whole picture.
    """

    pixels: int
    side: int
    scans: int


class Refused(Exception):
    """A picture that is not taken.

    Args:
        code: "unsupported_picture", "picture_too_large" or "unreadable_picture".
        message: what was wrong and the remedy.
    """

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code, self.message = code, message


def scans_of(content: bytes, most: int) -> int:
    """How many scans a JPEG file has before its end, counted up to one more than `most`."""
    found, place = 0, 2
    while (marker := MARKER.search(content, place)) and found <= most:
        kind, place = marker[1][0], marker.end()
        if kind == END_OF_IMAGE:
            break
        if kind in ALONE:
            continue
        found += kind == START_OF_SCAN
        place += int.from_bytes(content[place : place + 2], "big")  # a marker's content says its length
    return found


def decoded(content: bytes, bounds: Bounds) -> Image.Image:
    """The picture in a JPEG, PNG or WebP file, in mode RGB; transparency and orientation are ignored.

    Raises:
        Refused: it is in no such format, has greys of more than 8 bits, is larger than allowed, or is damaged.
    """
    try:
        with Image.open(io.BytesIO(content), formats=FORMATS) as file:
            _check(file, content, bounds)
            return file.convert("RGB")
    except Refused:
        raise
    except Image.UnidentifiedImageError as fault:
        raise Refused("unsupported_picture", f"not a picture in one of the formats {', '.join(FORMATS)}") from fault
    except TOO_LARGE as fault:
        raise Refused("picture_too_large", f"at most {bounds.pixels} pixels are taken") from fault
    except Exception as fault:  # decoders raise a dozen kinds about damaged files
        raise Refused("unreadable_picture", "the picture is damaged or cut off. Send it again") from fault


def _check(file: Image.Image, content: bytes, bounds: Bounds) -> None:
    """Raise Refused where the file's head says that it is not to be decoded."""
    width, height = file.size
    if width * height > bounds.pixels or max(width, height) > bounds.side:
        most = f"at most {bounds.pixels} in all and {bounds.side} a side are taken"
        raise Refused("picture_too_large", f"{width} x {height} pixels, {most}")
    if file.mode.startswith(("I", "F")):
        raise Refused("unsupported_picture", "more than 8 bits a grey level. Send 8 bits, grey or RGB")
    if content.startswith(b"\xff\xd8") and scans_of(content, bounds.scans) > bounds.scans:
        raise Refused("unsupported_picture", f"more than {bounds.scans} scans. Send a JPEG that is not progressive")
