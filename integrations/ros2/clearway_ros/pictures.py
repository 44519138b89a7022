"""ROS pictures as arrays (height, width, 3) uint8, RGB. Messages are read by their fields alone."""

from __future__ import annotations

import io
import math
from typing import Any

import numpy as np

MAX_SIDE = 4_096  # pixels, of the agent's pictures
CHANNELS = {"rgb8": (0, 1, 2), "bgr8": (2, 1, 0), "rgba8": (0, 1, 2), "bgra8": (2, 1, 0), "mono8": (0, 0, 0)}
BYTES = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4, "mono8": 1}


class PictureError(ValueError):
    """A message holds no picture that can be used; one line says why."""


def raw_picture(message: Any) -> np.ndarray:
    """The picture of a sensor_msgs/Image. Raises PictureError."""
    if message.encoding not in CHANNELS:
        raise PictureError(f"encoding {message.encoding!r:.40}: expected one of {', '.join(CHANNELS)}")
    height, width, row = int(message.height), int(message.width), int(message.step)
    each = BYTES[message.encoding]
    content = np.frombuffer(bytes(message.data), np.uint8)
    if not (0 < height <= MAX_SIDE and 0 < width <= MAX_SIDE) or row < width * each or len(content) != height * row:
        size = f"{width} x {height} pixels in rows of {row} bytes, {len(content)} bytes"
        raise PictureError(f"the picture is {size}: these do not fit, or a side is above {MAX_SIDE}")
    pixels = content.reshape(height, row)[:, : width * each].reshape(height, width, each)
    return np.ascontiguousarray(pixels[..., CHANNELS[message.encoding]])


def compressed_picture(message: Any) -> np.ndarray:
    """The picture of a sensor_msgs/CompressedImage: JPEG or PNG. Raises PictureError."""
    from PIL import Image

    try:
        with Image.open(io.BytesIO(bytes(message.data)), formats=("JPEG", "PNG")) as file:
            if max(file.size) > MAX_SIDE:
                raise PictureError(f"the picture is {file.width} x {file.height} pixels, at most {MAX_SIDE} a side")
            return np.asarray(file.convert("RGB"))
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as fault:
        if isinstance(fault, PictureError):
            raise
        raise PictureError(f"the compressed picture cannot be read ({' '.join(str(fault).split())[:120]})") from fault


def yaw_of(orientation: Any) -> float:
    """Angle about z of a geometry_msgs/Quaternion, radians, counter-clockwise."""
    x, y, z, w = orientation.x, orientation.y, orientation.z, orientation.w
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
