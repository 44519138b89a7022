import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.errors import ClearwayError
from clearway.view.episode import LETTERS, Episode, actions_of, letters, read_episode

NUMBERS = st.none() | st.integers(0, 2**31 - 1)
EPISODES = st.builds(
    Episode,
    scene=st.none() | st.text(min_size=1, max_size=20),
    start=NUMBERS,
    target=NUMBERS,
    selection=st.sampled_from(["sampled", "argmax", "argmax-untried"]),
    seed=st.integers(0, 2**31 - 1),
    drive=st.booleans(),
    walks=st.lists(st.text(LETTERS, max_size=30), max_size=3).map(tuple),
)


@settings(max_examples=60, deadline=None)
@given(EPISODES)
def test_a_link_holds_the_whole_episode(episode: Episode) -> None:
    assert read_episode(episode.query()) == episode
    assert read_episode(f"http://127.0.0.1:8000/token/#{episode.query()}") == episode


def test_a_link_looks_like_this() -> None:
    episode = Episode("living room", 31, 48, "argmax", 7, True, ("FR", "", "LB"))
    assert (
        episode.query() == "scene=living+room&start=31&target=48&selection=argmax&seed=7&drive=1&walk=FR&walk=&walk=LB"
    )


def test_nothing_asked_for_is_an_episode_too() -> None:
    assert read_episode("") == Episode()


def test_letters_stand_for_the_actions_in_their_order() -> None:
    assert letters([0, 1, 2, 3, 0]) == "FRLBF"
    assert actions_of("FRLBF") == [0, 1, 2, 3, 0]


@pytest.mark.parametrize(
    ("link", "said"),
    [
        ("start=-1", "start=-1, expected a whole number"),
        ("start=1.5", "start=1.5"),
        ("target=٣", "target=٣"),
        ("seed=99999999999", "seed=99999999999"),
        ("selection=best", "selection=best, expected one of sampled, argmax, argmax-untried"),
        ("drive=yes", "drive=yes, expected 0 or 1"),
        ("walk=FRX", "walk=FRX"),
        ("walk=" + "F" * 1001, "at most 1000"),
        ("walk=F&walk=F&walk=F&walk=F", "it fewer times"),
        ("start=1&start=2", "start=2, expected it fewer times"),
        ("colour=red", "colour=red, expected one of scene"),
        ("scene=" + "x" * 9000, "at most 8000"),
    ],
)
def test_a_damaged_link_is_refused(link: str, said: str) -> None:
    with pytest.raises(ClearwayError) as refusal:
        read_episode(link)
    assert said in str(refusal.value)
