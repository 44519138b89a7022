import numpy as np

from clearway.agents.memory import history


def test_the_newest_comes_last_and_fills_what_begins():
    earlier = np.array([[1, 2, 3], [4, 5, 6]])
    found = history(earlier, np.array([True, False]), np.array([9, 8]))
    assert found.tolist() == [[1, 2, 3, 9], [8, 8, 8, 8]]
    assert earlier.tolist() == [[1, 2, 3], [4, 5, 6]]


def test_what_is_remembered_may_have_any_shape_and_its_kind_stays():
    earlier = np.zeros((2, 1, 3), np.float32)
    newest = np.array([[1, 2, 3], [4, 5, 6]], np.float32)
    found = history(earlier, np.array([False, True]), newest)
    assert found.dtype == np.float32
    assert found.tolist() == [[[1, 2, 3], [1, 2, 3]], [[0, 0, 0], [4, 5, 6]]]


def test_a_history_of_one_is_what_is_seen_now():
    found = history(np.zeros((2, 0), np.int64), np.array([True, False]), np.array([7, 8]))
    assert found.tolist() == [[7], [8]]
