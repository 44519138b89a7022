import numpy as np
import pytest
import torch

from clearway.errors import EncoderError
from clearway.perception.preprocess import Preprocessing, preprocessing_from_json, to_pixels

PLAIN = Preprocessing(4, 6, (0, 0, 0), (1, 1, 1))


def test_one_colour_stays_and_is_normalised_by_channel() -> None:
    picture = np.broadcast_to(np.array([0, 128, 255], np.uint8), (1, 30, 40, 3))
    pixels = to_pixels(picture, Preprocessing(8, 8, (0.5, 0.25, 0), (0.5, 1, 2)))
    assert pixels.shape == (1, 3, 8, 8)
    assert pixels.dtype == torch.float32
    expected = torch.tensor([-1, 128 / 255 - 0.25, 0.5]).view(1, 3, 1, 1)
    torch.testing.assert_close(pixels, expected.expand_as(pixels))


def test_the_edges_are_seen() -> None:
    pictures = np.zeros((2, 8, 12, 3), np.uint8)
    pictures[0, :, :2] = pictures[1, -2:] = 255
    left, bottom = to_pixels(pictures, PLAIN)
    assert left[0, :, 0].min() > 0.7
    assert left[0, :, 2:].max() < 0.01
    assert bottom[1, -1].min() > 0.7
    assert bottom[1, :2].max() < 0.01


def test_a_thin_line_is_averaged_not_skipped() -> None:
    picture = np.zeros((1, 40, 60, 3), np.uint8)
    picture[:, :, 31] = 255
    assert to_pixels(picture, PLAIN).sum(dim=3).max() > 0.08  # a tenth of a pixel's width


@pytest.mark.parametrize(
    "pictures", [np.zeros((1, 4, 4, 3)), np.zeros((4, 4, 3), np.uint8), np.zeros((1, 0, 4, 3), np.uint8)]
)
def test_what_is_no_picture_is_refused(pictures: np.ndarray) -> None:
    with pytest.raises(EncoderError, match="expected uint8"):
        to_pixels(pictures, PLAIN)


def test_json_round_trip_and_nonsense() -> None:
    made = Preprocessing(10, 20, (0.1, 0.2, 0.3), (1, 2, 3))
    assert preprocessing_from_json(made.to_json(), "x") == made
    for key, value in {
        "height": 0,
        "width": 10**9,
        "mean": [1, 2],
        "std": [1, 0, 1],
    }.items():
        with pytest.raises(EncoderError, match=key):
            preprocessing_from_json({**made.to_json(), key: value}, "x")
