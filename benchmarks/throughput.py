"""How fast the learner is: frames/s, share of this machine's matrix-product peak, ratio to a naive version.

    python benchmarks/throughput.py            # all sizes, some minutes
    python benchmarks/throughput.py --quick    # fewer repeats, for a first look

Everything is measured in one run, and repeats of all cases are interleaved, so that whatever else the machine does
hits all alike. Worlds are made up on the spot: four random floor plans with as many states as the paper's scenes
(180 + 408 + 468 + 676), 2048 features a state, 20 targets; the network has the paper's size.

What is counted. A multiplication with its addition is 2 FLOP; only matrix products that the algorithm needs count, so
the share of the peak falls with every row looked up, action drawn and parameter stepped. With S states projected, F
features, K history, H width, M targets, O = 5 outputs, one update of `histories` histories in `rows` rows needs

    tables      2 S F K H + 2 M H H                   project states; targets through their half of fusion
    forward     histories 2 H H + rows (2 H H + 2 H O)    observation half of fusion; scene layer, outputs
    backward    2 x forward + 2 S F K H + 4 M H H     dX and dW of those; dW of the siamese layer; targets

All states are projected, but where a batch is too small to hold them all, those that occur in it.

A2C: tables once, forward for the rollout's rows and the values after its last step, backward once (the rollout's
activations are used again). PPO: the same forward, then forward and backward for every minibatch, with the rows that
hindsight adds, of which only distinct ones are counted, as only they are computed; states are projected, and dW of the
siamese layer is computed, as often as `siamese_step` says: once a pass (the first finds the tables ready) or once a
minibatch. Look-ahead's forward pass, a row for each next pose and target that occur, is timed but not counted. The
agents are untrained, and walk at random; trained ones repeat themselves, so their rows cost half of that.

Basis. Those named so learn from features in their 512 leading directions, so that F is 512: a reduced network, which is
not compared with the naive one, as that has all features.

Precision. Cases are computed in float32 but for those named bfloat16, whose `matmul_precision` is medium; they are left
out where the device has no instructions for it.

The share of the peak. The machine's speed may change from minute to minute, so each timing of a case stands between two
of a matrix product of factors of its own dtype, of the size that was fastest at the start, and is divided by the faster
of them; the share is the median of these. Training makes one update after the other, so the update before the one that
is timed is of the same case: it finds its weights in the caches as it would there, not another case's.

The naive version is the same network in `nn.Linear` layers with autograd: every row's four feature vectors are copied
side by side (8192 numbers), and the target's branch is computed for every row, as published code does. Its update
goes through chunks of rows whose gradients add up, because 32,000 rows would need gigabytes. It is A2C, so the ratio
stands beside A2C alone.
"""

from __future__ import annotations

import argparse
import json
import platform
import re
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from clearway.learn import algorithms
from clearway.learn.algorithms import carried_over
from clearway.learn.figures import Figures as Figured
from clearway.learn.losses import Batch, LossSettings, actor_critic_loss
from clearway.learn.on_policy import OnPolicy
from clearway.learn.presets import DEFAULT
from clearway.learn.returns import generalised_advantages
from clearway.learn.rollout import ACTION_STREAM, sample_actions
from clearway.learn.trainer import Trainer
from clearway.model.feature_map import FeatureMap
from clearway.model.first_layer import VisitedStates
from clearway.model.network import OUTPUTS
from clearway.model.precision import factor_dtype
from clearway.reward import COLLISION_AWARE
from clearway.scenes.actions import ACTION_COUNT, BLOCKED
from clearway.scenes.scene import EncoderRecord, Provenance, Scene
from clearway.scenes.targets import seeded_targets
from clearway.world.navigation import Navigation, TargetChoice
from clearway.world.streams import Streams
from clearway.world.world import World, make_world

STATES = (180, 408, 468, 676)
FEATURES = 2048
BASIS = 512  # directions of the reduced features
ROW_CHUNK = 4000  # rows of a naive update held at a time
ENDLESS = 10**9  # frames of the schedules; none ends during a benchmark
PPO = replace(DEFAULT, frames=ENDLESS, matmul_precision="highest")
A2C = carried_over(replace(PPO, hindsight=False, lookahead=0.0, bootstrap_cut=False), algorithms.A2C)
Peaks = dict[torch.dtype, dict[int, float]]


# ---------------------------------------------------------------------------------------------------------- worlds


def made_up_scene(name: str, state_count: int, seed: int) -> Scene:
    """A random connected floor plan with four headings a cell and smooth random features."""
    rng = np.random.default_rng(seed)
    cells = grown_cells(state_count // 4, rng)
    locations_m = np.repeat(cells, 4, axis=0) * 0.5
    headings_deg = np.tile(np.arange(4) * 90, len(cells))
    turn = np.deg2rad(headings_deg)
    poses = np.stack([locations_m[:, 0], locations_m[:, 1], np.sin(turn), np.cos(turn)], axis=1)
    waves = np.cos(poses @ rng.normal(size=(4, FEATURES)) + rng.uniform(0, 2 * np.pi, FEATURES))
    return Scene(
        name,
        None,
        waves.astype(np.float32),
        locations_m,
        headings_deg,
        graph_of(cells),
        Provenance("benchmark"),
        EncoderRecord("made-up", "made-up"),
    )


def grown_cells(count: int, rng: np.random.Generator) -> np.ndarray:
    """`count` cells, (count, 2) int, grown from one by adding random neighbours."""
    cells = [(0, 0)]
    while len(cells) < count:
        x, z = cells[rng.integers(len(cells))]
        dx, dz = ((0, 1), (1, 0), (0, -1), (-1, 0))[rng.integers(4)]
        if (x + dx, z + dz) not in cells:
            cells.append((x + dx, z + dz))
    return np.array(cells)


def graph_of(cells: np.ndarray) -> np.ndarray:
    """(4 * cells, 4) int32 graph: forward, right, left, backward; -1 where the move is blocked."""
    number = {tuple(cell): index for index, cell in enumerate(cells.tolist())}
    graph = np.empty((4 * len(cells), ACTION_COUNT), np.int32)
    for (x, z), index in number.items():
        for heading, (dx, dz) in enumerate(((0, 1), (1, 0), (0, -1), (-1, 0))):
            ahead, behind = number.get((x + dx, z + dz)), number.get((x - dx, z - dz))
            graph[4 * index + heading] = (
                BLOCKED if ahead is None else 4 * ahead + heading,
                4 * index + (heading + 1) % 4,
                4 * index + (heading - 1) % 4,
                BLOCKED if behind is None else 4 * behind + heading,
            )
    return graph


def made_up_world(device: str) -> World:
    """Four floor plans with five targets each."""
    scenes = [made_up_scene(f"plan_{states}", states, seed) for seed, states in enumerate(STATES)]
    return make_world(scenes, {scene.name: seeded_targets(scene) for scene in scenes}).to(device)


# ---------------------------------------------------------------------------------------------------- naive version


class PlainNetwork(nn.Module):
    """The siamese actor-critic in `nn.Linear` layers, every scene's head by itself."""

    def __init__(self, scene_count: int, width: int, history_length: int, feature_count: int = FEATURES) -> None:
        super().__init__()
        self.siamese = nn.Linear(history_length * feature_count, width)
        self.fusion = nn.Linear(2 * width, width)
        self.scene_layers = nn.ModuleList(nn.Linear(width, width) for _ in range(scene_count))
        self.outputs = nn.ModuleList(nn.Linear(width, OUTPUTS) for _ in range(scene_count))

    def forward(self, seen: Tensor, wanted: Tensor, rows_per_scene: list[int]) -> Tensor:
        """Scores and value, (B, 5), of two (B, K * F) inputs whose rows are ordered by scene."""
        return self.heads(self.trunk(seen, wanted), rows_per_scene)

    def trunk(self, seen: Tensor, wanted: Tensor) -> Tensor:
        """What all scenes share: two (B, K * F) inputs -> (B, H)."""
        joint = torch.cat([torch.relu(self.siamese(seen)), torch.relu(self.siamese(wanted))], 1)
        return torch.relu(self.fusion(joint))

    def heads(self, fused: Tensor, rows_per_scene: list[int]) -> Tensor:
        """Every scene's own layers: (B, H) ordered by scene -> scores and value, (B, 5)."""
        heads = zip(fused.split(rows_per_scene), self.scene_layers, self.outputs, strict=True)
        return torch.cat([output(torch.relu(layer(rows))) for rows, layer, output in heads])


class NaiveA2C:
    """The same A2C update with nothing but the plain network, autograd and copies of the features."""

    def __init__(self, world: World, learner: OnPolicy, seed: int) -> None:
        self.world, self.learner = world, learner
        self.per_scene = learner.envs // world.scene_count
        assert world.features is not None
        self.features = FeatureMap.fitted(world.features, centre=True)(world.features)
        torch.manual_seed(seed)
        self.network = PlainNetwork(world.scene_count, learner.width, learner.history_length).to(world.device)
        self.adam = torch.optim.Adam(self.network.parameters(), lr=learner.lr_start, fused=True)
        seeds = torch.arange(learner.envs, device=world.device)
        scenes = torch.arange(world.scene_count, device=world.device).repeat_interleave(self.per_scene)
        choice = TargetChoice.by_scene(world, scenes)
        self.navigation = Navigation(world, COLLISION_AWARE, seeds, choice=choice, step_limit=learner.step_limit)
        self.navigation.reset()
        self.action_stream = Streams(seeds, ACTION_STREAM)

    def predicted(self, history: Tensor, target: Tensor) -> Tensor:
        """(B, 5) for states (B, K) and targets (B,), as many rows a scene."""
        seen = self.features[history].flatten(1)
        wanted = self.features[self.world.target_state[target]].repeat(1, history.shape[1])
        rows_per_scene = [len(target) // self.world.scene_count] * self.world.scene_count
        return self.network(seen, wanted, rows_per_scene)

    def update(self) -> None:
        """One rollout and one step of the optimiser."""
        batches = self.rollout()
        rows = self.learner.envs * self.learner.rollout_steps
        settings = replace(LossSettings.after(0, self.learner), sum_loss=True)
        self.adam.zero_grad()
        for batch in batches:
            terms = actor_critic_loss(self.predicted(batch.history, batch.target), batch, settings)
            (terms.total / rows).backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), self.learner.clip_norm)
        self.adam.step()

    @torch.no_grad()
    def rollout(self) -> list[Batch]:
        """The rows of a rollout in chunks of whole steps, rows of each ordered by scene."""
        nav, learner = self.navigation, self.learner
        kept: list[tuple[Tensor, ...]] = []
        for _ in range(learner.rollout_steps):
            history, target = nav.history, nav.target.clone()
            output = self.predicted(history, target)
            action = sample_actions(output[:, :ACTION_COUNT], self.action_stream.uniform())
            log_prob = torch.log_softmax(output[:, :ACTION_COUNT], 1).gather(1, action[:, None])[:, 0]
            step = nav.step(action)
            kept.append((history, target, action, log_prob, output[:, ACTION_COUNT], step.reward, step.ended))
            nav.reset(torch.nonzero(step.ended)[:, 0])
        history, target, action, log_prob, value, reward, ended = (
            torch.stack(each) for each in zip(*kept, strict=True)
        )
        after = self.predicted(nav.history, nav.target)[:, ACTION_COUNT]
        discount = learner.discount * (~ended)
        advantage = generalised_advantages(reward * learner.reward_scale, discount, value, after, learner.gae_lambda)
        columns = (history, target, action, log_prob, advantage, advantage + value)
        steps = max(1, ROW_CHUNK // learner.envs)
        return [
            self.chunk([c[first : first + steps] for c in columns]) for first in range(0, learner.rollout_steps, steps)
        ]

    def chunk(self, columns: list[Tensor]) -> Batch:
        """One batch from (T, N, ...) columns, its rows ordered by scene."""
        scenes, steps = self.world.scene_count, len(columns[0])
        history, target, action, log_prob, advantage, value_target = (
            c.unflatten(1, (scenes, self.per_scene)).transpose(0, 1).flatten(0, 2) for c in columns
        )
        counts = (steps * self.per_scene,) * scenes
        return Batch(history, target, action, log_prob, advantage, value_target, counts)


# ------------------------------------------------------------------------------------------------------ measurement


@dataclass
class Case:
    """What is timed, and what one update of it needs.

    Attributes:
        name, envs, steps: of the case.
        update: does one update.
        gflop: what the algorithm needs for an update so far as known, see the file's docstring; None for the naive one.
        factors: dtype of the factors of its matrix products.
        comparable: with the naive version of its size.
        seconds: of every update measured.
        shares: of the matrix-product peak at that time, likewise.
    """

    name: str
    envs: int
    steps: int
    update: Callable[[], object]
    gflop: Callable[[], float] | None = None
    factors: torch.dtype = torch.float32
    comparable: bool = False
    seconds: list[float] = field(default_factory=list)
    shares: list[float] = field(default_factory=list)

    def frames_per_s(self) -> tuple[float, float, float]:
        """Median, smallest and largest."""
        rates = sorted(self.envs * self.steps / s for s in self.seconds)
        return statistics.median(rates), rates[0], rates[-1]


def needed_gflop(world: World, features: int, states: float, learner: OnPolicy, updates: Sequence[Figured]) -> float:
    """GFLOP of an update on so many features, by the formulas above; mean over some that projected so many states."""
    width, targets = learner.width, world.target_count
    projection = 2 * states * features * learner.history_length * width
    tables = projection + 2 * targets * width * width
    of_history, of_row = 2 * width * width, 2 * width * width + 2 * width * OUTPUTS
    rows = learner.envs * learner.rollout_steps
    gathered = tables + (rows + learner.envs) * (of_history + of_row)
    extra_targets = 4 * targets * width * width
    if learner.algorithm == "a2c":
        return (gathered + rows * 2 * (of_history + of_row) + projection + extra_targets) / 1e9
    passes, parts = learner.epochs, learner.epochs * learner.minibatches
    siamese_steps = passes if learner.siamese_step == "pass" else parts
    renewed = (siamese_steps - 1) * projection + (parts - 1) * (tables - projection)
    told = statistics.fmean(update["hindsight_rows"] for update in updates)
    learnt = statistics.fmean(
        (rows + u["hindsight_rows"]) * (u["distinct_histories"] * of_history + u["distinct_pairs"] * of_row)
        for u in updates
    )
    stepped = 3 * passes * learnt + parts * extra_targets + siamese_steps * projection
    return (gathered + told * (of_history + of_row) + renewed + stepped) / 1e9


def fast_case(world: World, learner: OnPolicy) -> Case:
    """The learner of the package."""
    trainer = Trainer(world, learner, COLLISION_AWARE, seed=0)
    updates: list[Figured] = []
    states: list[int] = []

    def update() -> None:
        updates.append(trainer.update())
        layer = trainer.lookup.first_layer
        states.append(layer.known if isinstance(layer, VisitedStates) else world.state_count)

    def gflop() -> float:
        return needed_gflop(world, trainer.feature_map.input_count, statistics.fmean(states), learner, updates)

    dtype, basis = trainer.lookup.dtype, learner.feature_basis
    name = learner.algorithm + (" bfloat16" if dtype == torch.bfloat16 else "") + (f" basis {basis}" if basis else "")
    comparable = learner.algorithm == "a2c" and not basis
    return Case(name, learner.envs, learner.rollout_steps, update, gflop, dtype, comparable)


def naive_case(world: World, learner: OnPolicy) -> Case:
    """The naive version at the same size."""
    return Case("naive a2c", learner.envs, learner.rollout_steps, NaiveA2C(world, learner, seed=0).update)


def timed(work: Callable[[], object], device: str) -> float:
    """Seconds that it takes, the device's queue included."""
    wait(device)
    started = time.perf_counter()
    work()
    wait(device)
    return time.perf_counter() - started


def wait(device: str) -> None:
    if torch.device(device).type == "cuda":
        torch.cuda.synchronize()


def matrix_peak(
    device: str, sizes: tuple[int, ...], repeats: int, dtype: torch.dtype = torch.float32
) -> dict[int, float]:
    """Best GFLOP/s of a product of square matrices, by size."""
    best = {}
    for size in sizes:
        left, right = torch.rand(2, size, size, device=device).to(dtype)
        out = torch.empty_like(left)

        def product(a: Tensor = left, b: Tensor = right, c: Tensor = out) -> None:
            torch.mm(a, b, out=c)

        product()
        best[size] = 2 * size**3 / min(timed(product, device) for _ in range(repeats)) / 1e9
    return best


def measure(case: Case, device: str, size: int, peak_repeats: int) -> None:
    """Time the second of two updates of a case between two measurements of the peak."""
    before = matrix_peak(device, (size,), peak_repeats, case.factors)[size]
    case.update()
    case.seconds.append(timed(case.update, device))
    if case.gflop:
        after = matrix_peak(device, (size,), peak_repeats, case.factors)[size]
        case.shares.append(case.gflop() / case.seconds[-1] / max(before, after))


def run(device: str, quick: bool, progress: Callable[[str], None]) -> tuple[Peaks, list[Case]]:
    """Measure everything; returns the peaks by dtype and matrix size, and the cases."""
    world = made_up_world(device)
    sizes = [(100, 5), (400, 20), (1600, 20)]
    learners = [replace(A2C, envs=envs, rollout_steps=steps) for envs, steps in sizes]
    cases = [fast_case(world, learner) for learner in learners]
    cases += [fast_case(world, PPO)]
    cases += [fast_case(world, replace(one, feature_basis=BASIS)) for one in (learners[1], PPO)]
    if factor_dtype("medium", world.device) == torch.bfloat16:
        rounded = (*learners[1:], PPO, replace(PPO, feature_basis=BASIS))
        cases += [fast_case(world, replace(one, matmul_precision="medium")) for one in rounded]
    cases += [naive_case(world, learner) for learner in learners]
    repeats, peak_repeats = (2, 2) if quick else (9, 3)
    product_sizes = (1024, 2048) if quick else (1024, 2048, 4096)
    for case in cases:  # memory and caches
        progress(f"warming up: {case.name} {case.envs}x{case.steps}")
        case.update()
    dtypes = dict.fromkeys(case.factors for case in cases)
    peaks = {dtype: matrix_peak(device, product_sizes, peak_repeats, dtype) for dtype in dtypes}
    best_size = {dtype: max(peak, key=lambda size: peak[size]) for dtype, peak in peaks.items()}
    for repeat in range(repeats):
        progress(f"repeat {repeat + 1} of {repeats}")
        for case in cases:
            if case.gflop or repeat < 3:  # the naive version is slow and steady
                measure(case, device, best_size[case.factors], peak_repeats)
    return peaks, cases


# ----------------------------------------------------------------------------------------------------------- output


@dataclass(frozen=True)
class Figures:
    """One line of the table; None where it has no meaning."""

    case: str
    envs: int
    steps: int
    updates: int
    frames_per_s: float
    frames_per_s_min: float
    frames_per_s_max: float
    gflop_an_update: float | None
    share_of_peak: float | None
    times_naive: float | None


def figures(cases: list[Case]) -> list[Figures]:
    """The table's lines."""
    naive = {(c.envs, c.steps): c.frames_per_s()[0] for c in cases if c.gflop is None}
    lines = []
    for case in cases:
        rate, low, high = case.frames_per_s()
        needed = case.gflop() if case.gflop else None
        share = statistics.median(case.shares) if case.shares else None
        ratio = rate / naive[case.envs, case.steps] if case.comparable else None
        count = len(case.seconds)
        lines.append(Figures(case.name, case.envs, case.steps, count, rate, low, high, needed, share, ratio))
    return lines


def table(lines: list[Figures]) -> str:
    """The lines as text."""
    heads = "case", "envs x steps", "frames/s", "min - max", "GFLOP/update", "of peak", "x naive"
    text = [("{:<22} {:>13} {:>10} {:>21} {:>13} {:>8} {:>8}").format(*heads)]
    for line in lines:
        size = f"{line.envs} x {line.steps}"
        spread = f"{line.frames_per_s_min:,.0f} - {line.frames_per_s_max:,.0f}"
        needed = f"{line.gflop_an_update:.1f}" if line.gflop_an_update else "-"
        share = f"{line.share_of_peak:.0%}" if line.share_of_peak else "-"
        ratio = f"{line.times_naive:.1f}" if line.times_naive else "-"
        rate = f"{line.frames_per_s:,.0f}"
        text.append(f"{line.case:<22} {size:>13} {rate:>10} {spread:>21} {needed:>13} {share:>8} {ratio:>8}")
    return "\n".join(text)


def device_name(device: str) -> str:
    """The processor that computes."""
    if torch.device(device).type == "cuda":
        return torch.cuda.get_device_name()
    cpuinfo = Path("/proc/cpuinfo")
    models = re.findall(r"^model name\s*: (.+)$", cpuinfo.read_text(), re.MULTILINE) if cpuinfo.exists() else []
    return models[0] if models else platform.processor() or platform.machine()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--threads", type=int, help="CPU threads; default: torch's choice")
    parser.add_argument("--quick", action="store_true", help="fewer repeats and smaller matrices")
    parser.add_argument("--device", default="cpu", help="torch device, for example cuda")
    parser.add_argument("--json", action="store_true", help="print JSON instead of the table")
    options = parser.parse_args()
    if options.threads:
        torch.set_num_threads(options.threads)

    def progress(text: str) -> None:
        if not options.json:
            print(text, flush=True)

    peaks, cases = run(options.device, options.quick, progress)
    lines = figures(cases)
    machine = {"device": device_name(options.device), "threads": torch.get_num_threads(), "torch": torch.__version__}
    if options.json:
        by_dtype = {str(dtype).removeprefix("torch."): peak for dtype, peak in peaks.items()}
        print(
            json.dumps({**machine, "peak_gflop_per_s": by_dtype, "cases": [asdict(line) for line in lines]}, indent=2)
        )
        return
    print(f"\n{machine['device']}, {machine['threads']} threads, torch {machine['torch']}")
    for dtype, peak in peaks.items():
        by_size = ", ".join(f"{size}: {rate:,.0f}" for size, rate in peak.items())
        print(f"{str(dtype).removeprefix('torch.')} matrix products at the start, GFLOP/s by size: {by_size}")
    print()
    print(table(lines))


if __name__ == "__main__":
    main()
