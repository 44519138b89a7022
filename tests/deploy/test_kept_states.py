"""What agents of every kind remember, kept as bytes by the service."""

import pytest

from clearway.deploy.from_run import RunAgent
from clearway.deploy.navigator import open_agent
from helpers.session_records import assert_goes_on_to_the_bit


@pytest.mark.parametrize("kind", ["a run", "its file", "the generalist", "the generalist's file"])
def test_a_state_goes_on_to_the_bit_after_a_round_trip(kind, deployed, one_file) -> None:
    agents = {
        "a run": lambda: RunAgent(deployed.chosen),
        "its file": lambda: open_agent(deployed.agent),
        "the generalist": lambda: one_file.torch,
        "the generalist's file": lambda: open_agent(one_file.path),
    }
    assert_goes_on_to_the_bit(agents[kind]())
