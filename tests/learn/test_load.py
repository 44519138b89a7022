"""A trained agent brought back through its run folder and scene files."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from clearway.errors import RunError
from clearway.learn.checkpoint import newest_checkpoint
from clearway.learn.load import load_network, run_scenes, run_world
from clearway.learn.run_folder import RunFolder
from clearway.learn.run_record import record_of
from clearway.learn.running import save
from clearway.learn.train import RunRequest, train
from clearway.scenes.digest import scene_digest
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import read_scene, write_scene
from clearway.scenes.validate import SceneWarning
from clearway.world.world import make_world
from helpers.agents import after_poses
from helpers.small_runs import small_learner, small_request, small_scenes


def request_with_files(folder: Path) -> RunRequest:
    """A request whose scenes were read from files."""
    paths = {scene.name: folder / f"{scene.name}.h5" for scene in small_scenes()}
    for scene in small_scenes():
        write_scene(scene, paths[scene.name])
    scenes = [read_scene(path) for path in paths.values()]
    return small_request(scenes=scenes, paths=paths, learner=small_learner(frames=160))


@pytest.mark.parametrize(("directions", "heads"), [(0, "scene"), (3, "scene"), (0, "shared")])
def test_the_agent_acts_as_the_trainer_s_network(tmp_path: Path, directions: int, heads: str) -> None:
    request = request_with_files(tmp_path)
    request = replace(request, learner=replace(request.learner, feature_basis=directions, heads=heads))
    trainer = request.trainer()
    for _ in range(3):
        trainer.update()
    folder = RunFolder(tmp_path / "run")
    folder.write_record(record_of(request))
    save(trainer, folder, seconds=1.0)

    agent = load_network(folder.path)
    world = run_world(agent.record, run_scenes(agent.record))
    assert world.scene_names == ("corridor", "grid")
    assert torch.equal(world.target_state, trainer.world.target_state)
    target = torch.tensor([4, 0, 3, 1, 1, 2, 0, 4, 4])  # scenes in any order
    first = world.scene_offset[world.target_scene[target]]
    history = first[:, None] + torch.randint(20, (9, 4), generator=torch.Generator().manual_seed(0))
    decisions = after_poses(agent.on_poses(world), world, history, target)
    found = torch.from_numpy(decisions.probabilities)
    states = trainer.feature_map(trainer.world.features)
    with torch.no_grad():
        scores, value = trainer.network(states[history], states[world.target_state][target], world.target_scene[target])
    torch.testing.assert_close(found, torch.softmax(scores, 1), rtol=1e-4, atol=1e-6)
    torch.testing.assert_close(found.sum(1), torch.ones(9))
    scale = request.learner.reward_scale
    np.testing.assert_allclose(decisions.value * scale, value.numpy(), rtol=1e-4, atol=1e-5)
    assert (found.max(1).values > 0.26).any()  # three updates have moved it off the uniform policy


def test_an_earlier_checkpoint_can_be_asked_for(tmp_path: Path) -> None:
    request = small_request()
    trainer, folder = request.trainer(), RunFolder(tmp_path / "run")
    folder.write_record(record_of(request))
    save(trainer, folder, seconds=0.0)
    untrained = newest_checkpoint(folder.checkpoints)
    trainer.update()
    save(trainer, folder, seconds=1.0)
    agents = [load_network(folder.path, path) for path in (None, untrained)]
    assert [agent.frames for agent in agents] == [trainer.frames, 0]
    weights = [agent.network.siamese_weight for agent in agents]
    assert torch.equal(weights[0], trainer.network.siamese_weight)
    assert not torch.equal(*weights)


def changed(scene: Scene) -> Scene:
    features = scene.features.copy()
    features[4, 1] += np.float32(1e-3)
    return replace(scene, features=features)


def test_a_scene_whose_features_changed_is_refused(tmp_path: Path) -> None:
    request = request_with_files(tmp_path)
    record = train(request, tmp_path / "run").read_record()
    assert [scene.name for scene in run_scenes(record)] == ["corridor", "grid"]
    given = tmp_path / "given" / "grid.h5"
    given.parent.mkdir()
    for path in (given, tmp_path / "grid.h5"):
        write_scene(changed(request.scenes[1]), path)
    with pytest.raises(RunError, match=r"grid\.h5: not the scene that the run was trained on"):
        run_scenes(record)
    with pytest.raises(RunError, match=r"given/grid\.h5: not the scene that the run was trained on"):
        run_scenes(record, [given, tmp_path / "corridor.h5"])


def test_files_given_replace_those_recorded_in_the_run_s_order(tmp_path: Path) -> None:
    request = request_with_files(tmp_path)
    record = train(request, tmp_path / "run").read_record()
    moved = tmp_path / "moved"
    moved.mkdir()
    for name in ("corridor.h5", "grid.h5"):
        (tmp_path / name).rename(moved / name)
    with pytest.raises(RunError, match="file is missing"):
        run_scenes(record)
    with pytest.raises(RunError, match="scene grid of the run is not among the files given"):
        run_scenes(record, [moved / "corridor.h5"])
    scenes = run_scenes(record, [moved / "grid.h5", moved / "corridor.h5"])
    assert [scene.name for scene in scenes] == ["corridor", "grid"]


def test_a_renamed_file_is_known_by_what_it_holds(tmp_path: Path) -> None:
    request = request_with_files(tmp_path)
    record = train(request, tmp_path / "run").read_record()
    other = tmp_path / "other-grid.h5"
    write_scene(changed(request.scenes[1]), other)
    renamed = [(tmp_path / f"{name}.h5").rename(tmp_path / f"my-{name}.h5") for name in ("grid", "corridor")]
    scenes = run_scenes(record, renamed)
    assert [scene.name for scene in scenes] == ["corridor", "grid"]
    assert [scene_digest(scene) for scene in scenes] == [scene.digest for scene in record.scenes]
    with pytest.raises(RunError, match=r"scene grid .* given \(other-grid, my-corridor\), by name or by what"):
        run_scenes(record, [other, renamed[1]])


def test_the_right_file_is_found_beside_another_of_its_name(tmp_path: Path) -> None:
    request = request_with_files(tmp_path)
    record = train(request, tmp_path / "run").read_record()
    (tmp_path / "others").mkdir()
    write_scene(changed(request.scenes[1]), tmp_path / "others" / "grid.h5")
    right = (tmp_path / "grid.h5").rename(tmp_path / "old.h5")
    scenes = run_scenes(record, [tmp_path / "others" / "grid.h5", right, tmp_path / "corridor.h5"], tells_others=False)
    assert [scene_digest(scene) for scene in scenes] == [scene.digest for scene in record.scenes]


def test_what_is_left_out_is_told_of_where_the_run_was_not_trained_there_alone(tmp_path: Path) -> None:
    request = request_with_files(tmp_path)
    record = train(request, tmp_path / "run").read_record()
    grid, corridor = tmp_path / "grid.h5", tmp_path / "corridor.h5"
    again = [replace(scene, name=f"copy of {scene.name}") for scene in request.scenes]
    scenes = run_scenes(record, [corridor, grid, corridor, *again])  # a warning is an error in tests
    assert [scene.name for scene in scenes] == ["corridor", "grid"]
    with pytest.warns(SceneWarning, match="^grid: left out, as the run was not trained there"):
        run_scenes(record, [corridor, grid, changed(request.scenes[1])])


def test_a_scene_made_in_memory_has_no_file_to_come_back_from(tmp_path: Path) -> None:
    record = train(small_request(learner=small_learner(frames=80)), tmp_path / "run").read_record()
    with pytest.raises(RunError, match="corridor: the run's scene file is missing"):
        run_scenes(record)


def test_a_scene_in_memory_and_read_back_from_its_file_are_the_same_to_a_run(tmp_path: Path) -> None:
    from_files = request_with_files(tmp_path)
    in_memory = small_request(learner=small_learner(frames=160))
    assert record_of(in_memory).same_experiment(record_of(from_files))


def test_a_checkpoint_of_another_run_is_refused(tmp_path: Path) -> None:
    run = train(small_request(learner=small_learner(frames=80)), tmp_path / "run")
    wider = train(small_request(learner=small_learner(frames=80, width=24)), tmp_path / "wider")
    theirs = newest_checkpoint(wider.checkpoints)
    with pytest.raises(RunError, match=r"frames-\d+: not a checkpoint of .*run\. Name one in its check"):
        load_network(run.path, theirs)
    copied = shutil.copytree(theirs, run.path / "milestones" / theirs.name)
    with pytest.raises(RunError, match="does not fit its run"):
        load_network(run.path, copied)
    with pytest.raises(RunError, match="no run here"):
        load_network(tmp_path)


def test_a_world_of_other_scenes_or_features_is_refused(tmp_path: Path) -> None:
    request = small_request(learner=small_learner(frames=80))
    agent = load_network(train(request, tmp_path / "run").path)
    fewer = [replace(scene, features=scene.features[:, :1]) for scene in request.scenes]
    with pytest.raises(RunError, match="have 1 features, expected 12"):
        agent.on_poses(run_world(agent.record, fewer))
    turned = make_world(request.scenes[::-1], request.targets)
    with pytest.raises(RunError, match=r"the scenes are \('grid', 'corridor'\), but the agent's"):
        agent.on_poses(turned)


def test_a_world_without_features_is_refused(tmp_path: Path) -> None:
    request = small_request(learner=small_learner(frames=80))
    agent = load_network(train(request, tmp_path / "run").path)
    with pytest.raises(RunError, match="no features"):
        agent.on_poses(replace(request.trainer().world, features=None))
