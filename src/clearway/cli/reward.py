"""The reward on the command line: its name, and an option for every parameter that a term has."""

from __future__ import annotations

import warnings
from dataclasses import asdict, field, fields, make_dataclass
from typing import TYPE_CHECKING, Annotated

import tyro

from clearway.reward import REWARDS, TERMS, Reward, reward_named

COSTS = ("alpha", "beta", "gamma")
"""Parameters that a step pays, in each reward that has them."""
RewardChoice = Annotated[
    str,
    tyro.conf.arg(metavar="NAME", help=f"{', '.join(REWARDS)}; or one of your own, package.module:name."),
]

if TYPE_CHECKING:

    class RewardParameters:
        """Parameters of the reward's terms."""

else:
    RewardParameters = make_dataclass(
        "RewardParameters",
        [
            (
                own.name,
                Annotated[float | None, tyro.conf.arg(help=f"{own.metadata['help']} By default the reward's own.")],
                field(default=None),
            )
            for term in TERMS.values()
            for own in fields(term)
        ],
        frozen=True,
        namespace={"__doc__": "Parameters of the reward's terms, instead of its own; a term it lacks is added."},
    )


def chosen_reward(name: str, parameters: RewardParameters, clip: bool | None = None) -> Reward:
    """The reward of a name with parameters changed; None changes nothing.

    Raises:
        RewardError: there is no such reward, or a value is NaN or infinite.

    Warns:
        UserWarning: a step's cost is given as what it earns.
    """
    given = given_parameters(parameters)
    reward = reward_named(name).with_changes(clip=clip, **given)
    for cost in COSTS:
        if given.get(cost, 0) > 0:
            warnings.warn(f"--{cost} {given[cost]:g}: steps earn it. A cost is negative", stacklevel=2)
    return reward


def given_parameters(parameters: RewardParameters) -> dict[str, float]:
    """The parameters that are given, by name."""
    values: dict[str, float | None] = asdict(parameters)  # type: ignore[call-overload]  # made above
    return {name: value for name, value in values.items() if value is not None}
