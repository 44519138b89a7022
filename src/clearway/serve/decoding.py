"""Strangers' picture files into arrays: three formats, sizes checked before decoding, every decoder fault a refusal."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image

from clearway.deploy.agent import MAX_PICTURE_SIDE
from clearway.serve.faults import Fault

FORMATS = ("JPEG", "PNG", "WEBP")
CONTENT_TYPES = ("image/jpeg", "image/png", "image/webp")
TOO_LARGE = (Image.DecompressionBombError, Image.DecompressionBombWarning)


def decoded(content: bytes, most_pixels: int) -> np.ndarray:
    """The picture in a JPEG, PNG or WebP file, (height, width, 3) uint8 RGB; transparency and orientation are ignored.

    Raises:
        Fault: it is in no such format, has greys of more than 8 bits, is larger than allowed, or is damaged.
    """
    try:
        with Image.open(io.BytesIO(content), formats=FORMATS) as file:
            width, height = file.size
            if width * height > most_pixels or max(width, height) > MAX_PICTURE_SIDE:
                bounds = f"at most {most_pixels} in all and {MAX_PICTURE_SIDE} a side are taken"
                raise Fault("picture_too_large", f"{width} x {height} pixels, {bounds}")
            if file.mode.startswith(("I", "F")):
                raise Fault("unsupported_picture", "more than 8 bits a grey level. Send 8 bits, grey or RGB")
            return np.array(file.convert("RGB"))
    except Fault:
        raise
    except Image.UnidentifiedImageError as fault:
        raise Fault("unsupported_picture", f"not a picture in one of the formats {', '.join(FORMATS)}") from fault
    except TOO_LARGE as fault:
        raise Fault("picture_too_large", f"at most {most_pixels} pixels are taken") from fault
    except Exception as fault:  # decoders raise a dozen kinds about damaged files
        raise Fault("unreadable_picture", "the picture is damaged or cut off. Send it again") from fault
