"""Words as users write them."""

import pytest

from clearway.spelling import did_you_mean, nearest, whole_number


@pytest.mark.parametrize(
    ("text", "number"),
    [("600000", 600_000), ("600_000", 600_000), ("1e6", 1_000_000), ("1.5e6", 1_500_000), ("-2E3", -2000), ("7.0", 7)],
)
def test_whole_numbers(text, number):
    found = whole_number(text)
    assert (found, type(found)) == (number, int)


@pytest.mark.parametrize("text", ["", "many", "1.5", "1e-3", "nan", "inf", "1e999999999", "0x10", "1,000"])
def test_what_is_no_whole_number(text):
    with pytest.raises(ValueError, match="expected a whole number, such as 600000 or 6e5"):
        whole_number(text)


def test_the_nearest_name():
    names = ("collision-aware", "shortest", "bump", "living_room")
    assert nearest("colision_aware", names) == "collision-aware"
    assert nearest("Bumb", names) == "bump"
    assert nearest("living-rom", names) == "living_room"
    assert nearest("kitchen", names) is None
    assert nearest("sac", ("ppo", "a3c")) is None
    assert nearest(3, names) is None


def test_the_sentence_of_an_error():
    assert did_you_mean("shortset", ("shortest",)) == " Did you mean shortest?"
    assert did_you_mean("x", ("shortest",)) == ""
