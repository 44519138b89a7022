from dataclasses import FrozenInstanceError, dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import torch

import clearway
from clearway.api import training
from clearway.api.perturbations import perturbations_asked
from clearway.api.training import chosen_learner
from clearway.errors import ArgumentError, ClearwayError, RunError
from clearway.learn.presets import DEFAULT, PAPER_A3C
from clearway.learn.run_folder import RunFolder
from clearway.learn.run_record import record_of
from clearway.learn.train import RunRequest
from clearway.learn.train import train as train_run
from clearway.learn.workers import train_by_workers
from clearway.reward import COLLISION_AWARE, SHORTEST, Arrival, Moves, Reward, RewardError, Term, Time
from clearway.scenes.thor_v1 import write_scene
from clearway.views.seen import made_in_training
from helpers import own_terms
from helpers.made import corridor_scene, grid_scene
from helpers.small_runs import CORRIDOR_TARGETS, FEATURES, small_learner, small_scenes, small_targets

SMALL = {"frames": 800, "envs": 10, "rollout_steps": 8, "step_limit": 30, "width": 16}


@pytest.fixture(scope="module")
def corridor():
    return corridor_scene(5, feature_count=FEATURES)


@pytest.mark.slow
def test_it_trains_what_a_request_would(tmp_path) -> None:
    """The same bits as by way of the deep imports."""
    learner = small_learner(DEFAULT, **SMALL)
    train_run(RunRequest(small_scenes(), small_targets(), learner, SHORTEST, seed=3), tmp_path / "run")
    expected = clearway.load_agent(tmp_path / "run")
    found = clearway.train(small_scenes(), small_targets(), reward="shortest", seed=3, **SMALL)
    assert found.folder is None
    assert found.record.same_experiment(expected.record)
    assert found.agent.frames == 800
    for name, tensor in expected.network.state_dict().items():
        assert torch.equal(tensor, found.agent.network.state_dict()[name]), name


def test_nothing_is_printed_or_left_behind(corridor, tmp_path, monkeypatch, capfd) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    clearway.train(corridor, **SMALL)
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


def test_a_run_of_a_term_whose_code_has_changed_does_not_go_on_but_can_be_tried(
    corridor, tmp_path, monkeypatch
) -> None:
    mine = own_terms.imported(tmp_path / "turning.py", monkeypatch).REWARD
    clearway.train(corridor, reward=mine, out=tmp_path / "run", **SMALL)
    clearway.train(corridor, reward=mine, out=tmp_path / "run", resume=True, **SMALL)
    dearer = own_terms.imported(tmp_path / "turning.py", monkeypatch, own_terms.DEARER).REWARD
    with pytest.raises(RunError, match="own_turning:Turning, a term of its reward, has changed since the run began"):
        clearway.train(corridor, reward=dearer, out=tmp_path / "run", resume=True, **SMALL)
    monkeypatch.delitem(own_terms.sys.modules, own_terms.NAME)
    found = clearway.evaluate(tmp_path / "run", scenes=corridor, episodes=1, step_limit=5).evaluations
    assert {str(one.trained.reward) for one in found if one.trained} == {str(mine)}


def test_workers_import_the_terms_of_a_reward(corridor, tmp_path, monkeypatch) -> None:
    """Those of this machine import the program, too, where it is a file."""

    @dataclass(frozen=True)
    class Inner(Term):
        def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
            return earned

    rooms, two = [corridor, replace(corridor, name="other")], {"workers": 2, "out": tmp_path / "run", **SMALL}
    with pytest.raises(RewardError, match="its term Inner stands inside a function, which worker processes cannot"):
        clearway.train(rooms, reward=Reward("inner", (Inner(), Arrival())), **two)
    turning = own_terms.imported(tmp_path / "turning.py", monkeypatch)
    monkeypatch.setattr(turning.Turning, "__module__", "__main__")
    request = RunRequest(rooms, {room.name: [8] for room in rooms}, small_learner(), turning.REWARD)
    request.check(workers=1, ray="local")
    monkeypatch.setattr(own_terms.sys.modules["__main__"], "__file__", __file__, raising=False)
    request.check(workers=2)
    monkeypatch.setattr(own_terms.sys.modules["__main__"], "__file__", "<stdin>")
    with pytest.raises(RewardError, match="its term Turning stands in the program that was started"):
        request.check(workers=2)
    monkeypatch.setattr(own_terms.sys.modules["__main__"], "__file__", __file__)
    with pytest.raises(RewardError, match="its term Turning stands in the program that was started"):
        request.check(workers=2, ray="local")
    monkeypatch.setattr(training, "train_by_workers", lambda *_, **__: pytest.fail("asked for workers"))
    with pytest.raises(RewardError, match="its term Turning stands in the program that was started"):
        clearway.train(rooms, reward=turning.REWARD, ray="local", **two)
    with pytest.raises(RewardError, match="its term Turning stands in the program that was started"):
        train_by_workers(request, tmp_path / "run", 2, ray="local")
    monkeypatch.delattr(own_terms.sys.modules["__main__"], "__file__")
    with pytest.raises(RewardError, match="its term Turning stands in the program that was started"):
        request.check(workers=2)
    assert not (tmp_path / "run").exists()


def test_a_run_folder_is_one_like_any_other_and_goes_on(corridor, tmp_path) -> None:
    write_scene(corridor, tmp_path / "corridor.h5")
    out = str(tmp_path / "run")
    first = clearway.train(tmp_path / "corridor.h5", list(CORRIDOR_TARGETS), out=out, **SMALL)
    assert first.folder == Path(out)
    assert first.record.scenes[0].path == str(tmp_path / "corridor.h5")
    assert first.figures == first.metrics[-1] and first.figures["frames"] == 800
    again = clearway.train(tmp_path / "corridor.h5", list(CORRIDOR_TARGETS), out=out, resume=True, **SMALL)
    assert again.metrics == first.metrics
    with pytest.raises(clearway.ClearwayError, match="holds a run already"):
        clearway.train(tmp_path / "corridor.h5", out=out, **SMALL)


def test_what_it_returns_cannot_be_changed_and_shows_itself(corridor) -> None:
    result = clearway.train(corridor, [16], **SMALL)
    with pytest.raises(FrozenInstanceError):
        result.folder = Path("elsewhere")
    assert repr(result) == f"<TrainResult: 800 frames, {result.solved_targets} of 1 targets solved, no folder>"
    head, _, *rows = result.markdown(3).splitlines()
    assert head.startswith("| frames | seconds | solved_targets |")
    assert len(rows) == 3 and rows[-1].startswith("| 800 |")


def test_numbers_may_be_numpy_s_and_the_record_is_plain(corridor, tmp_path) -> None:
    settings = {name: np.int64(value) for name, value in SMALL.items()}
    result = clearway.train(
        corridor,
        np.array([16, 8]),
        seed=np.int32(2),
        lr_start=np.float32(0.25),
        discount=1,
        threads=np.int64(1),
        hindsight=np.bool_(False),
        out=tmp_path / "run",
        **settings,
    )
    learner = result.record.learner
    assert (learner.frames, learner.lr_start, learner.discount, learner.hindsight) == (800, 0.25, 1.0, False)
    assert {type(value) for value in vars(learner).values()} <= {int, float, bool, str}
    assert clearway.load_agent(tmp_path / "run").record.targets == {"corridor": (16, 8)}


@pytest.mark.parametrize("algorithm", ["ppo", "a2c", "paper", replace(DEFAULT, discount=0.5)])
def test_algorithms_by_name_and_by_settings(corridor, algorithm) -> None:
    learner = clearway.train(corridor, algorithm=algorithm, **SMALL).record.learner
    named = {"ppo": DEFAULT, "a2c": clearway.A2C(), "paper": clearway.PAPER_A2C}
    expected = named[algorithm] if isinstance(algorithm, str) else algorithm
    assert learner == replace(expected, **SMALL)


def test_a3c_by_name() -> None:
    """Not trained here: that takes processes, and the command's tests do it."""
    settings = {"envs": 3, "width": 16, "step_limit": 30}
    assert chosen_learner("a3c", 300, settings) == replace(PAPER_A3C, frames=300, **settings)


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ({"algorithm": "sac"}, "algorithm='sac': no such algorithm. Use one of ppo, a2c, a3c, .*, paper, paper-a3c"),
        ({"algorithm": 3}, "no such algorithm"),
        ({"learning_rate": 3}, "learning_rate: no such setting. Use one of frames, centre_features"),
        ({"envs": 2.5}, r"envs=2\.5: expected a whole number"),
        ({"envs": True}, "envs=True: expected a whole number"),
        ({"discount": "0.9"}, r"discount='0\.9': expected a finite number"),
        ({"hindsight": 1}, "hindsight=1: expected True or False"),
        ({"optimiser": "sgd"}, "optimiser='sgd': expected one of 'adam', 'rmsprop'"),
        ({"frames": "many"}, "frames='many': expected a whole number"),
        ({"seed": -1}, "seed=-1"),
        ({"threads": 0}, "threads=0"),
        ({"out": 3}, "out=3: expected a path"),
        ({"resume": True}, "Give it as out"),
        ({"zone_level": "room"}, "expected one of 'pose', 'cell'"),
        ({"feature_store": "disk"}, "expected one of 'memory'"),
        ({"device": 0}, "device=0: expected a word"),
        ({"reward": 3}, "reward=3 is unknown"),
        ({"targets": 3}, r"targets=3: expected state ids by scene name, such as \{'bathroom': \[26, 37\]\}"),
        ({"targets": "16"}, "expected state ids"),
        ({"targets": [1.5]}, r"targets\['corridor'\]=1\.5: expected a whole number"),
        ({"targets": {"cellar": [1]}}, "no scene 'cellar' is given. Name one of corridor"),
        ({"targets": {"corridor": 1}}, "Give a list of them"),
        ({"targets": []}, r"targets\['corridor'\] is empty: .* Leave it out for five seeded ones"),
    ],
)
def test_what_does_not_fit_is_told_in_one_line_that_is_also_a_value_error(corridor, arguments, part) -> None:
    with pytest.raises(clearway.ClearwayError, match=part) as caught:
        clearway.train(corridor, **arguments)
    assert isinstance(caught.value, ValueError)
    assert "\n" not in str(caught.value)


def test_perturbed_pictures_are_of_rooms_and_for_algorithms_that_learn_by_them(corridor) -> None:
    with pytest.raises(ClearwayError, match="perturb: q-learning learns from the scenes' own pictures alone"):
        clearway.train(corridor, algorithm="q-learning", perturb="all", **{"frames": 800})
    with pytest.raises(ArgumentError, match="there is none of that name"):
        clearway.train(corridor, perturb="fog", **SMALL)
    with pytest.raises(ClearwayError, match=r"encoder made-up: .* Encode the scene again"):
        clearway.train(corridor, perturb="all", **SMALL)


@dataclass(frozen=True)
class Weighed(Term):
    weights: object

    def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
        return earned


UNTOLD = Reward("odd", (Time(), Weighed((1j,)), Arrival()))


def test_what_is_wrong_is_told_before_pictures_are_taken(corridor, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(training, "takes_seen", lambda *_, **__: pytest.fail("taken"))
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "run.json").touch()
    (tmp_path / "left" / "checkpoints").mkdir(parents=True)
    before = sorted(tmp_path.rglob("*"))
    for wrong, part in (
        ({"reward": "shortst"}, "shortst"),
        ({"zone_level": "room"}, "zone_level='room'"),
        ({"device": 3}, "device=3"),
        ({"threads": 0}, "threads=0"),
        ({"until_solved": "yes"}, "until_solved='yes'"),
        ({"reward": UNTOLD}, "reward odd: a parameter is no JSON value"),
        ({"reward": replace(SHORTEST, clip=True), "clip_rewards": False}, "reward shortest clips, and ppo's setting"),
        ({"track": "excel"}, "--track excel: expected tensorboard or wandb"),
        ({"track": 5}, "--track 5: expected tensorboard or wandb"),
        ({"device": "abacus"}, "device abacus: cannot be used here"),
        ({"workers": 2}, "1 scene"),
        ({"feature_store": "mapped"}, "features of perturbed pictures are kept in memory"),
        ({"out": 3}, "out=3: expected a path"),
        ({"out": tmp_path / "run"}, "run: holds a run already"),
        ({"out": tmp_path / "left"}, r"left: holds checkpoints but no run\.json"),
        ({"out": tmp_path / "run" / "run.json"}, r"run\.json: not a folder to write to .* is a file\)"),
        ({"out": tmp_path / "run" / "run.json" / "new"}, r"new: not a folder to write to .*run\.json is a file\)"),
        ({"out": tmp_path / "new", "copy_to": "runs/one"}, "copy_to=runs/one: expected an address of s3:// or gs://"),
    ):
        with pytest.raises(ClearwayError, match=part):
            clearway.train(corridor, perturb="all", **wrong, **SMALL)
    assert sorted(tmp_path.rglob("*")) == before


class Taken(Exception):
    pass


def test_another_experiment_is_told_of_before_pictures_are_taken(corridor, tmp_path, monkeypatch, s3) -> None:
    out, asked = tmp_path / "run", {"perturb": "all", "resume": True, "targets": [8], **SMALL}
    made = made_in_training(perturbations_asked("all"), 4, 0)
    request = RunRequest([corridor], {"corridor": [8]}, chosen_learner("ppo", settings=SMALL), COLLISION_AWARE)
    record = record_of(replace(request, takes_made=made))
    with RunFolder(out).held():
        RunFolder(out).write_record(record)
    monkeypatch.setattr(training, "takes_seen", lambda *_, **__: (_ for _ in ()).throw(Taken))
    for wrong, part in (
        ({"seed": 1}, "run: holds another experiment"),
        ({"perturb": "light=0.5"}, "run: holds another experiment"),
        ({"takes": 3}, "run: holds another experiment"),
        ({"frames": 1600}, "run: was started for 800 frames"),
        ({"copy_to": "s3://no-such-bucket/run"}, "s3://no-such-bucket/run.*: there is nothing there"),
    ):
        with pytest.raises(ClearwayError, match=part):
            clearway.train(corridor, out=out, **{**asked, **wrong})
    with pytest.raises(Taken):
        clearway.train(corridor, out=out, **asked)
    with RunFolder(out).held(), pytest.raises(ClearwayError, match="run: another process trains here"):
        clearway.train(corridor, out=out, **asked)
    s3("runs/one/run.json", (out / "run.json").read_bytes())
    elsewhere = {**asked, "out": tmp_path / "elsewhere", "copy_to": "s3://rooms/runs/one"}
    with pytest.raises(ClearwayError, match=r"s3://rooms/runs/one: holds another experiment .* another --copy-to"):
        clearway.train(corridor, **{**elsewhere, "seed": 1})
    with pytest.raises(ClearwayError, match=r"s3://rooms/runs/one: was started for 800 .* 800, or another --copy-to"):
        clearway.train(corridor, **{**elsewhere, "frames": 1600})
    (tmp_path / "holds").mkdir()
    (tmp_path / "holds" / "notes.txt").touch()
    with pytest.raises(ClearwayError, match="holds: exists and is no empty folder"):
        clearway.train(corridor, **{**elsewhere, "out": tmp_path / "holds"})
    with pytest.raises(ClearwayError, match=r"s3://rooms/runs/one: holds a run already\. Give --resume"):
        clearway.train(corridor, **{**elsewhere, "resume": False})
    with pytest.raises(Taken):
        clearway.train(corridor, **elsewhere)
    s3("runs/one/checkpoints/frames-000000000800/checkpoint.json", b"{}")
    with pytest.raises(ClearwayError, match=r"s3://rooms/runs/one: was started for 800 .*, more than 800, or another"):
        clearway.train(corridor, **{**elsewhere, "frames": 400})
    with pytest.raises(Taken):
        clearway.train(corridor, **{**elsewhere, "frames": 1600})
    assert not (tmp_path / "elsewhere").exists()


def test_a_reward_that_no_record_can_hold_leaves_no_folder(corridor, tmp_path) -> None:
    with pytest.raises(RewardError, match=r"reward odd: a parameter is no JSON value .*complex") as caught:
        clearway.train(corridor, reward=UNTOLD, out=tmp_path / "run", **SMALL)
    assert "\n" not in str(caught.value) and not (tmp_path / "run").exists()


def test_a_reward_that_clips_needs_settings_that_do(corridor) -> None:
    clipped = replace(SHORTEST, clip=True)
    with pytest.raises(clearway.ClearwayError, match="reward shortest clips, and ppo's setting clip_rewards does not"):
        clearway.train(corridor, reward=clipped, **SMALL)
    assert clearway.train(corridor, reward=clipped, clip_rewards=True, **SMALL).record.reward == clipped


def test_targets_without_names_are_for_one_scene(corridor) -> None:
    with pytest.raises(ArgumentError, match="Name the scene of each"):
        clearway.train([corridor, grid_scene(1, feature_count=FEATURES)], [1, 2], **SMALL)


def test_settings_of_a_class_that_no_run_could_be_read_with_are_refused_before_training(corridor, tmp_path) -> None:
    class Mine(clearway.PPO):
        algorithm = "mine"

    with pytest.raises(clearway.ClearwayError, match="algorithm=Mine: its runs could not be read again"):
        clearway.train(corridor, algorithm=Mine(), out=tmp_path / "run", **SMALL)
    assert not (tmp_path / "run").exists()
