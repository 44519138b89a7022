"""Does a reward do in other rooms what it does in one? An agent for each room and reward; rooms are the chance.

All other experiments train one agent for all scenes of the setting, and their verdicts are about these scenes. Here
every scene has agents of its own, under both of the paper's rewards, and a verdict is about rooms like them. Rooms
have other seeds each, else all agents would begin with the same parameters.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from clearway.evaluation.across_rooms import ratio_estimate, sign_flip_p
from clearway.evaluation.across_seeds import Estimate, mean_estimate
from clearway.experiments.convergence import ARRIVING, DETOUR, ONE_TARGET, frames_until_settled, mark_steps
from clearway.experiments.groups import PAIR, Scores, all_jobs, compared, random_walk
from clearway.experiments.learnt_maps import ABOUT_MAPS, on_maps_of_room
from clearway.experiments.plan import Job
from clearway.experiments.section import Claim, ReportFigure, ReportTable, Section, Series, Value
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import SAME, further, side, with_failures
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
        frames: (R, 1) until training had settled, of those with metrics.
        settled: how many have.
        planned: how many runs there shall be.
    """

    scores: Scores
    frames: np.ndarray
    settled: int
    planned: int

    @property
    def is_complete(self) -> bool:
        """All runs are, and have metrics."""
        return len(self.scores) == len(self.frames) == self.planned

    @property
    def figures(self) -> dict[str, float]:
        """Means over seeds and targets by `FIGURES`, where it is complete."""
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
        "agent misses none, and not by the last row of metrics alone; a run that has not counts with all its frames. "
        "Rooms have seeds of their own, the first room those that were asked for, each other one the next ones."
    )
    return Section(
        name=NAME,
        title="Across rooms",
        text=(
            "The paper's two rewards in rooms that have agents of their own. Verdicts are over rooms: the ratio of "
            "both rewards' figures in each room, its geometric mean, and a permutation test that changes signs of its "
            f"logarithm. {SAME:.0%} more steps count as equal; to collisions one in all episodes of a room is added."
        ),
        tables=(
            ReportTable(NAME, "Room by room", (*headings, *FIGURES.values(), "failed targets"), tuple(rows), (note,)),
            _who_learn_nothing(rooms),
        ),
        figures=tuple(_figures(walks, found)),
        claims=further(claim for learner, own in found.items() for claim in _claims(setting, learner, own)),
        unjudged=f"fewer than {LEAST_ROOMS} rooms, or rooms that lack runs, decide nothing (one seed a room is enough)",
    )


def _rooms(setting: Setting) -> list[Setting]:
    """The setting with one scene alone, for each, and seeds that no other has."""
    seeds = np.arange(len(setting.scenes))[:, None] * len(setting.seeds) + setting.seeds
    return [
        replace(setting, files=(file,), scenes=(scene,), targets=(targets,), seeds=tuple(own.tolist()))
        for file, scene, targets, own in zip(setting.files, setting.scenes, setting.targets, seeds, strict=True)
    ]


def _in_room(room: Setting) -> dict[str, dict[str, InRoom]]:
    """By learner and reward."""
    world, mark = room.world(), mark_steps(room, room.targets)
    found: dict[str, dict[str, InRoom]] = {}
    for group in compared(room, PAIR):
        frames, settled = frames_until_settled(room.out, group, mark)
        own = InRoom(group.scores(room.out, world.target_count), frames, settled, len(group.runs))
        found.setdefault(group.learner, {})[group.agent] = own
    return found


def _row(room: Setting, walked: Scores, learner: str, reward: str, own: InRoom) -> tuple[Value, ...]:
    (scene,) = room.scenes
    steps, shortest = (float(walked.of(name).mean()) for name in ("steps", "shortest_path_steps"))
    of_room = scene.name, scene.state_count, steps, shortest
    if not own.is_complete:
        return (*of_room, learner, reward, len(own.scores), None, *(None for _ in FIGURES), None)
    return (*of_room, learner, reward, len(own.scores), own.settled, *own.figures.values(), own.scores.failed())


def _who_learn_nothing(rooms: Sequence[Setting]) -> ReportTable:
    """Agents on a map of each room, which know of no other, like those that are trained there."""
    rows: list[tuple[Value, ...]] = []
    for room in rooms:
        for mapped in on_maps_of_room(room):
            own, (scene,) = mapped.scores, room.scenes
            shortest, steps, bumps = (
                float(own.of(name).mean()) for name in ("shortest_path_steps", "steps", "collisions")
            )
            rows.append((scene.name, *mapped.called, len(own), shortest, steps, bumps, own.failed()))
    headings = ("room", "agent", "map of", "seeds", "shortest path", "steps", "collisions", "failed targets")
    return ReportTable(f"{NAME}-beside", "Beside them, who learn nothing", headings, tuple(rows), (ABOUT_MAPS,))


def _complete(rooms: Sequence[dict[str, InRoom]]) -> list[int]:
    """Numbers of the rooms whose runs of both rewards are complete."""
    return [number for number, own in enumerate(rooms) if all(one.is_complete for one in own.values())]


def _figures(walks: Sequence[Scores], found: dict[str, list[dict[str, InRoom]]]) -> Iterator[ReportFigure]:
    """For each learner how many times the baseline's frames each room takes, over how large it is."""
    series: list[Series] = []
    for learner, rooms in found.items():
        points = [
            (float(walks[n].of("steps").mean()), *_pair(rooms[n], "frames"), _has_settled(rooms[n]))
            for n in _complete(rooms)
        ]
        for settled, label in ((True, learner), (False, f"{learner}, not all runs settled")):
            own = [(size, ours / theirs) for size, ours, theirs, has in points if has is settled]
            if own:
                series.append(Series(label, [size for size, _ in own], [ratio for _, ratio in own], points=True))
    if series:
        title = f"{COLLISION_AWARE.name}: frames until settled, as a share of {SHORTEST.name}'s"
        yield ReportFigure(NAME, title, "steps of a random walk to a target", "ratio", tuple(series))


def _has_settled(own: dict[str, InRoom]) -> bool:
    return all(one.settled == len(one.frames) for one in own.values())


def _pair(own: dict[str, InRoom], figure: str) -> tuple[float, float]:
    ours, theirs = (own[reward.name].figures[figure] for reward in (COLLISION_AWARE, SHORTEST))
    return ours, theirs


def _claims(setting: Setting, learner: str, rooms: Sequence[dict[str, InRoom]]) -> Iterator[Claim]:
    """The collision-aware agents settle sooner, collide less and take no more steps, over rooms."""
    complete = [rooms[number] for number in _complete(rooms)]
    for figure, words in WORDS.items():
        text = f"{learner}: over rooms, {COLLISION_AWARE.name}, {words} than {SHORTEST.name}"
        if len(complete) < max(LEAST_ROOMS, len(rooms)):
            told = f"{len(complete)} of {len(rooms)} rooms are complete. Nothing is decided before all are"
            yield Claim(text, "undecided", f"{told}, or by fewer than {LEAST_ROOMS}.")
            continue
        ours, theirs = np.array([_pair(own, figure) for own in complete]).T
        episodes = setting.budget.episodes_per_target * np.array([_success(own)[0].size for own in complete])
        more = 1 / episodes if figure == "collisions" else np.zeros(len(complete))  # so that there is a ratio
        claim = _judged(text, FIGURES[figure], ours, theirs, more, 1 + SAME if figure == "steps" else 1.0)
        ours, theirs = (np.concatenate([_success(own)[kind].ravel() for own in complete])[None] for kind in (0, 1))
        rooms_of = np.repeat(np.arange(len(complete)), [_success(own)[0].size for own in complete])
        yield claim if figure == "frames" else with_failures(claim, ours, theirs, rooms_of)  # which counts failures


def _success(own: dict[str, InRoom]) -> tuple[np.ndarray, np.ndarray]:
    """Of both rewards, (R, M): 1 where every episode reached the target."""
    ours, theirs = (own[reward.name].scores.of("success") for reward in (COLLISION_AWARE, SHORTEST))
    return ours, theirs


def _judged(text: str, what: str, ours: np.ndarray, theirs: np.ndarray, more: np.ndarray, allowed: float) -> Claim:
    """A claim over rooms.

    Args:
        text: the claim.
        what: is compared.
        ours, theirs: (K,) a figure of each room.
        more: (K,) is added to both for their ratio, which asks for figures above 0.
        allowed: the ratio up to which it is no more.
    """
    means = {name: mean_estimate(own[:, None], ONE_TARGET) for name, own in (("first", ours), ("second", theirs))}
    ours, theirs = ours + more, theirs + more
    ratio = ratio_estimate(ours, theirs)
    fewer = int((ours < theirs * allowed).sum())
    evidence = (
        f"{what}: {means['first']} against {means['second']}, ratio {ratio}, geometric mean over rooms (median "
        f"{np.median(ours / theirs):.3g}); it lies below {allowed:g} in {fewer} of {len(ours)} rooms."
    )
    assert ratio.interval is not None, "there are several rooms"
    low, high = np.log(ratio.interval)
    verdict = side(Estimate(float(np.log(ratio.value)), (low, high)), float(np.log(allowed)))
    return Claim(text, verdict, evidence, {**means, "ratio": ratio}, p=sign_flip_p(ours, theirs, allowed))
