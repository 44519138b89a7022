"""Our learner beside Stable-Baselines3, measured in one run: frames/s, and seconds until every target is solved.

    pip install 'clearway[sb3]'
    python benchmarks/peers.py                                 # the four default rooms; an hour and more
    python benchmarks/peers.py --cap-minutes 5 --seconds 5     # a first look
    python benchmarks/peers.py --scenes a.h5 b.h5 --json peers.json

Both sides have the same scenes, prepared features, targets and reward, the paper's network (a head a scene, the same
sizes; SB3's is held against ours at the start), and all cores. Episodes are cut after 40 steps on our side and in SB3's
PPO with our recipe's values, after 500 in SB3's own settings.

Frames/s. Ours is the package's A2C, 400 and 1600 environments x 20 steps, full network, exact gradients, in float32 as
SB3's and with factors of matrix products in bfloat16 as by default (float32 again on machines without such
instructions). SB3's A2C has its own settings; because its speed hangs on how many environments of which kind walk how
many steps, several are tried first and the fastest is measured. "dummy" and "subproc" are SB3's own ways to run many
of our single Gymnasium environments (one process, and a process each); "batched" hands it our vector environment,
which spares it the loop over environments, so that little but the network is left. Repeats alternate; figures are
medians (smallest - largest).

Seconds until every target is solved, on the first scene: our DEFAULT, SB3's PPO with its own default settings (and
`--ppo-envs` environments), and SB3's PPO with the values of our recipe as far as it has them (400 environments x 20
steps, 2 epochs of 4 minibatches, discount, lambda, clips, scaled reward, falling learning rate and entropy; hindsight
and look-ahead it has not). Both kinds of environment are our batched one, the faster for SB3. A target is solved when
each of 100 sampled episodes ends in under 500 steps; an agent is looked at every few seconds with its clock stopped.
An agent has failed when its minutes, or the frames of its schedules, are used up.
"""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import torch
from peers_quality import Outcome, measure_quality
from peers_speed import Speed, Trial, measure_speed
from scene_sets import chosen_scenes, prepared
from throughput import device_name

from clearway.learn.provenance import hardware, package_versions

SHOWN_VERSIONS = ("python", "clearway", "torch", "stable-baselines3", "gymnasium", "numpy")


def speed_table(speeds: Sequence[Speed], trials: Sequence[Trial]) -> str:
    """Frames/s in Markdown; the last two are SB3's, the others ours."""
    peers = speeds[-2:]
    heads = ["", "environments x steps", "frames/s", *(f"x {peer.name}" for peer in peers)]
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for speed in speeds:
        rate = f"{speed.median:,.0f} ({speed.smallest:,.0f} - {speed.largest:,.0f})"
        ratios = [f"{speed.median / peer.median:.1f}" for peer in peers]
        lines.append(f"| {' | '.join([speed.name, f'{speed.envs} x {speed.steps}', rate, *ratios])} |")
    tried = "; ".join(f"{t.kind} {t.envs} x {t.steps}: {t.frames_per_s:,.0f}" for t in trials)
    return "\n".join([*lines, "", f"Medians of {speeds[0].repeats} (smallest - largest). SB3, tried first: {tried}."])


def quality_table(outcomes: Sequence[Outcome], scene: str) -> str:
    """Seconds until every target is solved, in Markdown; a seed's first line is ours."""
    lines = [f"| {scene} | seed | seconds until solved | frames | ours is |", "|---|---|---|---|---|"]
    ours = outcomes[0]
    for found in outcomes:
        if found.seed != ours.seed:
            ours = found
        ratio = "" if found is ours else ratio_text(ours, found)
        lines.append(f"| {found.agent} | {found.seed} | {seconds_text(found)} | {found.frames:,} | {ratio} |")
    return "\n".join(lines)


def seconds_text(found: Outcome) -> str:
    """The seconds, or why there are none."""
    if found.out_of is None:
        return f"{found.seconds:,.0f}"
    limit = f"{found.seconds / 60:.1f} minutes" if found.out_of == "time" else f"its {found.frames:,} frames"
    return f"not within {limit}: {found.solved} of {found.targets} solved"


def ratio_text(ours: Outcome, other: Outcome) -> str:
    """How many times as fast; a lower bound where the other did not get there."""
    if ours.out_of is not None:
        return "unsolved"
    bound = "" if other.out_of is None else "more than "
    return f"{bound}{other.seconds / ours.seconds:.1f} times as fast"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=Path, nargs="+", default=[], help="scene files; default: the four rooms")
    parser.add_argument("--repeats", type=int, default=7, help="of the measurement of frames/s")
    parser.add_argument("--seconds", type=float, default=15.0, help="of each side in each repeat")
    parser.add_argument("--cap-minutes", type=float, default=20.0, help="of training until solved; 0 leaves this out")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0], help="of the training until solved")
    parser.add_argument(
        "--ppo-envs", type=int, nargs="*", default=[8], help="environments of SB3's PPO as it comes; none: leave it out"
    )
    parser.add_argument("--no-tuned", action="store_true", help="leave out SB3's PPO with our recipe's values")
    parser.add_argument("--threads", type=int, help="of torch; default: torch's choice")
    parser.add_argument("--json", type=Path, help="file for the figures")
    options = parser.parse_args()
    if options.threads:
        torch.set_num_threads(options.threads)

    def progress(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    scenes = chosen_scenes(options.scenes)
    speeds, trials = measure_speed(prepared(scenes), options.seconds, options.repeats, progress)
    outcomes = []
    if options.cap_minutes:
        cap_s, tuned = 60 * options.cap_minutes, not options.no_tuned
        outcomes = measure_quality(scenes[0], options.seeds, cap_s, options.ppo_envs, tuned, progress)
    processor, here, command = device_name("cpu"), hardware(), shlex.join(["python", *sys.argv])
    versions = {**package_versions(), "stable-baselines3": version("stable-baselines3")}
    numbers = ", ".join(f"{name} {versions[name]}" for name in SHOWN_VERSIONS)
    names = ", ".join(f"{scene.name} ({scene.state_count} states)" for scene in scenes)
    print(f"{processor}, {here['cores']} cores, {here['threads']} threads; {numbers}. Scenes: {names}.")
    print(f"`{command}`\n\n{speed_table(speeds, trials)}\n")
    if outcomes:
        print(quality_table(outcomes, scenes[0].name))
    if options.json:
        figures: dict[str, Sequence[Any]] = {"a2c": speeds, "tried": trials, "until_solved": outcomes}
        content = {"processor": processor, **here, "versions": versions, "command": command, "scenes": names}
        content |= {name: [asdict(line) for line in lines] for name, lines in figures.items()}
        options.json.write_text(json.dumps(content, indent=2) + "\n")


if __name__ == "__main__":
    main()
