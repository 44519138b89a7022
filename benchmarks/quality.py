"""How well and how soon the default learner solves every target, for several seeds: time to quality.

    python benchmarks/quality.py                                   # the four default rooms, seeds 0 to 4
    python benchmarks/quality.py --json quality.json --curves quality.png
    python benchmarks/quality.py --scenes plans/*.h5               # scene files, such as floor plans
    python benchmarks/quality.py --seeds 0 --frames 400000 --set envs=200 epochs=3

The criteria: every target solved (each of its sampled episodes from random starts ends at it in under 500 steps), steps
of all targets together at most 5 % above the shortest paths from the same starts, of no target above 15 %, fewer than
0.05 collisions an episode. The table judges the agent at the end of its training by the paper's protocol: 100 episodes
a target, at most `--step-limit` steps. Means are those of all tables: over scenes, of their targets' means.

Seconds to a criterion: the agent is looked at every `--every` frames, on `--episodes` episodes a target, with the clock
stopped; the first look at which the criterion is met counts. The clock counts making the trainer and its updates, not
reading scenes. Fewer episodes overlook more, so beside a claim of "all solved" stands the table's own column.

Beside the agents stand, exactly and by dynamic programming, the best policy under the same reward; the policy in which
the loss would come to rest with the learner's last entropy weight and its discount; and likewise with the published
settings (entropy weight 0.01, discount 0.99, rewards clipped).

All seeds have the same scenes and targets. Matrix products of this machine are timed before the first and after every
seed: where their speed falls, something else was running.
"""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from learning_curve import CRITERIA, FINAL_SEED, Check, Curve, learning_curve
from quality_tables import Reference, draw_quality, line, table, verdict
from scene_sets import ENCODER, chosen_scenes
from throughput import device_name, matrix_peak

from clearway.cli.arguments import scene_files
from clearway.errors import ClearwayError
from clearway.evaluation.episodes import EPISODES_PER_TARGET, STEP_LIMIT
from clearway.evaluation.metrics import average, by_scene
from clearway.evaluation.optimum import world_yardsticks
from clearway.evaluation.oracle import DISCOUNT, ENTROPY_WEIGHT
from clearway.evaluation.summary import Protocol
from clearway.files import written_whole
from clearway.learn.on_policy import OnPolicy
from clearway.learn.presets import PRESETS
from clearway.learn.provenance import hardware, package_versions
from clearway.learn.settings import with_settings
from clearway.learn.train import RunRequest, set_threads
from clearway.perception import encode_scenes
from clearway.reward import REWARDS, Reward
from clearway.scenes.scene import Scene, encoder_names
from clearway.scenes.targets import default_targets, seeded_targets
from clearway.world.world import World, make_world

ROOMS = "rooms"
SHOWN_VERSIONS = ("python", "clearway", "torch", "numpy")
PEAK_SIZES, PEAK_REPEATS = (1024, 2048), 3


def references(world: World, reward: Reward, learner: OnPolicy) -> list[Reference]:
    """The optimum and the soft fixed points of the learner's own and of the published settings."""
    own = replace(reward, clip=reward.clip or learner.clip_rewards)
    last_entropy = learner.entropy_end / learner.reward_scale  # in units of the reward
    found = world_yardsticks(world, own, discount=learner.discount, entropy_weight=last_entropy)
    published = world_yardsticks(world, replace(reward, clip=True))
    shortest = np.array([one.yardstick.shortest_path_steps for one in found])
    policies = {
        f"optimum (discount {learner.discount:g})": [one.yardstick.optimal for one in found],
        f"soft fixed point of these settings (entropy {learner.entropy_end:g}, reward x {learner.reward_scale:g}, "
        f"discount {learner.discount:g})": [one.yardstick.soft for one in found],
        f"soft fixed point of the published settings (entropy {ENTROPY_WEIGHT:g}, reward clipped, "
        f"discount {DISCOUNT:g})": [one.yardstick.soft for one in published],
    }
    lines = []
    for name, expected in policies.items():
        figures = np.stack([[one.steps for one in expected], [one.collisions for one in expected], shortest], axis=1)
        steps, collisions, fewest = average(by_scene(figures, world.target_scene.cpu().numpy())).tolist()
        lines.append(Reference(name, steps, collisions, steps / fewest))
    return lines


@dataclass(frozen=True)
class Bench:
    """What is measured, on what.

    Attributes:
        scenes, targets, learner, reward: see `RunRequest`.
        options: the command line's.
    """

    scenes: Sequence[Scene]
    targets: Mapping[str, Sequence[int]]
    learner: OnPolicy
    reward: Reward
    options: argparse.Namespace

    @classmethod
    def of(cls, options: argparse.Namespace) -> Bench:
        """What the command line asks for."""
        files = [] if options.scenes == [ROOMS] else scene_files([Path(word) for word in options.scenes])
        scenes: Sequence[Scene] = chosen_scenes(files)
        if options.encoder:
            scenes = encode_scenes(scenes, options.encoder, progress=True)
        count = options.targets
        targets = {s.name: seeded_targets(s, count) if count else default_targets(s) for s in scenes}
        learner = PRESETS[options.preset]
        assert isinstance(learner, OnPolicy)
        if options.frames:
            learner = replace(learner, frames=options.frames)
        return cls(scenes, targets, with_settings(learner, options.set), REWARDS[options.reward], options)

    def curve(self, seed: int) -> Curve:
        """Train one seed."""
        options = self.options
        request = RunRequest(self.scenes, self.targets, self.learner, self.reward, seed, device=options.device)

        def show(check: Check) -> None:
            if options.show_checks:
                found = check.quality
                text = f"{found.solved_targets}/{found.target_count} solved, {found.path_ratio:.3f} x shortest, "
                text += f"worst {found.worst_path_ratio:.2f}, {found.collisions:.3f} collisions"
                print(f"  {check.frames:>9,} frames {check.seconds:7.1f} s: {text}", file=sys.stderr, flush=True)

        return learning_curve(
            request,
            encoder_names(self.scenes),
            every_frames=options.every,
            check_episodes=options.episodes,
            final=Protocol(EPISODES_PER_TARGET, options.step_limit, FINAL_SEED, "sampled"),
            show=show,
        )

    def settings(self) -> dict[str, object]:
        """All that determines the figures, and where they were made, as JSON values."""
        return {
            "command": shlex.join(["python", *sys.argv]),
            "scenes": {scene.name: scene.state_count for scene in self.scenes},
            "targets": {name: list(states) for name, states in self.targets.items()},
            "encoder": encoder_names(self.scenes),
            "learner": asdict(self.learner),
            "reward": self.reward.to_json(),
            "criteria": asdict(CRITERIA),
            "every_frames": self.options.every,
            "check_episodes": self.options.episodes,
            "step_limit": self.options.step_limit,
            "device": device_name(self.options.device),
            "hardware": hardware(),
            "versions": package_versions(),
        }


def run(options: argparse.Namespace) -> None:
    """Measure, print, and write what is asked for after every seed."""
    set_threads(options.threads)
    bench = Bench.of(options)
    exact = references(make_world(bench.scenes, bench.targets), bench.reward, bench.learner)
    peaks, curves = [peak(options.device)], []
    for seed in options.seeds:
        curves.append(bench.curve(seed))
        peaks.append(peak(options.device))
        print(line(curves[-1]), flush=True)
        if options.json:
            write_json(options.json, bench.settings(), peaks, exact, curves)
        if options.curves:
            draw_quality(curves, options.curves, ", ".join(scene.name for scene in bench.scenes))
    print(f"\n{table(curves, exact)}\n\n{verdict(curves)}\n{footnote(bench, peaks)}")


def peak(device: str) -> float:
    """GFLOP/s of matrix products, now."""
    return max(matrix_peak(device, PEAK_SIZES, PEAK_REPEATS).values())


def footnote(bench: Bench, peaks: Sequence[float]) -> str:
    """Command, machine and versions, under the table."""
    found, versions = bench.settings(), package_versions()
    shown = ", ".join(f"{name} {versions[name]}" for name in SHOWN_VERSIONS)
    counts = ", ".join(f"{s.name} {s.state_count} states, {len(bench.targets[s.name])} targets" for s in bench.scenes)
    machine = hardware()
    return (
        f"`{found['command']}`. Scenes: {counts}; features: {found['encoder']}; reward: {bench.reward.name}. "
        f"{EPISODES_PER_TARGET} episodes a target of at most {bench.options.step_limit:,} steps; until then looked at "
        f"every {bench.options.every:,} frames on {bench.options.episodes} episodes a target. "
        f"{found['device']}, {machine['cores']} cores, {machine['threads']} threads, {machine['system']}; {shown}. "
        f"Matrix-product peak {max(peaks):,.0f} GFLOP/s (between seeds {min(peaks):,.0f} to {max(peaks):,.0f})."
    )


def write_json(
    path: Path, settings: dict[str, object], peaks: Sequence[float], exact: Sequence[Reference], curves: Sequence[Curve]
) -> None:
    """Everything measured so far."""
    content = {
        **settings,
        "peak_gflop_per_s": list(peaks),
        "references": [asdict(one) for one in exact],
        "seeds": [curve.to_json() for curve in curves],
    }
    with written_whole(path) as part:
        part.write_text(json.dumps(content, indent=1) + "\n")


def at_least_one(text: str) -> int:
    """A whole number above 0."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is less than 1")
    return value


def parsed() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", nargs="+", default=[ROOMS], help="'rooms' (default), or scene files and folders")
    parser.add_argument("--encoder", help=f"of the pictures; default: {ENCODER} for rooms, else the file's own")
    parser.add_argument("--targets", type=at_least_one, help="seeded targets a scene; default: those of clearway train")
    parser.add_argument("--reward", choices=REWARDS, default="collision-aware")
    parser.add_argument("--preset", choices=("default", "paper"), default="default")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2, 3, 4])
    parser.add_argument("--frames", type=at_least_one, help="default: the preset's")
    parser.add_argument("--set", nargs="+", default=[], metavar="NAME=VALUE", help="settings of the preset's algorithm")
    parser.add_argument("--every", type=at_least_one, default=50_000, help="frames between looks (default %(default)s)")
    parser.add_argument("--episodes", type=at_least_one, default=25, help="a target, for a look (default %(default)s)")
    parser.add_argument("--step-limit", type=at_least_one, default=STEP_LIMIT, help="of the last evaluation's episodes")
    parser.add_argument("--show-checks", action="store_true", help="print every look to standard error")
    parser.add_argument("--threads", type=at_least_one, help="of torch, or processes of a3c; default: torch's choice")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures and learning curves here")
    parser.add_argument("--curves", type=Path, metavar="FILE", help="draw the learning curves here (PNG)")
    return parser.parse_args()


def main() -> None:
    try:
        run(parsed())
    except ClearwayError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
