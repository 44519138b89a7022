"""The record of a run: everything that determines it, and where it was made; as JSON values and read from them."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from clearway.choices import ZoneLevel
from clearway.errors import PluginError, RunError
from clearway.learn.algorithms import ALGORITHMS, algorithm
from clearway.learn.kinds import field_types, fits
from clearway.learn.learner import Learner
from clearway.learn.old_runs import clipped_once, own_settings, with_later
from clearway.learn.plugged import faults_of
from clearway.learn.provenance import hardware, package_versions, plugin_versions
from clearway.learn.reward_record import reward_from_json
from clearway.plugins import find_plugin
from clearway.remote.address import addresses_without_secrets
from clearway.remote.records import origin
from clearway.reward import Reward
from clearway.scenes.digest import scene_digest
from clearway.scenes.features import FileFeatures
from clearway.scenes.parts import is_name
from clearway.scenes.scene import Scene
from clearway.spread.many import of_each
from clearway.version import __version__

if TYPE_CHECKING:
    from clearway.learn.train import RunRequest

SHAPES_BITS = ("torch", "algorithm", "reward", "threads", "bfloat16", "device", "gpu", "feature_store")
"""Of a run's versions and hardware."""


@dataclass(frozen=True)
class SceneRecord:
    """A scene as a run used it.

    Attributes:
        name: of the scene.
        path: of its file, or its address elsewhere; None for a scene made in memory.
        digest: of its graph, poses and features (`scene_digest`).
        encoder: name of what made the features.
        targets: state ids.
    """

    name: str
    path: str | None
    digest: str
    encoder: str
    targets: tuple[int, ...]


@dataclass(frozen=True)
class RunRecord:
    """Everything that determines a run, and where it was made. The reward is as training paid it.

    command: what began it, as its process was called.
    takes: how the perturbed pictures were made that were seen beside the scenes' own; None: there were none.
    begun: when, in UTC; None: not told.
    """

    learner: Learner
    reward: Reward
    seed: int
    zone_level: ZoneLevel
    scenes: tuple[SceneRecord, ...]
    versions: Mapping[str, str]
    hardware: Mapping[str, Any]
    command: tuple[str, ...]
    takes: Mapping[str, Any] | None = None
    begun: str | None = None

    @property
    def targets(self) -> dict[str, tuple[int, ...]]:
        """Targets by scene name."""
        return {scene.name: scene.targets for scene in self.scenes}

    def to_json(self) -> dict[str, Any]:
        """As JSON values."""
        learner = {"algorithm": self.learner.algorithm, **asdict(self.learner)}
        return {**asdict(self), "learner": learner, "reward": self.reward.to_json()}

    def with_frames(self, frames: int) -> RunRecord:
        """The record of such a run of so many frames."""
        return replace(self, learner=replace(self.learner, frames=frames))

    def other_bits(self, now: RunRecord) -> list[str]:
        """Where a run goes on in another way than this one began, so that its bits are not an uninterrupted one's."""
        then, here = ({**record.versions, **record.hardware} for record in (self, now))
        return [
            f"{name} {here.get(name)} instead of {then[name]}"
            for name in SHAPES_BITS
            if name in then and then[name] != here.get(name)
        ]

    def changed_terms(self, other: RunRecord) -> list[str]:
        """Terms of the reward whose code is another one in the other run; a run that does not tell it may be of any."""
        codes = other.reward.codes
        return [path for path, code in self.reward.codes.items() if codes.get(path, code) != code]

    def same_experiment(self, other: RunRecord) -> bool:
        """Both would give the same agent: all but versions, hardware, paths, command and time agree."""

        def essence(run: RunRecord) -> tuple:
            scenes = tuple((s.name, s.digest, s.targets) for s in run.scenes)
            learner = run.learner.algorithm, asdict(run.learner)  # a class may be compared in another way
            reward = {**run.reward.to_json(), Reward.CODES: None}
            return learner, reward, run.seed, run.zone_level, scenes, run.takes

        return essence(self) == essence(other) and not self.changed_terms(other)


def record_of(request: RunRequest) -> RunRecord:
    """The record of a run that is about to start."""
    paths = request.paths or {}
    digests = request.digests or _digests(request.scenes)
    return RunRecord(
        learner=request.learner,
        reward=request.paid,
        seed=request.seed,
        zone_level=request.zone_level,
        scenes=tuple(
            SceneRecord(
                name=scene.name,
                path=origin(paths[scene.name]) if scene.name in paths else None,
                digest=digest,
                encoder=scene.encoder_name,
                targets=tuple(int(target) for target in request.targets[scene.name]),
            )
            for scene, digest in zip(request.scenes, digests, strict=True)
        ),
        versions=package_versions() | plugin_versions(request.learner.algorithm, request.reward),
        hardware=hardware(request.device) | {"feature_store": request.feature_store},
        command=tuple(map(addresses_without_secrets, sys.argv)),
        takes=request.takes_made,
        begun=datetime.now(UTC).isoformat(timespec="seconds"),
    )


def _digests(scenes: Sequence[Scene]) -> Iterable[str]:
    """Of each scene."""
    if all(isinstance(scene.features, FileFeatures) for scene in scenes):
        return of_each(scene_digest, [scene.without_pictures() for scene in scenes])
    return map(scene_digest, scenes)


def record_from(content: Mapping[str, Any], version: int) -> RunRecord:
    """A record read from JSON values of a format.

    Raises:
        KeyError, TypeError, AttributeError, OverflowError, ClearwayError: a setting is missing, unknown or of a wrong
            kind.
        PluginError: the algorithm is another package's, and cannot be used.
    """
    wanted = {"seed": int, "zone_level": ZoneLevel, "versions": dict, "hardware": dict, "command": list}
    given = {name: content[name] for name in wanted} | {"begun": content.get("begun")}
    for name, kind in (wanted | {"begun": str | None}).items():
        if not fits(given[name], kind):
            raise TypeError(f"{name} is {given[name]!r:.40}")
    _check_installed(content["learner"]["algorithm"], content["versions"])
    learner, reward = _learner(content["learner"], version), reward_from_json(content["reward"])
    with faults_of(learner, "paid"):
        learner, reward = clipped_once(learner, reward)
    return RunRecord(
        learner=learner,
        reward=reward,
        seed=content["seed"],
        zone_level=content["zone_level"],
        scenes=tuple(_scene_record(scene) for scene in content["scenes"]),
        versions=content["versions"],
        hardware=content["hardware"],
        command=tuple(content["command"]),
        takes=content.get("takes"),
        begun=given["begun"],
    )


def _check_installed(name: str, versions: Mapping[str, Any]) -> None:
    """Raise PluginError where another package's algorithm is not there any more."""
    package = versions.get("algorithm")
    if package is not None and name not in ALGORITHMS and find_plugin("algorithms", name) is None:
        problem = f"algorithm {name!r:.40}: the package {package!s:.60} that offers it is not installed"
        raise PluginError(f"{problem}. Install it")


def _learner(content: Mapping[str, Any], version: int) -> Learner:
    kind = algorithm(content["algorithm"])
    settings = {name: value for name, value in content.items() if name != "algorithm"}
    return _settings(kind, with_later(kind, own_settings(kind, settings) if version == 1 else settings))


def maker(content: Mapping[str, Any]) -> str:
    """The version of clearway that a run.json names; this one where it names none."""
    versions = content.get("versions")
    return str(versions.get("clearway", __version__))[:40] if isinstance(versions, dict) else __version__


def _settings(kind: type[Learner], content: Mapping[str, Any]) -> Learner:
    """A settings object from JSON that has exactly its fields."""
    expected = {field.name for field in fields(kind)}
    if set(content) != expected:
        raise KeyError(", ".join(sorted(set(content) ^ expected)))
    types = field_types(kind)
    for name in expected:
        if not fits(content[name], types[name]):
            raise TypeError(f"{name} is {content[name]!r:.40}")
    with faults_of(kind, "settings"):
        return kind(**content)


def _scene_record(content: Mapping[str, Any]) -> SceneRecord:
    scene = SceneRecord(**{**content, "targets": tuple(content["targets"])})
    texts = all(fits(text, str) for text in (scene.name, scene.digest, scene.encoder))
    if not texts or not fits(scene.path, str | None) or not all(fits(target, int) for target in scene.targets):
        raise TypeError(f"scene {scene.name!r:.40}")
    if not is_name(scene.name):
        raise RunError(f"scene {scene.name!r:.40} cannot be part of a file's name")
    return scene
