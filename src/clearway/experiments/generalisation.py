"""What figures 5 and 6 share: success on unseen targets, stricter scores, and the random walk's beside them."""

from __future__ import annotations

from clearway.envs.world import World
from clearway.evaluate.across_seeds import mean_estimate
from clearway.experiments.groups import Scores
from clearway.experiments.section import Series, Value

METRICS = ("sc", "sc_4x", "spl")
HEADINGS = ("sc", "95 % of sc", "sc within 4 x shortest", "SPL")
NOTE = (
    "sc: share of episodes that reach the target in under 500 steps. It flatters: a random walk reaches much within "
    "500 steps, so beside it stand the share within 4 times the shortest path, and SPL."
)


def cells(values: Scores, world: World) -> tuple[Value, ...]:
    """The figures of some agents under `HEADINGS`."""
    if not len(values):
        return (None,) * len(HEADINGS)
    estimates = [mean_estimate(values.of(metric), world.target_scene.numpy()) for metric in METRICS]
    first, *rest = estimates
    return (first.value, first.ends, *(estimate.value for estimate in rest))


def line(label: str, points: list[tuple[float, Scores, World]]) -> Series | None:
    """The success score over something, with intervals where there are several seeds; None without any runs."""
    known = [
        (x, mean_estimate(values.of("sc"), world.target_scene.numpy())) for x, values, world in points if len(values)
    ]
    if not known:
        return None
    ends = [found.interval for _, found in known]
    complete = all(each is not None for each in ends)
    low = [each[0] for each in ends if each is not None] if complete else None
    high = [each[1] for each in ends if each is not None] if complete else None
    return Series(label, [x for x, _ in known], [found.value for _, found in known], low, high)
