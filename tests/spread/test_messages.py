"""Objects as messages: what is sent arrives as itself."""

import pickle

import numpy as np

from clearway.spread.messages import Sent


class Counted:
    """Counts how often it is pickled."""

    times = 0

    def __reduce__(self) -> tuple[type, tuple]:
        Counted.times += 1
        return Counted, ()


def test_what_is_sent_to_several_is_pickled_once_and_arrives_as_itself() -> None:
    sent = Sent([Counted(), np.arange(3)])
    for protocol in (2, pickle.HIGHEST_PROTOCOL):
        thing, numbers = pickle.loads(pickle.dumps(sent, protocol))
        assert (type(thing), numbers.tolist()) == (Counted, [0, 1, 2])
    assert Counted.times == 1
