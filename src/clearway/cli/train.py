"""`clearway train`."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from clearway.choices import FeatureStore, Goals, PresetName, TrackerName, ZoneLevel
from clearway.cli.arguments import given_targets, scene_files
from clearway.cli.console import say
from clearway.cli.reward import RewardChoice, RewardParameters, chosen_reward, given_parameters
from clearway.cli.run_names import free_run_folder, longer
from clearway.errors import ClearwayError

if TYPE_CHECKING:
    from clearway.api.training import TrainResult
    from clearway.learn.learner import Learner
    from clearway.reward import Reward

TOLD_TARGETS = 10  # unsolved ones of a scene, at most


@dataclass(frozen=True)
class Train:
    """Train an agent on one or more scenes.

    Example: clearway train bathroom.h5 --reward collision-aware --out runs/bathroom
    """

    files: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Scene files, or folders of them; here, or at s3://..., gs://... or https://..."""
    out: Path | None = None
    """The run folder; by default a new one, runs/ROOM-REWARD-ALGORITHM-sSEED."""
    targets: tuple[str, ...] = ()
    """Target states: "26 37 43" for one scene, "bathroom=26,37 kitchen=90,136" for several. By default the published
    targets for the paper's four scenes, five seeded ones elsewhere, in generated rooms and flats none that is held out;
    "held-out": such ones alone."""
    reward: RewardChoice = "collision-aware"
    parameters: RewardParameters = field(default_factory=RewardParameters)
    zones: ZoneLevel = "pose"
    """Whether zones are those of poses or of whole cells."""
    algorithm: str | None = None
    """ppo (our recipe, and the default), a2c, a3c, bc, q-learning, recurrent (for many rooms, seen by eyes) or adapt
    (see --from), with its own settings; or a preset, see there."""
    source: Annotated[str | None, tyro.conf.arg(name="from")] = None
    """generalist: adapt the agent that comes with clearway to these scenes, encoded by its eyes (--encoder clearway).
    The same as --algorithm adapt."""
    preset: PresetName | None = None
    """Named settings: default is our recipe, PPO; paper is the published settings, synchronous; paper-a3c is the
    published algorithm. With --algorithm, its settings go with that algorithm as far as it has them."""
    set: tuple[str, ...] = ()
    """Single settings of the algorithm, for example --set envs=200 clip_rewards=true (all: docs/learning.md)."""
    frames: int | None = None
    """Training frames, such as 600000 or 6e5; by default 3 million (a3c and the paper's presets 10 million, recurrent
    12 million, bc and q-learning 1 million, adapt 40000). With --resume, more of them lengthen a finished run."""
    until: Literal["solved"] | None = None
    """solved: stop earlier, once 20 training episodes in a row reached every target; by default all frames are used."""
    feature_basis: int | None = None
    """Learn from features in so many leading principal directions, by default 0: as they are. It loses nothing where
    poses are fewer, and costs quality elsewhere."""
    goals: Goals | None = None
    """seen: the learner sets itself poses that it has passed as further targets, for which the environment pays
    nothing; given: it does not, as by default. PPO and A2C."""
    seed: int = 0
    """Of parameters, environments, actions and the choice of targets."""
    threads: int | None = None
    """Threads of torch, or processes of a3c; by default one a core. Results repeat bit for bit at one number of
    threads, and a3c's with 1."""
    workers: int = 1
    """Processes of this machine that train one agent together, a scene each at least; ppo, a2c, bc. The result is that
    of one, up to rounding. One that dies is replaced. See docs/scale.md."""
    ray: str | None = None
    """A Ray cluster whose nodes run the --workers: local, auto (the running one) or an address. All nodes see the scene
    files and --out under the same paths. See docs/scale.md."""
    perturb: tuple[str, ...] = ()
    """Learn from perturbed pictures too: all, geometry, names, light=0.2, as of evaluate --goals. Every pose is seen in
    one of --takes pictures or the scene's own, another at each step. In rooms that can be built again; by ppo, a2c,
    recurrent."""
    takes: int | None = None
    """With --perturb: pictures of each pose; by default 4."""
    device: str = "cpu"
    """cpu or cuda."""
    feature_store: FeatureStore = "memory"
    """Where features are kept: memory; float16, in half the memory, rounded; mapped, in a file in the cache folder that
    is gone afterwards, for sets that memory cannot hold. The last two also open large sets faster."""
    track: TrackerName | None = None
    """Show figures elsewhere as they come: tensorboard, in the run folder; wandb, offline unless you are logged in.
    Needs the extra of that name; by default metrics.jsonl in the run folder alone."""
    resume: bool = False
    """Go on with the run in --out from its newest checkpoint; with more --frames, with a finished one too."""
    copy_to: str | None = None
    """Copy the run to an object store after each checkpoint, for example s3://bucket/run. With --resume, where --out
    holds no run, it is fetched from there first."""

    def run(self) -> None:
        """Train."""
        files = scene_files(self.files)  # what is not there is refused before PyTorch is loaded

        from clearway.api.training import train
        from clearway.learn.run_folder import RunFolder

        targets = given_targets(self.targets, len(files))
        reward, learner = chosen_reward(self.reward, self.parameters), self._learner()
        out = self._folder(files, reward, learner)
        if self.resume and self.copy_to is None and not RunFolder(out).exists:
            say(f"{out}: no run to resume is here; a new one is begun")
        try:
            result = train(
                files,
                targets,
                reward=reward,
                algorithm=learner,
                seed=self.seed,
                out=out,
                resume=self.resume,
                copy_to=self.copy_to,
                zone_level=self.zones,
                perturb=self.perturb,
                takes=self.takes,
                device=self.device,
                feature_store=self.feature_store,
                threads=self.threads,
                workers=self.workers,
                ray=self.ray,
                until_solved=self.until == "solved",
                track=self.track,
                on_begin=self._begun,
                show_progress=True,
            )
        except KeyboardInterrupt:
            if RunFolder(out).exists:
                say(f"{out}: interrupted. To go on: {longer(sys.argv[1:], out)}")
            raise
        _say_trained(result, out)

    def _folder(self, files: list[Path], reward: Reward, learner: Learner) -> Path:
        """The run folder, a new one where none is given."""
        if self.out is not None:
            return self.out
        if self.resume:
            raise ClearwayError("--resume: expected the run to go on with. Name its folder with --out")
        named = self._adapted() or self.algorithm or self.preset or "default"
        return free_run_folder(files, reward.name, learner.algorithm if named == "default" else named, self.seed)

    def _begun(self, folder: Path) -> None:
        """Say where the run is, where its user did not; leave its settings, if its reward is the user's own."""
        from clearway.api.run_settings import leave_settings
        from clearway.reward import REWARDS

        if self.reward not in REWARDS:  # of others the run knows the terms, but not the name to find them by
            changed = given_parameters(self.parameters)
            leave_settings(
                folder,
                {"reward": self.reward, **changed},
                perturb=self.perturb,
                takes=self.takes,
                threads=self.threads,
                workers=self.workers if self.workers > 1 else None,
                until=self.until,
                track=self.track,
            )
        if self.out is None:
            say(f"{folder}: the run's folder. Choose another with --out")

    def _adapted(self) -> str | None:
        """The algorithm that adapts what --from names."""
        if self.source is None:
            return None
        if self.source != "generalist":
            raise ClearwayError(f"--from {self.source[:80]}: expected generalist. To go on with a run: --resume")
        if self.preset is not None or self.algorithm not in (None, "adapt"):
            given = f"--preset {self.preset}" if self.preset else f"--algorithm {self.algorithm}"
            raise ClearwayError(f"{given}: cannot be adapted from the generalist. Leave it out, or --from")
        return "adapt"

    def _learner(self) -> Learner:
        """The algorithm with its settings, as the words have it."""
        from clearway.api.training import chosen_learner
        from clearway.learn.algorithms import carried_over
        from clearway.learn.learner import setting_names
        from clearway.learn.presets import PRESETS
        from clearway.learn.settings import with_settings

        called = self._adapted() or self.algorithm or self.preset or "default"
        learner = chosen_learner(called)
        if self.algorithm is not None and self.preset is not None:
            if self.algorithm in PRESETS:
                raise ClearwayError(f"--algorithm {self.algorithm} is a preset itself. Leave --preset out")
            learner = carried_over(PRESETS[self.preset], type(learner))
        wanted = {"feature_basis": self.feature_basis, "goals": self.goals}
        given = {name: value for name, value in wanted.items() if value is not None}
        for name in given:
            if name not in setting_names(type(learner)):
                option = f"--{name.replace('_', '-')}"
                raise ClearwayError(f"{option}: {learner.algorithm} has no setting {name}. Leave it out")
        return with_settings(chosen_learner(learner, self.frames, given), self.set, called)


def _say_trained(result: TrainResult, out: Path) -> None:
    """Say what came of a training and what can be done next; last, how to go on where targets are not solved."""
    if not result.metrics:  # a finished run whose metrics.jsonl was removed
        say(f"{out}: trained. Next: clearway evaluate {out}")
        return
    solved, count = result.solved_targets, sum(map(len, result.record.targets.values()))
    each = "" if solved == count else " --targets"
    used, asked = result.agent.frames, result.record.learner.frames
    further = f" on {used:,} frames ({used - asked:,} more than asked for: the last step or update is whole)"
    told = further if used > asked else ""
    limit = asdict(result.record.learner).get("step_limit")  # some algorithms have none
    short = "" if solved == count or not limit else f" in its last episodes, of at most {limit} steps each"
    say(f"{out}: trained{told}, {solved} of {count} targets solved{short}. Next: clearway evaluate {out}{each}")
    if result.unsolved and solved < count:
        frames = 2 * max(result.record.learner.frames, result.agent.frames)
        say(f"not solved: {_named(result.unsolved)}. To go on: {longer(sys.argv[1:], out, frames)}")


def _named(targets: Mapping[str, tuple[int, ...]]) -> str:
    """Targets of scenes, such as "bathroom=26,37", as --targets takes them; of many the first."""
    words = [
        f"{scene}={','.join(map(str, states[:TOLD_TARGETS]))}{',...' * (len(states) > TOLD_TARGETS)}"
        for scene, states in list(targets.items())[:TOLD_TARGETS]
    ]
    left = len(targets) - TOLD_TARGETS
    return " ".join(words) + (f" and of {left} more scenes" if left > 0 else "")
