"""Targets that are held out of trainings in generated rooms: never drawn there, drawn where they are asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clearway
from clearway.errors import ArgumentError, SceneError
from clearway.generation.files import notes_of
from clearway.generation.plans import generated_plan
from clearway.generation.request import Request
from clearway.live.live_room import live_room
from clearway.scenes.floor_plans import GENERATED
from clearway.scenes.plan_scenes import floor_plan_scene
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import write_scene
from clearway.scenes.validate import SceneWarning
from helpers.made import corridor_scene
from helpers.small_runs import FEATURES

SMALL = {"frames": 800, "envs": 10, "rollout_steps": 8, "step_limit": 30, "width": 16}
REQUEST = Request("room", "train", 0, 3)


@pytest.fixture(scope="module")
def room() -> Scene:
    """A generated room with made-up features."""
    scene = floor_plan_scene(generated_plan(REQUEST), feature_count=FEATURES)
    return replace(scene, made_by=replace(scene.made_by, source=GENERATED, seed=0, notes=notes_of(REQUEST)))


@pytest.fixture(scope="module")
def held(room: Scene) -> set[int]:
    return set(np.flatnonzero(room.held_out).tolist())


@pytest.fixture(scope="module")
def run(room: Scene, tmp_path_factory: pytest.TempPathFactory) -> clearway.TrainResult:
    folder = tmp_path_factory.mktemp("held out")
    path = folder / f"{room.name}.h5"
    write_scene(room, path)
    return clearway.train(path, out=folder / "run", **SMALL)


def test_a_training_draws_none_and_an_evaluation_can_draw_them(run, room, held, tmp_path) -> None:
    assert not set(run.record.targets[room.name]) & held
    found = clearway.evaluate(run, targets="held-out", episodes=2, step_limit=20)
    targets = [result.target for result in found.evaluations[0].targets]
    assert len(targets) == min(5, len(held)) and set(targets) <= held
    found.save(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"held-out.json", "held-out.md"}
    with pytest.raises(ArgumentError, match=r"a run has its own\. Leave them out, give 'held-out', or"):
        clearway.evaluate(run, targets=[3])


def test_held_out_targets_that_are_named_are_taken_and_told(room, held) -> None:
    one = min(held)
    with pytest.warns(SceneWarning, match=rf"^scene {room.name}: target {one} held out of training[^\n]*$"):
        trained = clearway.train(room, [one], **SMALL)
    assert trained.record.targets[room.name] == (one,)
    with pytest.raises(SceneError, match="corridor: nothing is held out in it"):
        clearway.train(corridor_scene(5, feature_count=FEATURES), "held-out", **SMALL)


def test_environments_on_the_grid_heed_them(room, held) -> None:
    for targets, inside in ((None, False), ("held-out", True)):
        env = clearway.make_env(room, targets=targets)
        drawn = {env.reset(seed=seed)[1]["target"] for seed in range(30)}
        assert len(drawn) > 2 and (drawn <= held if inside else not drawn & held)
    with pytest.raises(clearway.ClearwayError, match="corridor: nothing is held out in it"):
        clearway.make_env(corridor_scene(), targets="held-out")


@pytest.mark.slow
def test_a_live_room_knows_them_whatever_its_origin(room, held) -> None:
    live = live_room(room)
    assert live.origin_m != (0.0, 0.0)
    assert set(live.possible_targets(held_out=True).tolist()) == held
    assert set(live.possible_targets().tolist()) == set(range(room.state_count)) - held


@pytest.mark.slow
def test_live_environments_heed_them(room, held) -> None:
    places = {tuple(room.locations_m[state]) for state in held}
    for targets, inside in ((None, False), ("held-out", True)):
        env = clearway.make_env(room, live=True, targets=targets, height_px=12, width_px=16)
        for seed in range(20):
            _, info = env.reset(seed=seed)
            target_m = np.array([info["target_x_m"], info["target_z_m"]])
            near = min(float(np.abs(target_m - place_m).max()) for place_m in places)
            assert (near < 1e-9) == inside
        env.close()


def test_the_command_draws_them_and_keeps_its_own_files(run, room, held, capsys) -> None:
    from clearway.cli.main import main

    folder = run.folder
    with pytest.raises(SystemExit) as ended:
        main(["evaluate", str(folder), "--held-out", "--episodes", "2", "--step-limit", "20"])
    assert ended.value.code == 0
    told = next(line for line in capsys.readouterr().err.splitlines() if line.startswith("held-out targets: "))
    name, _, states = told.removeprefix("held-out targets: ").partition("=")
    assert name == room.name and {int(state) for state in states.split(",")} <= held
    assert (folder / "held-out.json").exists() and (folder / "held-out.md").exists()
    assert not (folder / "evaluation.json").exists()
