"""Every parameter of every term is an option of the commands that take a reward."""

from dataclasses import asdict, fields

import pytest

from clearway.cli.oracle import Oracle
from clearway.cli.reward import RewardParameters, chosen_reward
from clearway.cli.train import Train
from clearway.errors import ClearwayError
from clearway.reward import COLLISION_AWARE, TERM_OF


def test_every_parameter_of_every_term_is_an_option_that_says_what_it_means() -> None:
    assert list(asdict(RewardParameters())) == list(TERM_OF)
    assert all(own.metadata["help"] for kind in TERM_OF.values() for own in fields(kind))
    for command in (Train, Oracle):
        assert {"reward", "parameters"} <= {own.name for own in fields(command)}


def test_options_change_the_reward_of_a_name() -> None:
    changed = chosen_reward("collision-aware", RewardParameters(beta=-0.5, clearance=0.1))
    assert changed == COLLISION_AWARE.with_changes(beta=-0.5, clearance=0.1)
    assert chosen_reward("collision-aware", RewardParameters()) == COLLISION_AWARE


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        (
            "clearence",
            {},
            r"'clearence' is unknown\. Did you mean clearance\? Use one of 'collision-aware', 'shortest', 'bump'",
        ),
        ("bump", {"clearance_m": -1.0}, "--clearance-m is -1.0, expected more than 0"),
        ("bump", {"blocked": float("inf")}, "--blocked is inf, expected a finite number"),
    ],
)
def test_rewards_that_cannot_be(name: str, parameters: dict[str, float], message: str) -> None:
    with pytest.raises(ClearwayError, match=message):
        chosen_reward(name, RewardParameters(**parameters))
