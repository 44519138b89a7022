"""A scene's file that is deleted, cut or replaced while it is trained on: the training has read it, and goes on."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from clearway.errors import RunError, SceneError
from clearway.learn import train
from clearway.learn.checkpoint import newest_checkpoint, read_training
from clearway.learn.figures import Figures
from clearway.learn.run_folder import RunFolder
from clearway.learn.train import RunRequest
from clearway.learn.trainer import Trainer
from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.made import corridor_scene, grid_scene
from helpers.small_runs import FEATURES, equal_bits, small_learner, small_request, small_targets

CHANGES: dict[str, Callable[[Path], object]] = {
    "deleted": Path.unlink,
    "cut": lambda path: path.write_bytes(path.read_bytes()[:1000]),
    "replaced": lambda path: write_scene(corridor_scene(4, feature_count=FEATURES, name=path.stem), path),
}


def request_of(folder: Path) -> RunRequest:
    """Of two scenes in files, as the command line reads them."""
    paths = {}
    for scene in (corridor_scene(5, feature_count=FEATURES), grid_scene(1, width=4, depth=3, feature_count=FEATURES)):
        paths[scene.name] = folder / f"{scene.name}.h5"
        if not paths[scene.name].exists():
            write_scene(scene, paths[scene.name])
    scenes = [read_scene(path) for path in paths.values()]
    return replace(small_request(), scenes=scenes, targets=small_targets(), paths=paths)


@pytest.mark.parametrize("store", ["memory", "mapped"])
@pytest.mark.parametrize("kind", CHANGES)
def test_a_training_does_not_miss_a_scene_that_is_gone(
    kind: str, store: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    request = replace(request_of(tmp_path), learner=small_learner(frames=320), feature_store=store)
    whole = train.train(request, tmp_path / "whole")
    update, path = Trainer.update, tmp_path / "grid.h5"

    def change_first(trainer: Trainer) -> Figures:
        if trainer.updates == 1:
            CHANGES[kind](path)
        return update(trainer)

    with monkeypatch.context() as patch:
        patch.setattr(Trainer, "update", change_first)
        changed = train.train(request, tmp_path / "changed")
    assert equal_bits(*[read_training(newest_checkpoint(run.checkpoints)) for run in (whole, changed)])
    check_is_refused(kind, tmp_path, changed)


def check_is_refused(kind: str, folder: Path, run: RunFolder) -> None:
    """To go on with the scene as it is now."""
    if kind == "deleted":  # `request_of` would make it anew
        with pytest.raises(SceneError, match=r"grid\.h5"):
            read_scene(folder / "grid.h5")
        return
    with pytest.raises((SceneError, RunError), match=r"grid|another experiment"):
        train.train(request_of(folder), run.path, resume=True)
