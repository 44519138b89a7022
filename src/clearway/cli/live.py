"""`clearway evaluate --live`: its flags, and what it does."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from clearway.choices import HELD_OUT
from clearway.cli.arguments import check_at_least, check_finite, check_positive, check_seeds, scene_files
from clearway.cli.console import print_json, say, say_held_out, stderr_console, stdout_console
from clearway.errors import ClearwayError
from clearway.live.conditions import MOST, REARRANGING, REFERENCE, Perturbations, as_it_was_built

if TYPE_CHECKING:
    from clearway.learn.load import TrainedNetwork
    from clearway.live.walks import LiveOutcome, LiveScene

EPISODES, STEP_LIMIT = 10, 100


@dataclass(frozen=True)
class Live:
    """In the room itself: continuous pose, pictures rendered and encoded step by step, contacts by MuJoCo."""

    live: bool = False
    """Evaluate in the rooms instead of on the grid; 10 episodes a target of at most 100 steps by default."""
    against: Path | None = None
    """A second run on the same scenes and targets, compared episode by episode."""
    selection: Literal["sampled", "argmax"] = "sampled"
    """How actions are chosen."""
    sweep: bool = False
    """Every perturbation alone, then all together, instead of the flags below."""
    strengths: tuple[float, ...] = (0.5, 1.0)
    """Of a sweep, shares of its full perturbations."""
    perturbations: Perturbations = field(default_factory=Perturbations)

    def given(self) -> dict[str, bool]:
        """Which flags are not as by default."""
        usual = Live()
        flags = {f"--{name}": getattr(self, name) != getattr(usual, name) for name in vars(usual)}
        changed = self.perturbations.to_json().items() - usual.perturbations.to_json().items()
        del flags["--perturbations"]
        return flags | {f"--{name.replace('_', '-')}": True for name, _ in sorted(changed)}

    def check(self) -> None:
        """Check the flags; without --live they must be as they are by default."""
        if not self.live:
            if asked := [flag for flag, given in self.given().items() if given]:
                raise ClearwayError(f"{asked[0]}: walks off the grid. Add --live")
            return
        numbers = {k: v for k, v in self.perturbations.to_json().items() if not isinstance(v, bool)}
        check_finite(**numbers)
        negative = [name.replace("_", "-") for name, value in numbers.items() if value < 0]
        if negative:
            raise ClearwayError(f"--{negative[0]} is below 0. Give 0 or more")
        if strong := self.perturbations.too_strong:
            problem = f"--{strong.replace('_', '-')} is {numbers[strong]:g}, expected at most {MOST[strong]:g}"
            raise ClearwayError(f"{problem}. Give a smaller number")
        if self.sweep and self.perturbations != Perturbations():
            raise ClearwayError("--sweep sets the perturbations itself. Leave their flags out")
        if not self.sweep and self.strengths != Live().strengths:
            raise ClearwayError("--strengths are a sweep's. Add --sweep, or leave it out")
        if not self.strengths:
            raise ClearwayError("--strengths is empty. Give one or more numbers above 0")
        for strength in self.strengths:
            check_positive(strengths=strength)
            scaled = REFERENCE.scaled(strength)
            if strong := scaled.too_strong:
                problem = f"{strong.replace('_', '-')} would be {getattr(scaled, strong):g}, more than {MOST[strong]:g}"
                raise ClearwayError(f"--strengths is {strength:g}: {problem}. Give a smaller number")


def evaluate_live(
    folder: Path,
    checkpoint: Path | None,
    scene_paths: tuple[Path, ...],
    options: Live,
    *,
    episodes: int,
    step_limit: int,
    seed: int,
    pictures: Path | None,
    held_out: bool,
    json: bool,
) -> None:
    """Walk the episodes, print, leave live.json and live.md in the run folder, and draw what is asked for."""
    from clearway.api.targets import chosen_targets
    from clearway.learn.load import load_network, run_scenes
    from clearway.live.conditions import Condition, label_of, sweep_settings
    from clearway.scenes.scene import encoder_names

    check_at_least(1, episodes=episodes, step_limit=step_limit)
    check_seeds(seed=seed)
    paths = [folder] if options.against is None else [folder, options.against]
    agents = _named(paths, [load_network(path, checkpoint if path == folder else None) for path in paths])
    record = next(iter(agents.values())).record
    scenes = run_scenes(record, scene_files(scene_paths) if scene_paths else None)
    _check_rooms_can_be_built()
    from clearway.live.episodes import LiveProtocol
    from clearway.live.result_tables import rich_tables
    from clearway.live.results import LiveReport
    from clearway.live.walks import LIVE, check_alike, finish_live, stages, walk_on_grid, walk_setting, write_live_part

    check_alike(agents)
    one = Condition(label_of(options.perturbations), options.perturbations)
    protocol = LiveProtocol(episodes, step_limit, seed, options.selection)
    encoder = encoder_names(scenes)
    targets = chosen_targets(scenes, HELD_OUT, seed) if held_out else record.targets
    name = f"{HELD_OUT}-{LIVE}" if held_out else LIVE
    if held_out:
        say_held_out(targets)
    with stages(scenes, targets, record.zone_level) as places:
        settings = sweep_settings(options.strengths, _reference(places)) if options.sweep else [one]
        outcomes: list[LiveOutcome] = []
        with status_line() as show:
            show("on the grid")
            report = LiveReport((), walk_on_grid(agents, scenes, targets, protocol), targets, protocol, encoder)
            for setting in settings:
                outcomes.append(walk_setting(places, agents, setting, protocol, show))
                report = replace(report, results=tuple(outcome.result for outcome in outcomes))
                write_live_part(folder, report, name)  # what is complete outlives an interruption
        finish_live(folder, name)
        if pictures is not None:
            _draw(pictures, places, outcomes)
    if json:
        print_json(report.to_json())
        return
    stdout_console().print(rich_tables(report))


def _reference(places: list[LiveScene]) -> Perturbations:
    """Full strength in a sweep: of what can be changed in every room."""
    fixed = [place.live.scene.name for place in places if place.live.room is None]
    if not fixed:
        return REFERENCE
    say(f"the sweep leaves out {' and '.join(REARRANGING)}: nothing can be moved in the MuJoCo model of {fixed[0]}")
    return as_it_was_built(REFERENCE)


def _draw(folder: Path, places: list[LiveScene], outcomes: list[LiveOutcome]) -> None:
    from clearway.viz.live import draw_live_pictures

    made = draw_live_pictures(folder, places, outcomes)
    say(f"pictures: {', '.join(str(path) for path in made)}")


def _named(paths: list[Path], agents: list[TrainedNetwork]) -> dict[str, TrainedNetwork]:
    """The agents by the names of their rewards, or of their folders where those are alike."""
    rewards = [agent.record.reward.name for agent in agents]
    names = rewards if len(set(rewards)) == len(rewards) else [str(path) for path in paths]
    if len(set(names)) < len(names):
        raise ClearwayError(f"--against {paths[1]}: the same run. Name another")
    return dict(zip(names, agents, strict=True))


def _check_rooms_can_be_built() -> None:
    """MuJoCo is imported by what follows."""
    from clearway.rooms.build import check_mujoco

    check_mujoco()


@contextmanager
def status_line() -> Iterator[Callable[[str], None]]:
    """A line on standard error that says what goes on, if it is a terminal."""
    console = stderr_console()
    if not console.is_terminal:
        yield lambda text: None
        return
    with console.status("") as status:
        yield status.update
