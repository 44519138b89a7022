"""What a run has learnt, from its run folder, with the scenes and the world it walks in."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol, runtime_checkable

from torch import Tensor

from clearway.agents.agent import Agent
from clearway.agents.by_pose import PoseAgent, network_on_poses
from clearway.choices import GENERALIST
from clearway.errors import RunError
from clearway.learn.checkpoint import newest_checkpoint, read_network, read_progress
from clearway.learn.described import described
from clearway.learn.foreign_agent import ForeignTrained, made_agent
from clearway.learn.learner import OnFeatures
from clearway.learn.named_tensors import part_of
from clearway.learn.run_folder import CHECKPOINTS, MILESTONES, RunFolder
from clearway.learn.run_record import RunRecord, SceneRecord
from clearway.model.feature_map import FeatureMap, prepared_features
from clearway.model.lookup import LookupNetwork
from clearway.model.network import NetworkShape, SiameseActorCritic
from clearway.model.policy import ScenePolicy
from clearway.remote.address import address_of, file_name, is_fetched
from clearway.scenes.digest import scene_digest
from clearway.scenes.scene import Scene
from clearway.scenes.scene_files import SCENE_SUFFIXES
from clearway.scenes.thor_v1 import read_scene
from clearway.scenes.validate import SceneWarning
from clearway.world.world import World, make_world, scene_tables

TOLD_SCENES = 10  # names in a refusal, at most


@runtime_checkable
class TrainedAgent(Protocol):
    """What a run has learnt, whatever it consists of. In a world it is an `Agent`."""

    @property
    def record(self) -> RunRecord:
        """Of its run."""

    @property
    def frames(self) -> int:
        """It has learnt from."""

    def on_poses(self, world: World) -> Agent:
        """Its agent on the grid, in a world with the run's scenes."""


@dataclass(frozen=True)
class TrainedNetwork:
    """A trained network with what it needs to act.

    Attributes:
        record: of its run.
        network: the parameters.
        feature_map: prepares features for it.
        frames: it has learnt from.
    """

    record: RunRecord
    network: SiameseActorCritic
    feature_map: FeatureMap
    frames: int

    def __repr__(self) -> str:
        return described(self)

    def on_poses(self, world: World) -> PoseAgent:
        """Its agent on the grid, in a world with the run's scenes. Raises RunError as `lookup` does."""
        return network_on_poses(self.lookup(world), world, self.record.learner.reward_scale)

    def in_scene(self, index: int) -> ScenePolicy:
        """Its policy in one of the run's scenes, by features."""
        return ScenePolicy(self.network, self.feature_map, index, self.record.learner.reward_scale)

    def lookup(self, world: World) -> LookupNetwork:
        """The network on the states of a world with the run's scenes, for its targets.

        Raises:
            RunError: the world has other scenes, or no features or another number of them. Whether they are those of
                the same encoder nobody can tell here.
        """
        if world.features is None:
            raise RunError("the scenes have no features. Encode them as for training")
        names = tuple(scene.name for scene in self.record.scenes)
        if world.scene_names != names and self.record.learner.heads_by_scene:
            raise RunError(f"the scenes are {world.scene_names}, but the agent's {names}. Give those, in this order")
        count, expected = world.features.shape[1], self.feature_map.feature_count
        if count != expected:
            raise RunError(f"the scenes have {count} features, expected {expected}. Encode them as for training")
        return LookupNetwork(self.network, prepared_features(world, self.feature_map), world.target_state)


def load_network(folder: Path, checkpoint: Path | None = None) -> TrainedNetwork:
    """The agent of a run that consists of a network, from its newest checkpoint or the one given.

    Raises:
        RunError: as for `load_agent`, or the agent has no network.
    """
    agent = load_agent(folder, checkpoint)
    if isinstance(agent, ForeignTrained):
        agent = agent.trained
    if not isinstance(agent, TrainedNetwork):
        name = agent.record.learner.algorithm
        raise RunError(
            f"{folder}: this needs the siamese network, and an agent of {name} has none. Walk with it by clearway "
            f"evaluate {folder} or clearway video {folder}; off the grid walk those of ppo, a2c, a3c and bc, "
            "and recurrent ones to goals (--goals 20 --live)"
        )
    return agent


def load_agent(folder: Path, checkpoint: Path | None = None) -> TrainedAgent:
    """The agent of a run, whatever it consists of, from its newest checkpoint or the one given.

    Raises:
        RunError: there is no such run, the checkpoint is damaged or lies in another folder.
        PluginError: the algorithm is another package's, and gives no agent.
    """
    run = RunFolder(folder)
    record = run.read_record()
    path = checkpoint or newest_checkpoint(run.checkpoints)
    if run.path.resolve() not in path.resolve().parents:
        raise RunError(f"{path}: not a checkpoint of {folder}. Name one in its {CHECKPOINTS} or {MILESTONES} folder")
    tensors, frames = read_network(path), read_progress(path).frames
    broken = [name for name, tensor in tensors.items() if not tensor.isfinite().all()]
    if broken:
        raise RunError(f"{path}: its {broken[0]} holds NaN or Inf. Use another checkpoint")
    try:
        return made_agent(record, tensors, frames)
    except (LookupError, RuntimeError, ValueError) as error:
        reason = " ".join(str(error).split())[:300]
        raise RunError(f"{path}: does not fit its run ({reason}). Use another checkpoint") from error


def network_agent(record: RunRecord, tensors: Mapping[str, Tensor], frames: int) -> TrainedNetwork:
    """The agent of a run that consists of a network.

    Raises:
        LookupError, RuntimeError, ValueError: the tensors do not fit the run.
    """
    feature_map = FeatureMap.from_tensors(part_of(tensors, "features"))
    network = _network(record, feature_map.input_count, part_of(tensors, "network"))
    return TrainedNetwork(record, network, feature_map, frames)


def _network(record: RunRecord, input_count: int, parameters: Mapping[str, Tensor]) -> SiameseActorCritic:
    """The network of a run with these parameters; made only once its sizes are known to be theirs."""
    learner = record.learner
    assert isinstance(learner, OnFeatures), "an algorithm that has a network has its settings"
    wanted = (learner.history_length, learner.width, input_count)
    found = tuple(parameters["siamese_weight"].shape)
    if found != wanted:
        raise RuntimeError(f"siamese_weight has shape {found}, expected {wanted}")
    heads = record.learner.head_count(len(record.scenes))
    network = SiameseActorCritic(NetworkShape(heads, input_count, learner.width, learner.history_length))
    network.load_state_dict(parameters)
    return network


def run_scenes(
    record: RunRecord, given: Sequence[Path | Scene] | None = None, *, tells_others: bool = True
) -> list[Scene]:
    """The scenes of a run, in its order, from the files it names or from what is given: files, or scenes themselves.

    What is given may have another name, as a renamed file has; it gets the run's.

    Raises:
        RunError: a scene is missing or is not the one the run was trained on.

    Warns:
        SceneWarning: the run was not trained in some of what is given, and they are left out; unless `tells_others` is
            False.
    """
    if given:
        loaded = [one if isinstance(one, Scene) else read_scene(one) for one in given]
        places = [_place_among(loaded, wanted) for wanted in record.scenes]
        found = [_called(loaded[place], wanted.name) for place, wanted in zip(places, record.scenes, strict=True)]
        sources = [one.name if isinstance(one := given[place], Scene) else str(one) for place in places]
        if tells_others:
            known = {wanted.digest for wanted in record.scenes}
            left = [scene for place, scene in enumerate(loaded) if place not in places]
            _warn_of_others([scene.name for scene in left if scene_digest(scene) not in known])
    else:
        paths = _places(record)
        found = [_in_file(wanted.name, paths.get(wanted.path or "", wanted.path)) for wanted in record.scenes]
        sources = [wanted.path or wanted.name for wanted in record.scenes]
    for scene, wanted, source in zip(found, record.scenes, sources, strict=True):
        if scene_digest(scene) != wanted.digest:
            raise RunError(
                f"{source}: not the scene that the run was trained on (graph or features differ). "
                "Give the right file with --scenes"
            )
    return found


def _places(record: RunRecord) -> dict[str, str]:
    """Where the scenes of a run that lie elsewhere are on this machine, by address; they are fetched.

    Raises:
        RunError: one of the addresses is that of a folder.
        ClearwayError: one cannot be had.
    """
    addresses = [scene.path for scene in record.scenes if scene.path is not None and address_of(scene.path)]
    if not addresses:
        return {}
    from clearway.remote.cache import fetched

    for address in addresses:
        if not file_name(address).endswith(SCENE_SUFFIXES):
            problem = f"{address}: the run's scene is no scene file ({', '.join(SCENE_SUFFIXES)})"
            raise RunError(f"{problem}. Give the right file with --scenes")
    return dict(zip(addresses, map(str, fetched(addresses, SCENE_SUFFIXES, may_pass=True)), strict=True))


def _place_among(given: Sequence[Scene], wanted: SceneRecord) -> int:
    """Where the scene of a run stands among some: by what it holds, else by its name."""
    names = [scene.name for scene in given]
    for place in sorted(range(len(given)), key=lambda place: names[place] != wanted.name):  # mostly the first
        if scene_digest(given[place]) == wanted.digest:
            return place
    if wanted.name in names:
        return names.index(wanted.name)
    others = _listed(names)
    problem = f"scene {wanted.name} of the run is not among the files given ({others}), by name or by what they hold"
    raise RunError(f"{problem}. Add it to --scenes; an agent walks where it was trained, and {GENERALIST} anywhere")


def _called(scene: Scene, name: str) -> Scene:
    return scene if scene.name == name else replace(scene, name=name)


def _warn_of_others(names: Sequence[str]) -> None:
    if names:
        told = f"{_listed(names)}: left out, as the run was not trained there"
        warnings.warn(f"{told}. In any scene walks {GENERALIST}", SceneWarning, stacklevel=3)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:TOLD_SCENES]) + ",..." * (len(names) > TOLD_SCENES)


def _in_file(name: str, path: str | None) -> Scene:
    if path is None or not (Path(path).exists() or is_fetched(Path(path))):
        raise RunError(f"{path or name}: the run's scene file is missing. Give it with --scenes")
    return read_scene(Path(path), name=name)


def run_world(record: RunRecord, scenes: Sequence[Scene], targets: Mapping[str, Sequence[int]] | None = None) -> World:
    """The world of a run; with its targets, unless others are given by scene name."""
    return make_world(scenes, record.targets if targets is None else targets, record.zone_level)


def run_tables(record: RunRecord, scenes: Sequence[Scene]) -> World:
    """The tables of a run's scenes, without targets; `World.with_targets` gives them any."""
    return scene_tables(scenes, record.zone_level)
