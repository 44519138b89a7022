"""Does a reward do in other rooms what it does in one? An agent for each room and reward; rooms are the chance.

All other experiments train one agent for all scenes of the setting, and their verdicts are about these scenes. Here
every scene has agents of its own, under both of the paper's rewards, and a verdict is about rooms like them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from clearway.evaluation.across_rooms import ratio_estimate, sign_flip_p
from clearway.evaluation.across_seeds import mean_estimate
from clearway.experiments.convergence import ARRIVING, DETOUR, ONE_TARGET, frames_until_settled, mark_steps
from clearway.experiments.groups import PAIR, Scores, all_jobs, compared, random_walk
from clearway.experiments.plan import Job
from clearway.experiments.section import Claim, ReportFigure, ReportTable, Section, Series, Value, Verdict
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import LOST, SAME, further
from clearway.reward import COLLISION_AWARE, SHORTEST

NAME = "across-rooms"
LEAST_ROOMS = 6
"""Fewer decide nothing: of five rooms that all agree p is 6 %."""
FIGURES = {"frames": "frames until settled", "collisions": "collisions", "steps": "steps"}
WORDS = {"frames": "settles sooner", "collisions": "fewer collisions", "steps": "no more steps"}


@dataclass(frozen=True)
class InRoom:
    """What a learner's agents of one reward come to in one room.

    Attributes:
        scores: of the complete runs.
        frames: (R, 1) until training had settled.
        settled: how many have.
    """

    scores: Scores
    frames: np.ndarray
    settled: int

    @property
    def figures(self) -> dict[str, float]:
        """Means over seeds and targets by `FIGURES`."""
        steps, collisions = (float(self.scores.of(name).mean()) for name in ("steps", "collisions"))
        return {"frames": float(self.frames.mean()), "collisions": collisions, "steps": steps}


def jobs(setting: Setting) -> list[Job]:
    """What must be done: an agent for each room, learner, reward and seed."""
    return [job for room in _rooms(setting) for job in all_jobs(compared(room, PAIR))]


def section(setting: Setting) -> Section:
    """What came of it."""
    rooms = _rooms(setting)
    walks = [random_walk(room.world(), room.trial()) for room in rooms]
    rows: list[tuple[Value, ...]] = []
    found: dict[str, list[dict[str, InRoom]]] = {learner: [] for learner in setting.learners}
    for room, walked in zip(rooms, walks, strict=True):
        for learner, own in _in_room(room).items():
            found[learner].append(own)
            rows += [_row(room, walked, learner, reward, own[reward]) for reward in own]
    headings = ("room", "poses", "random walk's steps", "shortest path", "learner", "agent", "seeds", "settled")
    note = (
        f"An agent for each room, learner, reward and seed. Settled: from there on {ARRIVING:.0%} of training episodes "
        f"reach their target, all in at most {DETOUR:g} times the shortest paths' steps on average, and the trained "
        "agent misses none; a run that has not counts with all its frames."
    )
    return Section(
        name=NAME,
        title="Across rooms",
        text=(
            "The paper's two rewards in rooms that have an agent each. Verdicts are over rooms: the ratio of both "
            "rewards' figures in each room, its geometric mean, and an exact permutation test that changes its sign."
        ),
        tables=(
            ReportTable(NAME, "Room by room", (*headings, *FIGURES.values(), "failed targets"), tuple(rows), (note,)),
        ),
        figures=tuple(_figures(walks, found)),
        claims=further(claim for learner, own in found.items() for claim in _claims(setting, learner, own)),
    )


def _rooms(setting: Setting) -> list[Setting]:
    """The setting with one scene alone, for each."""
    return [
        replace(setting, files=(file,), scenes=(scene,), targets=(targets,))
        for file, scene, targets in zip(setting.files, setting.scenes, setting.targets, strict=True)
    ]


def _in_room(room: Setting) -> dict[str, dict[str, InRoom]]:
    """By learner and reward."""
    world, mark = room.world(), mark_steps(room, room.targets)
    found: dict[str, dict[str, InRoom]] = {}
    for group in compared(room, PAIR):
        frames, settled = frames_until_settled(room.out, group, mark)
        own = InRoom(group.scores(room.out, world.target_count), frames, settled)
        found.setdefault(group.learner, {})[group.agent] = own
    return found


def _row(room: Setting, walked: Scores, learner: str, reward: str, own: InRoom) -> tuple[Value, ...]:
    (scene,) = room.scenes
    steps, shortest = (float(walked.of(name).mean()) for name in ("steps", "shortest_path_steps"))
    of_room = scene.name, scene.state_count, steps, shortest
    if not len(own.scores):
        return (*of_room, learner, reward, 0, None, *(None for _ in FIGURES), None)
    return (*of_room, learner, reward, len(own.scores), own.settled, *own.figures.values(), own.scores.failed())


def _complete(rooms: Sequence[dict[str, InRoom]]) -> list[int]:
    """Numbers of the rooms of which both rewards have complete runs, with metrics."""
    return [n for n, own in enumerate(rooms) if all(len(one.scores) and len(one.frames) for one in own.values())]


def _figures(walks: Sequence[Scores], found: dict[str, list[dict[str, InRoom]]]) -> Iterator[ReportFigure]:
    """For each learner how many times the baseline's frames each room takes, over how large it is."""
    sizes = [float(walked.of("steps").mean()) for walked in walks]
    ratios = {
        learner: [(sizes[n], _pair(rooms[n], "frames")) for n in _complete(rooms)] for learner, rooms in found.items()
    }
    series = tuple(
        Series(learner, [size for size, _ in own], [ours / theirs for _, (ours, theirs) in own], points=True)
        for learner, own in ratios.items()
        if own
    )
    if series:
        title = f"{COLLISION_AWARE.name}: frames until settled, as a share of {SHORTEST.name}'s"
        yield ReportFigure(NAME, title, "steps of a random walk to a target", "ratio", series)


def _pair(own: dict[str, InRoom], figure: str) -> tuple[float, float]:
    ours, theirs = (own[reward.name].figures[figure] for reward in (COLLISION_AWARE, SHORTEST))
    return ours, theirs


def _claims(setting: Setting, learner: str, rooms: Sequence[dict[str, InRoom]]) -> Iterator[Claim]:
    """The collision-aware agents settle sooner, collide less and take no more steps, over rooms."""
    complete = [rooms[number] for number in _complete(rooms)]
    for figure, words in WORDS.items():
        text = f"{learner}: over rooms, {COLLISION_AWARE.name}, {words} than {SHORTEST.name}"
        if not complete:
            yield Claim(text, "undecided", "No complete runs.")
            continue
        ours, theirs = np.array([_pair(own, figure) for own in complete]).T
        if figure == "collisions":  # one more in all episodes, so that there is a ratio
            episodes = setting.budget.episodes_per_target * np.array([_trained_targets(own) for own in complete])
            ours, theirs = ours + 1 / episodes, theirs + 1 / episodes
        allowed = 1 + SAME if figure == "steps" else 1.0
        yield _judged(text, FIGURES[figure], ours, theirs, allowed, [_arrived(own) for own in complete])


def _trained_targets(own: dict[str, InRoom]) -> int:
    """Targets of all seeds of a room."""
    success = own[SHORTEST.name].scores.of("success")
    return success.size


def _arrived(own: dict[str, InRoom]) -> tuple[float, float]:
    """The share of episodes that arrive in a room, of both rewards."""
    ours, theirs = (float(own[reward.name].scores.of("success").mean()) for reward in (COLLISION_AWARE, SHORTEST))
    return ours, theirs


def _judged(
    text: str,
    what: str,
    ours: np.ndarray,
    theirs: np.ndarray,
    allowed: float,
    arrived: Sequence[tuple[float, float]],
) -> Claim:
    """A claim over rooms; undecided, too, where those whom it favours arrive less often.

    Args:
        text: the claim.
        what: is compared.
        ours, theirs: (K,) a figure of each room.
        allowed: the ratio up to which it is no more.
        arrived: share of episodes of both kinds, room by room.
    """
    ratio = ratio_estimate(ours, theirs)
    means = {name: mean_estimate(own[:, None], ONE_TARGET) for name, own in (("first", ours), ("second", theirs))}
    fewer = int((ours < theirs * allowed).sum())
    evidence = (
        f"{what}: {means['first']} against {means['second']}, ratio {ratio}, geometric mean over rooms; it lies below "
        f"{allowed:g} in {fewer} of {len(ours)} rooms."
    )
    numbers = {**means, "ratio": ratio}
    if len(ours) < LEAST_ROOMS:
        return Claim(text, "undecided", f"{evidence} Fewer than {LEAST_ROOMS} rooms decide nothing.", numbers)
    p = sign_flip_p(ours, theirs, allowed)
    first, second = np.array(arrived).mean(axis=0)
    verdict = _side(ratio.interval, allowed)
    told = f"Episodes that arrived, mean over rooms: {first:.2%}, {second:.2%}"
    favours = {"holds": first - second, "does not hold": second - first}
    if favours.get(verdict, 0.0) < -LOST:
        verdict, told = "undecided", f"{told}, so that the figures compare different episodes"
    return Claim(text, verdict, f"{evidence} {told}.", numbers, p=p)


def _side(interval: tuple[float, float] | None, allowed: float) -> Verdict:
    assert interval is not None, "there are several rooms"
    low, high = interval
    return "holds" if high < allowed else "does not hold" if low > allowed else "undecided"
