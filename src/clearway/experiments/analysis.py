"""What the reward does, exactly: soft fixed points and optima over a grid of settings, and the agents among them.

No training is needed: everything but the agents' own points follows by dynamic programming.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from clearway.choices import ZoneLevel
from clearway.evaluation.episodes import episode_starts
from clearway.evaluation.metrics import METRIC_NAMES, average, by_scene
from clearway.evaluation.optimum import world_yardsticks
from clearway.evaluation.oracle import ENTROPY_WEIGHT, Expected
from clearway.experiments import table1
from clearway.experiments.groups import PAIR, all_jobs, compared
from clearway.experiments.kept import keep, kept
from clearway.experiments.plan import Job
from clearway.experiments.section import ReportFigure, ReportTable, Section, Series, Value
from clearway.experiments.setting import Setting
from clearway.reward import COLLISION_AWARE, Reward
from clearway.world.world import World

FILE = "analysis.json"
BETAS = (-0.01, -0.02, -0.05, -0.1, -0.2)
GAMMA_SHARES = (0.0, 0.1, 0.5)  # of the way from alpha to beta; the paper's gamma -0.011 lies at 0.1
ENTROPIES = (0.003, 0.01, 0.03)
LEVELS: tuple[ZoneLevel, ...] = ("pose", "cell")
FIGURES = ("steps", "collisions", "collision_visits", "precollision_visits")
SHOWN = {
    "collision_visits": ("steps in the collision zone an episode", None),
    "collisions": ("collisions an episode", 0.01),
}
"""What is drawn against steps: its label, and where its axis turns logarithmic."""


@dataclass(frozen=True)
class Point:
    """A setting of the reward and the loss."""

    beta: float
    gamma: float
    entropy: float
    clip: bool
    level: ZoneLevel

    @property
    def reward(self) -> Reward:
        """The reward of the setting."""
        return COLLISION_AWARE.with_changes(beta=self.beta, gamma=self.gamma, clip=self.clip)


PAPER = COLLISION_AWARE.parameters
PAPERS_POINT = Point(PAPER["beta"], PAPER["gamma"], ENTROPY_WEIGHT, True, "pose")


def grid(whole: bool) -> Iterator[Point]:
    """The settings.

    Both penalties together, with the paper's entropy weight, clipped, at pose level; and entropy weights, clipping and
    levels together, with the penalties of the shortest-path reward and of the paper's.

    Args:
        whole: False leaves most penalties out.
    """
    for beta in BETAS if whole else BETAS[:2]:
        for share in GAMMA_SHARES if whole else GAMMA_SHARES[1:2]:
            gamma = round(PAPER["alpha"] + share * (beta - PAPER["alpha"]), 6)
            yield replace(PAPERS_POINT, beta=beta, gamma=gamma)
    for beta, gamma in ((PAPER["alpha"], PAPER["alpha"]), (PAPERS_POINT.beta, PAPERS_POINT.gamma)):
        for entropy in ENTROPIES:
            for clip in (True, False):
                for level in LEVELS:
                    yield Point(beta, gamma, entropy, clip, level)


def jobs(setting: Setting) -> list[Job]:
    """What must be done for the agents' points: nothing that the main experiment does not do."""
    return all_jobs(compared(setting, PAIR))


def section(setting: Setting) -> Section:
    """What came of it."""
    found = _solved(setting, list(dict.fromkeys(grid(setting.budget.whole_grid))))
    rows: list[tuple[Value, ...]] = []
    for point, policies in found:
        for policy, figures in policies.items():
            rows.append((policy, *asdict(point).values(), *(figures[name] for name in FIGURES)))
    headings = ("policy", "beta", "gamma", "entropy weight", "rewards clipped", "zones of", *FIGURES)
    return Section(
        name="analysis",
        title="What the reward does, exactly",
        text=(
            "Expected figures an episode, mean over scenes of the means over targets and the agents' starts. Optimal: "
            "the best policy, ties taken alike. Soft: where the loss comes to rest with that entropy weight; the "
            f"paper's: beta {PAPERS_POINT.beta:g}, gamma {PAPERS_POINT.gamma:g}, entropy {ENTROPY_WEIGHT:g}, clipped, "
            "pose level. Visits are counted in zones of the setting's own level, so those of the two levels do not "
            "compare. The figures show the pose level at the paper's entropy weight."
        ),
        tables=(ReportTable("analysis", "Soft fixed points and optima", headings, tuple(rows), folded=True),),
        figures=tuple(_pareto(setting, found, metric) for metric in SHOWN),
    )


Solved = list[tuple[Point, dict[str, dict[str, float]]]]


def _solved(setting: Setting, points: Sequence[Point]) -> Solved:
    """Figures of every point; those solved before are read from the analysis's file."""
    path = setting.out / FILE
    trial = setting.trial()
    of = {
        "scenes": {f.name: [f.digest, list(own)] for f, own in zip(setting.files, setting.targets, strict=True)},
        "starts": [trial.episodes_per_target, trial.seed],
    }
    known: dict[str, dict] = kept(path, of, "points") or {}
    worlds = {level: setting.world(zone_level=level) for level in LEVELS}
    starts = episode_starts(worlds["pose"], trial.episodes_per_target, trial.seed)
    for point in points:
        key = json.dumps(asdict(point))
        if key not in known:
            known[key] = _figures(worlds, point, starts)
            keep(path, of, {"points": known})
    return [(point, known[json.dumps(asdict(point))]) for point in points]


def _figures(worlds: dict[ZoneLevel, World], point: Point, starts: np.ndarray) -> dict[str, dict[str, float]]:
    """Of the optimal and the soft policy, from starts (M, E). Visits are those of zones of the point's own level."""
    world = worlds[point.level]
    solved = world_yardsticks(world, point.reward, entropy_weight=point.entropy, starts=starts)
    exact = [each.yardstick for each in solved]

    def means(policies: Sequence[Expected]) -> dict[str, float]:
        values = np.array([[getattr(policy, name) for name in FIGURES] for policy in policies])
        return dict(zip(FIGURES, average(by_scene(values, world.target_scene.numpy())).tolist(), strict=True))

    return {"optimal": means([each.optimal for each in exact]), "soft": means([each.soft for each in exact])}


def _pareto(setting: Setting, found: Solved, metric: str) -> ReportFigure:
    """Steps against collisions or visits at the paper's entropy weight: fixed points, those no other beats, agents."""
    solved = [
        (policies["soft"]["steps"], policies["soft"][metric], point)
        for point, policies in found
        if (point.level, point.entropy) == (PAPERS_POINT.level, PAPERS_POINT.entropy)
    ]
    clipped, unclipped = ([(x, y) for x, y, point in solved if point.clip == clip] for clip in (True, False))
    front, own = pareto_front(clipped), [(x, y) for x, y, point in solved if point == PAPERS_POINT]
    series = [
        _points("fixed points, rewards clipped", clipped),
        replace(_points("Pareto front of these", front), points=False),
        _points("fixed points, not clipped", unclipped),
    ]
    world = setting.world()
    target_scene = world.target_scene.numpy()
    for group in table1.all_groups(setting):  # those that are complete
        values = group.scores(setting.out, world.target_count)
        if len(values):
            means = average(by_scene(values.values, target_scene))  # (R, J)
            x, y = (means[:, METRIC_NAMES.index(name)].tolist() for name in ("steps", metric))
            series.append(Series(f"{group.learner}, {group.agent}", x, y, points=True))
    series.append(replace(_points("fixed point, the paper's reward", own), highlighted=True))
    label, linear_below = SHOWN[metric]
    title = f"{label.capitalize()}, against steps"
    return ReportFigure(f"analysis_{metric}", title, "steps an episode", label, tuple(series), linear_below)


def _points(label: str, points: Sequence[tuple[float, float]]) -> Series:
    return Series(label, [x for x, _ in points], [y for _, y in points], points=True)


def pareto_front(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """The points that no other beats in both figures (smaller is better), from left to right."""
    front: list[tuple[float, float]] = []
    for x, y in sorted(set(points)):
        if not front or y < front[-1][1]:
            front.append((x, y))
    return front
