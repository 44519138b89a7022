"""Runs that earlier versions recorded: `recorded/run-1-*.json`, each written by the clearway of that time."""

import json
import signal
import warnings
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from clearway.errors import RunError
from clearway.learn import train
from clearway.learn.a2c import A2C
from clearway.learn.a3c.config import A3C
from clearway.learn.bc import BC
from clearway.learn.checkpoint import newest_checkpoint, read_network
from clearway.learn.learner import Learner
from clearway.learn.load import load_agent, run_world
from clearway.learn.old_runs import with_later, without_later
from clearway.learn.ppo import PPO
from clearway.learn.presets import DEFAULT, PAPER_A2C, PAPER_A3C
from clearway.learn.run_folder import RunFolder
from clearway.learn.run_record import record_of
from clearway.learn.trainer import Trainer
from clearway.reward import COLLISION_AWARE
from helpers.small_runs import equal_bits, small_learner, small_request, small_scenes

RECORDED = Path(__file__).parent / "recorded"
SETTINGS_THEN = 40


def recorded(algorithm: str) -> dict:
    """The run.json that was recorded of an algorithm."""
    return json.loads((RECORDED / f"run-1-{algorithm}.json").read_text())


@pytest.mark.parametrize(
    ("algorithm", "preset", "seed"), [("ppo", DEFAULT, 3), ("a2c", PAPER_A2C, 5), ("a3c", PAPER_A3C, 5)]
)
def test_a_recorded_run_has_the_algorithm_s_own_settings(
    algorithm: str, preset: Learner, seed: int, tmp_path: Path
) -> None:
    content = recorded(algorithm)
    assert (content["format_version"], len(content["learner"])) == (1, SETTINGS_THEN)
    (tmp_path / "run.json").write_text(json.dumps(content))
    record = RunFolder(tmp_path).read_record()
    assert record.learner == small_learner(preset, frames=2400)
    then = without_later(record.learner)
    assert {name: content["learner"][name] for name in then} == then
    assert set(asdict(record.learner)) - set(then) <= {"goals", "sent_gradients", "episode_targets", "lr_warm_up"}
    now = record_of(small_request(learner=record.learner, seed=seed))
    assert record.same_experiment(now)


def test_settings_that_came_later_do_by_default_what_was_done_before() -> None:
    """Names of planned runs and records of old ones rest on it: another default is another experiment."""
    synchronous = {"goals": "given", "sent_gradients": "float32", "episode_targets": "drawn", "lr_warm_up": 0}
    assert with_later(PPO, {}) == with_later(A2C, {}) == synchronous
    assert with_later(A3C, {}) == {"episode_targets": "kept", "lr_warm_up": 0}
    assert with_later(A3C, {"lr_warm_up": 5, "envs": 7}) == {"episode_targets": "kept", "lr_warm_up": 5, "envs": 7}
    changed = replace(PAPER_A3C, episode_targets="drawn")
    assert set(without_later(changed)) - set(without_later(PAPER_A3C)) == {"episode_targets"}


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["ppo", "a2c"])
def test_a_run_begun_then_goes_on_now_to_the_same_bits(
    algorithm: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = recorded(algorithm)
    (tmp_path / "run.json").write_text(json.dumps(content))
    record = RunFolder(tmp_path).read_record()
    request = small_request(learner=record.learner, seed=record.seed)
    whole = train.train(request, tmp_path / "whole")
    update = Trainer.update

    def interrupted(trainer: Trainer) -> dict[str, float]:
        if trainer.updates == 10:
            signal.raise_signal(signal.SIGINT)
        return update(trainer)

    with monkeypatch.context() as patch:
        patch.setattr(Trainer, "update", interrupted)
        with pytest.raises(KeyboardInterrupt):
            train.train(request, tmp_path / "parts")
    (tmp_path / "parts" / "run.json").write_text(json.dumps(content))
    agent = load_agent(tmp_path / "parts")
    assert agent.frames == 880
    agent.on_poses(run_world(agent.record, small_scenes()))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*goes on with")  # the recorded machine may be another
        parts = train.train(request, tmp_path / "parts", resume=True)
    assert equal_bits(*[read_network(newest_checkpoint(folder.checkpoints)) for folder in (whole, parts)])


@pytest.mark.parametrize("clips", [("learner",), ("reward",), ("learner", "reward"), ()])
def test_either_of_two_switches_clipped_where_a_run_recorded_both(clips: tuple[str, ...], tmp_path: Path) -> None:
    learner = small_learner(clip_rewards=bool(clips))
    now = record_of(small_request(learner=learner))
    content = {"format_version": 2, **json.loads(json.dumps(now.to_json()))}
    content["learner"]["clip_rewards"], content["reward"]["clip"] = "learner" in clips, "reward" in clips
    (tmp_path / "run.json").write_text(json.dumps(content))
    record = RunFolder(tmp_path).read_record()
    assert (record.learner.clip_rewards, record.reward.clip) == (bool(clips), bool(clips))
    assert record.same_experiment(now)


def test_a_run_of_an_algorithm_without_the_setting_keeps_its_reward_s_clipping(tmp_path: Path) -> None:
    for clip in (False, True):
        request = small_request(learner=small_learner(BC()), reward=replace(COLLISION_AWARE, clip=clip))
        RunFolder(tmp_path).write_record(record_of(request))
        assert RunFolder(tmp_path).read_record().reward.clip == clip


def test_what_no_algorithm_had_is_refused(tmp_path: Path) -> None:
    content = recorded("a3c")
    for change, message in (({"magic": 1}, "magic"), ({"algorithm": "dqn"}, "algorithm 'dqn'")):
        (tmp_path / "run.json").write_text(json.dumps(content | {"learner": content["learner"] | change}))
        with pytest.raises(RunError, match=message):
            RunFolder(tmp_path).read_record()
    del content["learner"]["clip_norm"]
    (tmp_path / "run.json").write_text(json.dumps(content))
    with pytest.raises(RunError, match="clip_norm"):
        RunFolder(tmp_path).read_record()
