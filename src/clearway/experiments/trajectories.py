"""One episode in each scene that the agents of both rewards walked, for the report's maps."""

from __future__ import annotations

from collections.abc import Sequence

from clearway.evaluation.showcase import showcases
from clearway.experiments.groups import PAIR, Group
from clearway.experiments.job import episodes_of, run_folder
from clearway.experiments.section import ReportMap
from clearway.experiments.setting import Setting
from clearway.learn.checkpoint import checkpoints
from clearway.learn.load import load_agent


def maps(setting: Setting, groups: Sequence[Group]) -> tuple[ReportMap, ...]:
    """For each learner and scene the longest episode that most of the first seed's agents of both rewards finish.

    Learners are left out of which one of the two runs is not complete, or has no weights: records keep none.
    """
    found = []
    for learner in dict.fromkeys(group.learner for group in groups):
        own = [group for group in groups if group.learner == learner and group.runs[0].reward in PAIR]
        if any(episodes_of(setting.out, group.runs[0], group.trial) is None for group in own):
            continue
        folders = {group.agent: run_folder(setting.out, group.runs[0]) for group in own}
        if not all(checkpoints(folder.checkpoints) for folder in folders.values()):
            continue
        world = setting.world()
        agents = {agent: load_agent(folder.path) for agent, folder in folders.items()}
        walkers = {name: agent.on_poses(world) for name, agent in agents.items()}
        for show in showcases(world, walkers, setting.scenes):
            walks = {name: tuple(walk.states.tolist()) for name, walk in show.walks.items()}
            name = f"map_{learner.replace(', ', '_')}_{show.scene}"
            lost = [agent for agent, walk in walks.items() if walk[-1] != show.target]
            title = f"{learner}: {show.scene}, {show.shortest_path_steps} steps at least"
            title += f" ({' and '.join(lost)} did not arrive)" if lost else ""
            found.append(ReportMap(name, title, show.scene, show.target, walks))
    return tuple(found)
