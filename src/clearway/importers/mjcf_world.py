"""A MuJoCo model opened to walk in: compiled, its floor and free cells found, its lens set.

`read_mjcf` photographs it, and live rooms are made of it. A scene's record keeps the model's path, what it does not say
of itself, the agent's body, and a hash of the compiled model, by which a changed one is noticed.

Coordinates: x is the model's x, z (across the floor) is the model's y, and heights are the model's z.
"""

from __future__ import annotations

import hashlib
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from clearway.errors import SceneError
from clearway.importers.mjcf_compile import compiled
from clearway.importers.mjcf_files import IMPORT_AGAIN, files_of_model
from clearway.importers.mjcf_floor import FloorChoice, find_cells, floor_of, on_floor, span_of
from clearway.rooms.build import shaping_versions
from clearway.rooms.navigation import Floor, NavigationGrid
from clearway.rooms.obstacles import AgentShape
from clearway.scenes.scene import Provenance, Scene

SOURCE = "mjcf"
SHOWN_GROUPS = (0, 1, 2)  # as MuJoCo's own viewer starts
NEAR_M = 0.05  # nothing nearer is drawn
DIGEST_LENGTH = 16
FARTHEST_M = 1e9  # a number of a record


@dataclass(frozen=True, eq=False)
class ModelWorld:
    """A model as a world.

    Attributes:
        path: of its file.
        model: compiled, with the agent's body in it, its lens set.
        data: with everything where the model starts.
        choice: what the file does not say of itself.
        agent: the body.
        floor: the rectangle that it may stand in.
        grid: where it fits there.
        top_m: height of the highest finite thing, or of the floor where that is higher.
        digest: hash of the compiled model, the same with the same version of MuJoCo.
        outside: SHA-256 of the files outside its folder that it names; empty where there are none.
    """

    path: Path
    model: mujoco.MjModel
    data: mujoco.MjData
    choice: FloorChoice
    agent: AgentShape
    floor: Floor
    grid: NavigationGrid
    top_m: float
    digest: str
    outside: str = ""

    def carries(self, points_m: np.ndarray) -> np.ndarray:
        """Whether there is a floor at each of (N, 2) points, (N,) bool."""
        return on_floor(self.model, self.data, points_m, self.choice.floor_m)

    def provenance(self) -> Provenance:
        """What a scene of it keeps, for `world_of`."""
        return Provenance(
            SOURCE,
            versions=shaping_versions(),
            notes={
                "file": self.path.name,
                "path": str(self.path.resolve()),
                "digest": self.digest,
                "world": asdict(self.choice),
                "agent": asdict(self.agent),
                **({"outside": self.outside} if self.outside else {}),
            },
        )


def open_world(
    path: Path, choice: FloorChoice | None = None, agent: AgentShape | None = None, *, trust: bool | str = False
) -> ModelWorld:
    """The world of an MJCF or URDF file.

    Args:
        path: the file; meshes, textures and included files lie where it says, in its folder.
        choice: what the file does not say.
        agent: the agent's body and step.
        trust: they may lie elsewhere, see `files_of_model`.

    Raises:
        SceneError: the model names what it may not, MuJoCo refuses it, the world is too large, or the agent fits
            nowhere.
    """
    choice, agent = choice or FloorChoice(), agent or AgentShape()
    if agent.height_m <= 2 * agent.radius_m:
        problem = f"an agent {agent.height_m:g} m high and {2 * agent.radius_m:g} m wide is no standing capsule"
        raise SceneError(path, problem, "Make it higher or thinner")
    files = files_of_model(path, trust=trust)
    model = compiled(path, agent, files)
    digest = _digest(model)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    floor = floor_of(path, model, data, choice, agent.step_m)
    grid = find_cells(path, model, data, floor, choice, agent)
    top_m = _set_lens(model, data, floor, choice.floor_m)
    return ModelWorld(path, model, data, choice, agent, floor, grid, top_m, digest, files.outside)


def world_of(scene: Scene) -> ModelWorld:
    """The world that an imported scene was made of.

    Raises:
        SceneError: its record does not name the model or is damaged; the model is missing or another one by now.
    """
    notes = scene.made_by.notes
    path, digest, outside = notes.get("path"), notes.get("digest"), notes.get("outside", "")
    if not isinstance(path, str) or not isinstance(digest, str) or not isinstance(outside, str):
        raise SceneError(scene.name, "it does not say where its MuJoCo model lies", IMPORT_AGAIN)
    choice, agent = _recorded(scene, FloorChoice, "world"), _recorded(scene, AgentShape, "agent")
    if not Path(path).is_file():
        raise SceneError(
            scene.name, f"its MuJoCo model {path} is missing", f"Put it back there, or {_lower(IMPORT_AGAIN)}"
        )
    world = open_world(Path(path), choice, agent, trust=outside)
    same = scene.made_by.versions.get("mujoco") != mujoco.__version__ or world.digest == digest
    if not same or not _same_grid(world.grid, scene):
        raise SceneError(scene.name, f"its MuJoCo model {path} has changed since it was imported", IMPORT_AGAIN)
    return world


def _digest(model: mujoco.MjModel) -> str:
    """Hash of all arrays of a compiled model and its headlight; where its files lie does not count."""
    light = model.vis.headlight
    arrays = {name: getattr(model, name) for name in sorted(dir(model)) if not name.startswith("_")}
    arrays |= {"ambient": light.ambient, "diffuse": light.diffuse, "specular": light.specular}
    found = hashlib.sha256()
    for name, values in arrays.items():
        if isinstance(values, np.ndarray):
            found.update(f"{name} {values.dtype} {values.shape}".encode())
            found.update(values.tobytes())
    return found.hexdigest()[:DIGEST_LENGTH]


def _same_grid(grid: NavigationGrid, scene: Scene) -> bool:
    return np.array_equal(grid.graph, scene.graph) and np.allclose(grid.state_locations_m, scene.locations_m)


def _recorded(scene: Scene, kind: type[Any], name: str) -> Any:
    """A record of the scene's as what it was written from; it may be anything. Raises SceneError."""
    found = scene.made_by.notes.get(name)
    known = {own.name for own in fields(kind)}
    if isinstance(found, dict) and set(found) == known:
        values = {key: tuple(value) if isinstance(value, list) else value for key, value in found.items()}
        expected = asdict(kind())
        if all(_alike(value, expected[key], key) for key, value in values.items()):
            return kind(**values)
    raise SceneError(scene.name, f"the record of its MuJoCo model's {name} is damaged", IMPORT_AGAIN)


PAIRS = {"spawn_m": 2, "extent_m": 4}


def _alike(value: object, expected: object, name: str) -> bool:
    """A value of the kind that a field has: True or False, a finite number, or so many of them or none."""
    if name in PAIRS:
        return value is None or (isinstance(value, tuple) and len(value) == PAIRS[name] and all(map(_is_number, value)))
    return isinstance(value, bool) if isinstance(expected, bool) else _is_number(value)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= FARTHEST_M


def _lower(words: str) -> str:
    return words[0].lower() + words[1:]


def _set_lens(model: mujoco.MjModel, data: mujoco.MjData, floor: Floor, floor_m: float) -> float:
    """Draw from `NEAR_M` up to beyond everything finite (models' own limits are meant for a view of the whole).

    Returns:
        Height of the highest finite thing, or of the floor where that is higher.
    """
    low_m, high_m = span_of(model, data)
    low_m = np.minimum(low_m, (*floor.low_m, floor_m))
    high_m = np.maximum(high_m, (*floor.high_m, floor_m))
    model.stat.extent = 1.0  # what the limits are multiples of
    model.vis.map.znear = NEAR_M
    model.vis.map.zfar = 2 * float(np.linalg.norm(high_m - low_m)) + 100
    return float(high_m[2])
