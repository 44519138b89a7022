"""Checks that a scene passes before anything rests on it, as pure functions on its arrays.

What training depends on (the graph and the features) raises `SceneError`. What only maps and tables show
(where a state lies and looks) is judged by `pose_quirks`, since published dumps may have quirks there.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from clearway.errors import SceneError
from clearway.scenes.actions import ACTION_COUNT, BLOCKED, MOVES, TURNS, Action
from clearway.scenes.parts import check_parts
from clearway.scenes.scene import Observations, Scene, TopView
from clearway.scenes.sensors import RGB, STEPS_DTYPE, Readings, Sensor

MIN_STATES = 2
MAX_STATES = 65_536
MAX_FEATURES = 65_536
MIN_HEADINGS, MAX_HEADINGS = 3, 360
MAX_PICTURE_SIDE = 2_048  # pixels
MAX_COORDINATE_M = 10_000.0
MIN_CELL_SIZE_M = 1e-3
SENSOR_NAME = "(?!target)[a-z][a-z0-9_]{0,39}"  # environments show targets as target_...
NO_SENSORS = (RGB, "observation", "scene")  # colour stands elsewhere, and environments use the other names
SENSOR_DTYPES = ("uint8", "uint16", "float32")
MAX_UNIT = 20
CHECK_THE_MAKER = "Make the scene again, or check the program that made it"


class SceneWarning(UserWarning):
    """Something odd in a scene that does not keep it from being used."""


def check_scene(scene: Scene, source: str | Path | None = None) -> None:
    """Check every part of a scene. Raises SceneError; `source` is the file it names, else the scene's name."""
    source = str(scene.name) if source is None else source
    check_parts(scene, source)
    check_graph(scene.graph, source)
    check_turns(scene.graph, source)
    check_headings(scene.cells, source)
    check_moves(scene.graph, source)
    check_poses(scene.locations_m, scene.headings_deg, scene.state_count, source)
    if scene.features is not None:
        if isinstance(scene.features, np.ndarray):  # features in a file are checked whenever they are read
            check_features(scene.features, scene.state_count, source)
        if scene.encoder is None:
            raise SceneError(source, "has features but no record of their encoder", "Encode the scene again")
    if scene.observations is not None:
        check_observations(scene.observations, scene.state_count, source)
    check_further(scene.further, scene.state_count, source)
    if scene.top_view is not None:
        check_top_view(scene.top_view, source)
    if not MIN_CELL_SIZE_M <= scene.cell_size_m <= MAX_COORDINATE_M:  # NaN fails the comparison
        problem = f"has a cell size of {scene.cell_size_m} m"
        raise SceneError(source, problem, f"Give a length from {MIN_CELL_SIZE_M} to {MAX_COORDINATE_M:,.0f} m")


def check_graph(graph: np.ndarray, source: str | Path) -> None:
    """Check that `graph` is (S, A) integers, S at least 2, each -1 or a state. Raises SceneError."""
    _check(graph.ndim == 2 and graph.shape[1] == ACTION_COUNT, source, "graph", _shape_problem(graph, "(S, 4)"))
    _check(graph.dtype.kind in "iu", source, "graph", f"holds {graph.dtype}, expected integers")
    count = len(graph)
    _check(
        MIN_STATES <= count <= MAX_STATES,
        source,
        "graph",
        f"has {count} states, expected {MIN_STATES} to {MAX_STATES}",
    )
    wrong = np.argwhere((graph < BLOCKED) | (graph >= count))
    if len(wrong):
        state, action = wrong[0].tolist()
        problem = f"state {state} leads to {graph[state, action]} by action {action}, expected -1 to {count - 1}"
        raise SceneError(source, problem, CHECK_THE_MAKER, "graph")


def check_turns(graph: np.ndarray, source: str | Path) -> None:
    """Check that turns are never blocked, and that right then left leads back. Raises SceneError."""
    states = np.arange(len(graph))
    for turn in TURNS:
        _check_states(graph[:, turn] != BLOCKED, source, f"the {_words(turn)} is blocked")
    right, left = (graph[:, turn].astype(np.int64) for turn in TURNS)
    _check_states(left[right] == states, source, "a right and a left turn do not lead back")


def check_headings(cells: np.ndarray, source: str | Path) -> None:
    """Check that one number of right turns leads back everywhere. Raises SceneError.

    Args:
        cells: (S,) int64, cell of each state, see `Scene.cells`.
        source: the file, for the error.
    """
    turns = np.bincount(cells)[cells]
    usual = int(np.bincount(turns).argmax())
    _check_states(turns == usual, source, f"the right turns that lead back are not {usual}, as elsewhere,")
    allowed = MIN_HEADINGS <= usual <= MAX_HEADINGS
    _check(allowed, source, "graph", f"has {usual} headings, expected {MIN_HEADINGS} to {MAX_HEADINGS}")


def check_moves(graph: np.ndarray, source: str | Path) -> None:
    """Check that moves that are not blocked lead elsewhere, and that there are such. Raises SceneError."""
    moves = graph[:, list(MOVES)]
    stuck = (moves == np.arange(len(graph))[:, None]).any(axis=1)
    _check_states(~stuck, source, f"a move leads where it began, and is not {BLOCKED} as blocked ones are,")
    if (moves == BLOCKED).all():
        remedy = "Check how far neighbouring cells are apart, and what is blocked"
        raise SceneError(source, "has no open move, so that nobody can go anywhere", remedy, "graph")


def check_features(features: np.ndarray, state_count: int, source: str | Path) -> None:
    """Check that features are (S, F) finite floats. Raises SceneError."""
    name = "resnet_feature"
    fits = features.ndim == 2 and len(features) == state_count and 1 <= features.shape[1] <= MAX_FEATURES
    _check(fits, source, name, _shape_problem(features, f"({state_count}, F)"))
    _check(features.dtype.kind == "f", source, name, f"holds {features.dtype}, expected floats")
    broken = np.flatnonzero(~np.isfinite(features).all(axis=1))
    if len(broken):
        problem = f"the features of {len(broken)} states, first {broken[0]}, hold NaN or Inf"
        raise SceneError(source, problem, "Encode the pictures again", name)


def check_poses(locations_m: np.ndarray, headings_deg: np.ndarray, state_count: int, source: str | Path) -> None:
    """Check that locations are (S, 2) and headings (S,), finite and of a sane size. Raises SceneError."""
    fits = locations_m.shape == (state_count, 2)
    _check(fits, source, "location", _shape_problem(locations_m, f"({state_count}, 2)"))
    sane = np.isfinite(locations_m) & (np.abs(locations_m) <= MAX_COORDINATE_M)
    _check(bool(sane.all()), source, "location", f"holds NaN, Inf or more than {MAX_COORDINATE_M:,.0f} m")
    fits = headings_deg.shape == (state_count,)
    _check(fits, source, "rotation", _shape_problem(headings_deg, f"({state_count},)"))
    sane = np.isfinite(headings_deg) & (np.abs(headings_deg) <= 360)
    _check(bool(sane.all()), source, "rotation", "holds values that are no headings from -360 to 360 degrees")


def check_observations(observations: Observations, state_count: int, source: str | Path) -> None:
    """Check that pictures are (S, height, width, 3), by their shape alone. Raises SceneError."""
    shape = observations.shape
    fits = len(shape) == 4 and shape[0] == state_count and shape[3] == 3
    fits = fits and all(1 <= side <= MAX_PICTURE_SIDE for side in shape[1:3])
    wanted = f"({state_count}, height, width, 3) with sides up to {MAX_PICTURE_SIDE}"
    _check(fits, source, "observation", f"has shape {tuple(shape)}, expected {wanted}")


def check_further(further: tuple[Readings, ...], state_count: int, source: str | Path) -> None:
    """Check that each sensor has one set of readings, of its shape and type at every state. Raises SceneError.

    Their values are checked whenever they are read or written.
    """
    names = [readings.sensor.name for readings in further]
    for readings, name in zip(further, names, strict=True):
        check_sensor(readings.sensor, source)
        _check(names.count(name) == 1, source, name, "stands twice among the sensors")
        wanted = (state_count, *readings.sensor.shape)
        _check(tuple(readings.shape) == wanted, source, name, f"has shape {tuple(readings.shape)}, expected {wanted}")
        dtype, kept = getattr(readings.raw, "dtype", None), readings.sensor.kept_dtype
        _check(dtype is None or dtype == kept, source, name, f"holds {dtype}, expected {kept}")


def check_sensor(sensor: Sensor, source: str | Path) -> None:
    """Check what is said of a sensor besides the colour camera. Raises SceneError."""
    name = sensor.name
    named = bool(re.fullmatch(SENSOR_NAME, name)) and name not in NO_SENSORS
    _check(named, source, name[:80], "is no name of a sensor: small letters, digits and underscores")
    sides = 1 <= len(sensor.shape) <= 3 and all(1 <= side <= MAX_PICTURE_SIDE for side in sensor.shape)
    problem = f"has observations of shape {sensor.shape}, expected 1 to 3 sides up to {MAX_PICTURE_SIDE}"
    _check(sides, source, name, problem)
    problem = f"is of {sensor.dtype[:80]}, expected {', '.join(SENSOR_DTYPES)}"
    _check(sensor.dtype in SENSOR_DTYPES, source, name, problem)
    _check(len(sensor.unit) <= MAX_UNIT, source, name, f"has a unit of {len(sensor.unit)} letters")
    ranged = -np.inf < sensor.low < sensor.high < np.inf  # NaN fails the comparison
    _check(ranged, source, name, f"has the range {sensor.low} to {sensor.high}")
    if sensor.step is not None:
        most = np.iinfo(STEPS_DTYPE).max
        fits = sensor.step > 0 and sensor.low >= 0 and sensor.high / sensor.step <= most
        _check(fits, source, name, f"has steps of {sensor.step}, expected 0 to {most} of them in its range")


def check_top_view(view: TopView, source: str | Path) -> None:
    """Check that the picture from above is (height, width, 3) uint8 and covers some floor. Raises SceneError."""
    shape = view.image.shape
    fits = len(shape) == 3 and shape[2] == 3 and all(1 <= side <= MAX_PICTURE_SIDE for side in shape[:2])
    fits = fits and view.image.dtype == np.uint8
    _check(fits, source, "top_view", f"is {view.image.dtype} of shape {shape}, no picture")
    extent_m = (view.x_min_m, view.x_max_m, view.z_min_m, view.z_max_m)
    covers = view.x_min_m < view.x_max_m and view.z_min_m < view.z_max_m
    sane = all(abs(side) <= MAX_COORDINATE_M for side in extent_m)
    _check(covers and sane, source, "top_view", f"covers {extent_m} m (x from, to, z from, to), which is no rectangle")


def pose_quirks(scene: Scene) -> list[str]:
    """What is odd about where the states lie and look, one sentence each; empty for a regular scene."""
    found = []
    turn_deg = scene.turn_deg
    rounded_deg = 0.0 if turn_deg.is_integer() else 0.5  # headings are whole degrees
    if np.any(np.abs((scene.headings_deg + turn_deg / 2) % turn_deg - turn_deg / 2) > rounded_deg):
        found.append(f"some headings are no multiples of {turn_deg:g} degrees")
    turned = {turn: scene.graph[:, turn] for turn in TURNS}
    for turn, right_deg in zip(TURNS, (turn_deg, -turn_deg), strict=True):
        off_deg = (scene.headings_deg[turned[turn]] - scene.headings_deg - right_deg + 180) % 360 - 180
        found += _quirk(np.abs(off_deg) > 2 * rounded_deg, f"a {_words(turn)} changes the heading by {right_deg:g}")
        moves = _ends_astray(scene, turned[turn], np.zeros(2))
        found += _quirk(moves, f"a {_words(turn)} keeps the location")
    facing = np.deg2rad(scene.headings_deg)
    forward_m = scene.cell_size_m * np.stack([np.sin(facing), np.cos(facing)], axis=1)
    for move, sign in zip(MOVES, (1, -1), strict=True):
        ahead = scene.graph[:, move]
        astray = (ahead != BLOCKED) & _ends_astray(scene, ahead, sign * forward_m)
        found += _quirk(astray, f"a {_words(move)} leads one cell along the heading")
    return found


def _ends_astray(scene: Scene, end: np.ndarray, expected_m: np.ndarray) -> np.ndarray:
    """Whether the state (S,) that each leads to lies elsewhere than so many metres further, (S, 2), (S,) bool."""
    off_m = np.abs(scene.locations_m[end] - scene.locations_m - expected_m)
    return np.maximum(off_m[:, 0], off_m[:, 1]) > 0.1 * scene.cell_size_m


def _quirk(broken: np.ndarray, rule: str) -> list[str]:
    """One sentence where a rule is broken by any state, else none."""
    states = np.flatnonzero(broken)
    return [f"{len(states)} states, first {states[0]}, break the rule that {rule}"] if len(states) else []


def _check(holds: bool, source: str | Path, dataset: str, problem: str) -> None:
    if not holds:
        raise SceneError(source, problem, CHECK_THE_MAKER, dataset)


def _check_states(holds: np.ndarray, source: str | Path, problem: str) -> None:
    wrong = np.flatnonzero(~holds)
    if len(wrong):
        raise SceneError(source, f"{problem} at state {wrong[0]}", CHECK_THE_MAKER, "graph")


def _shape_problem(values: np.ndarray, wanted: str) -> str:
    return f"has shape {values.shape}, expected {wanted}"


def _words(action: Action) -> str:
    """The action in running text, for example "right turn"."""
    verb, direction = action.name.lower().split("_")
    return f"{direction} {verb}"
