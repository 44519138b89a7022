"""Live evaluation of one or two runs, setting after setting."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from clearway.choices import ZoneLevel
from clearway.errors import RunError
from clearway.evaluation.episodes import run_episodes
from clearway.files import json_text, written_whole
from clearway.learn.load import TrainedNetwork, run_world
from clearway.learn.network_agent import NetworkAgent, network_on_grid
from clearway.live.conditions import Condition
from clearway.live.episodes import LiveProtocol, LiveTable, run_live_episodes
from clearway.live.live_room import LiveRoom, live_room
from clearway.live.result_tables import markdown_tables
from clearway.live.results import Figures, LiveReport, LiveResult, grid_figures, summarise
from clearway.perception.encode import encoder_from_record
from clearway.perception.encoder import Encoder, colour_encoder_record
from clearway.regular_files import read_bytes
from clearway.rooms.camera import PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX
from clearway.rooms.detail import taken_fast
from clearway.rooms.render import Camera, studio
from clearway.scenes.scene import EncoderRecord, Scene
from clearway.torch_threads import torch_threads
from clearway.world.world import World, make_world

LIVE = "live"
"""Name of the files in the run folder."""
MAX_PART_BYTES = 1024**3


@dataclass(frozen=True)
class LiveScene:
    """One scene, ready to be walked in.

    Attributes:
        live: its room.
        world: of the scene alone, with the targets.
        encoder: that of the scene's features.
        camera: open for the room.
    """

    live: LiveRoom
    world: World
    encoder: Encoder
    camera: Camera


@dataclass(frozen=True)
class LiveOutcome:
    """One setting: the result, and for each agent's name its episodes, a table a scene."""

    setting: Condition
    result: LiveResult
    tables: Mapping[str, tuple[LiveTable, ...]]


def check_alike(agents: Mapping[str, TrainedNetwork]) -> None:
    """Check that agents can be compared episode by episode.

    Raises:
        RunError: they have other scenes or targets.
    """
    first, *others = (agent.record for agent in agents.values())
    digests = [scene.digest for scene in first.scenes]
    for record in others:
        if record.targets != first.targets or [scene.digest for scene in record.scenes] != digests:
            raise RunError("the runs differ in their scenes or targets. Evaluate them one by one")


@contextmanager
def stages(
    scenes: Sequence[Scene], targets: Mapping[str, Sequence[int]], zone_level: ZoneLevel
) -> Iterator[list[LiveScene]]:
    """Build the rooms of some scenes, with targets by scene name, and open a camera in each, for the block.

    Raises:
        SceneError: a scene is none of our rooms.
        EncoderError: an encoder is unknown, cannot be had again or takes no colour pictures.
    """
    with ExitStack() as opened:
        found = []
        for scene in scenes:
            made_by = _encoder_record(scene)  # before the seconds that the room takes
            live = live_room(scene)
            encoder = encoder_from_record(made_by)
            world = make_world([scene], {scene.name: targets[scene.name]}, zone_level)
            lens = live.lens(*_size_px(scene), fast=taken_fast(scene.made_by.notes))
            found.append(LiveScene(live, world, encoder, opened.enter_context(studio(live.model, lens))))
        yield found


def _size_px(scene: Scene) -> tuple[int, int]:
    """Height and width of the pictures that the scene's features were made of."""
    if scene.observations is None:
        return PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX
    height_px, width_px = scene.observations.shape[1:3]
    return height_px, width_px


def encoder_of(scene: Scene) -> Encoder:
    """What made the scene's features of colour pictures.

    Raises:
        EncoderError: it is unknown, takes others, or cannot be had again.
    """
    return encoder_from_record(_encoder_record(scene))


def _encoder_record(scene: Scene) -> EncoderRecord:
    return colour_encoder_record(scene, "pictures of live walks", "Evaluate on the grid: clearway evaluate")


def walk_setting(
    places: Sequence[LiveScene],
    agents: Mapping[str, TrainedNetwork],
    setting: Condition,
    protocol: LiveProtocol,
    show: Callable[[str], None] | None = None,
) -> LiveOutcome:
    """All agents' episodes in all scenes under one setting; `show` is told what goes on."""
    tables = {}
    for name, agent in agents.items():
        own = []
        for index, stage in enumerate(places):
            label = f"{setting.label}: {name} in {stage.live.scene.name}"

            def show_walking(walking: int, label: str = label) -> None:
                if show is not None:
                    show(f"{label}, {walking} episodes walking")

            own.append(
                run_live_episodes(
                    stage.live,
                    stage.world,
                    NetworkAgent(agent, index, stage.encoder),
                    stage.camera,
                    setting.perturbations,
                    protocol,
                    show_walking,
                )
            )
        tables[name] = tuple(own)
    return LiveOutcome(setting, summarise(setting.label, setting.perturbations, tables, protocol.seed), tables)


def walk_on_grid(
    agents: Mapping[str, TrainedNetwork],
    scenes: Sequence[Scene],
    targets: Mapping[str, Sequence[int]],
    protocol: LiveProtocol,
) -> dict[str, Figures]:
    """All agents' figures on the grid, in episodes with the same targets, starts and chances."""
    found = {}
    with torch_threads(1):
        for name, agent in agents.items():
            world = run_world(agent.record, scenes, targets)
            table = run_episodes(
                world,
                network_on_grid(agent, world),
                scenes=scenes,
                selection=protocol.selection,
                episodes_per_target=protocol.episodes_per_target,
                step_limit=protocol.step_limit,
                seed=protocol.seed,
            )
            found[name] = grid_figures(table, world.target_scene.numpy(), protocol.seed)
    return found


def write_live_part(folder: Path, report: LiveReport, name: str = LIVE) -> None:
    """Leave the settings walked so far in a run folder, as live.part.json and live.part.md, or under another name."""
    with written_whole(folder / f"{name}.part.json") as part:
        part.write_text(json_text(report.to_json()), encoding="utf-8")
    with written_whole(folder / f"{name}.part.md") as part:
        part.write_text(markdown_tables(report), encoding="utf-8")


def finish_live(folder: Path, name: str = LIVE) -> None:
    """Make what `write_live_part` left last the run's live.json and live.md: no setting is missing any more."""
    for ending in ("json", "md"):
        part = folder / f"{name}.part.{ending}"
        with written_whole(folder / f"{name}.{ending}") as whole:
            whole.write_bytes(read_bytes(part, MAX_PART_BYTES))
        part.unlink()
