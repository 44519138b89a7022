"""What an act of the generalist costs on one core, by PyTorch and by its exported file, and whether both do the same.

    python benchmarks/acts.py rooms-validation            # folders or files of scenes with pictures

In every scene one walk of `--steps` steps to a goal, then a tour of `--tour` steps, then a walk by its map; the PyTorch
agent leads, and the exported one is shown the same pictures in the same states. Processor time of one thread, median
over acts; the share of acts in which both took the same action.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
from pathlib import Path

import numpy as np
import torch
from family import processor_s

import clearway
from clearway.agents.agent import Agent, State
from clearway.agents.generalist import Generalist
from clearway.deploy.export import export_generalist
from clearway.deploy.generalist import GeneralistAgent, exported_generalist
from clearway.deploy.onnx_file import read_onnx
from clearway.mapping.settings import MappingSettings
from clearway.perception import eyes
from clearway.scenes.scene import Scene
from clearway.scenes.sensors import RGB

SEED = np.zeros(1, np.int64)


class Both:
    """Times and actions of the two, by part of a walk: (ms, ms, the same)."""

    def __init__(self) -> None:
        self.acts: dict[str, list[tuple[float, float, bool]]] = {}
        self.walks: dict[str, list[bool]] = {}

    def walk(
        self, part: str, agents: tuple[Agent, Agent], scene: Scene, at: int, goal: int, steps: int
    ) -> tuple[State, State]:
        """Walk until the goal or so many steps, and keep what came of it; the states at the end."""
        assert scene.observations is not None
        target = {RGB: scene.observations[goal : goal + 1]}
        states = [agent.reset(target, SEED) for agent in agents]
        same = []
        for _ in range(steps):
            ms, actions = [], []
            for number, agent in enumerate(agents):
                begun = processor_s()
                decisions, states[number] = agent.act({RGB: scene.observations[at : at + 1]}, states[number])
                ms.append((processor_s() - begun) * 1000)
                actions.append(int(decisions.action[0]))
            same.append(actions[0] == actions[1])
            self.acts.setdefault(part, []).append((ms[0], ms[1], same[-1]))
            if not same[-1]:
                break  # from here on their walks differ
            after = int(scene.graph[at, actions[0]])
            at = after if after >= 0 else at
            if at == goal and part != "tour":
                break
        self.walks.setdefault(part, []).append(all(same))
        return states[0], states[1]


def main() -> None:
    """Walk, and print the table as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--steps", type=int, default=100)
    parser.add_argument("--tour", type=int, default=150)
    parser.add_argument("--most", type=int, help="scenes")
    options = parser.parse_args()
    torch.set_num_threads(1)
    encoder = eyes.from_record(eyes.find_record())
    with tempfile.TemporaryDirectory() as folder:
        export_generalist(encoder, MappingSettings(), Path(folder) / "generalist.onnx")
        size_mb = (Path(folder) / "generalist.onnx").stat().st_size / 1e6
        agents = (
            GeneralistAgent(Generalist.by_eyes(encoder)),
            exported_generalist(read_onnx(Path(folder) / "generalist.onnx", threads=1)),
        )
    both = Both()
    files = [file for path in options.scenes for file in (sorted(path.glob("*.h5")) if path.is_dir() else [path])]
    for number, file in enumerate(files[: options.most]):
        scene = clearway.load_scene(file)
        largest = np.flatnonzero(scene.components == 0)
        at, goal, start, other = np.random.default_rng(number).choice(largest, 4, replace=False).tolist()
        both.walk("walk", agents, scene, at, goal, options.steps)
        explorers = (agents[0].explorer(), agents[1].explorer())
        states = both.walk("tour", explorers, scene, at, goal, options.tour)
        knowing = tuple(agent.knowing(agent.map_of(state)) for agent, state in zip(agents, states, strict=True))
        both.walk("walk after the tour", (knowing[0], knowing[1]), scene, start, other, options.steps)
    print(f"generalist.onnx: {size_mb:.1f} MB; {len(both.walks['tour'])} scenes\n")
    print("| | acts | PyTorch, ms | onnxruntime, ms | ratio | acts alike | whole walks alike |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for part, acts in both.acts.items():
        one, other_ms = (statistics.median(act[number] for act in acts) for number in (0, 1))
        alike, whole = sum(act[2] for act in acts), both.walks[part]
        row = (part, len(acts), f"{one:.1f}", f"{other_ms:.1f}", f"{one / other_ms:.2f}", f"{alike}/{len(acts)}")
        print("| " + " | ".join(map(str, (*row, f"{sum(whole)}/{len(whole)}"))) + " |")


if __name__ == "__main__":
    main()
