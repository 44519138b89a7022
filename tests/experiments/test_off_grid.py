"""Agents in the rooms themselves: what is kept of their episodes, and what is claimed of it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.agents.by_pose import RandomWalk
from clearway.agents.on_learnt_map import MOST_A_POSE, MapPlanner, frames_of, nearest_pictures, seen_by_walkers
from clearway.errors import RunError
from clearway.evaluation.episodes import run_episodes
from clearway.evaluation.metrics import columns, quotients
from clearway.experiments import live_trial, off_grid
from clearway.experiments.correction import corrected
from clearway.experiments.job import do, is_done, trial_path, unfinished
from clearway.experiments.live_trial import COLUMNS, FIGURES, nearest_poses, read_live
from clearway.experiments.plan import Job, LiveTrial
from clearway.experiments.reproduce import ReproduceRequest, _gathered
from clearway.experiments.section import Claim
from clearway.experiments.setting import Setting
from clearway.learn.load import load_network
from clearway.live.conditions import Condition, Perturbations
from clearway.live.episodes import LiveProtocol
from clearway.live.live_room import LiveRoom
from clearway.live.results import METRICS
from clearway.live.walks import stages, walk_setting
from clearway.perception import depth_grid
from clearway.reward import COLLISION_AWARE
from clearway.scenes.scene import EncoderRecord
from clearway.zones import Zone, scene_zones
from helpers.live_setting import live_setting
from helpers.report_tables import by_heading
from helpers.small_setting import small_setting

SETTINGS = (Condition("none", Perturbations()), Condition("turn ± 5°", Perturbations(angle_noise=5.0)))
IN_ROOM = {
    "success": "success",
    "contacts": "contacts",
    "least clearance": "min_clearance_m",
    "within 10 cm": "share_within_10cm",
    "within 30 cm": "share_within_30cm",
}


@pytest.fixture
def setting(tmp_path: Path, live: LiveRoom, monkeypatch: pytest.MonkeyPatch) -> Setting:
    return live_setting(tmp_path, live, monkeypatch)


@pytest.mark.slow
def test_a_trial_s_file_says_what_live_evaluation_says(setting: Setting) -> None:
    run = setting.runs(setting.learners["paper"], COLLISION_AWARE)[0]
    trial = LiveTrial(SETTINGS, episodes_per_target=2, step_limit=4, seed=3)
    job = Job(run, (trial,))
    do(setting.out, job, threads=1)
    path = trial_path(setting.out, run, trial)
    assert is_done(setting.out, job)
    found = read_live(path, SETTINGS, 2)
    assert found.shape == (2, 2, len(FIGURES))
    agent = load_network(path.parents[1])
    with stages(setting.scenes, agent.record.targets, "pose") as places:
        for number, one in enumerate(SETTINGS):
            ((table,),) = walk_setting(places, {"a": agent}, one, LiveProtocol(2, 4, 3, "sampled")).tables.values()
            own = quotients(*columns(table, METRICS), table.target, 2)
            for figure, name in IN_ROOM.items():
                expected = own[:, list(METRICS).index(name)]
                np.testing.assert_allclose(found[number, :, FIGURES.index(figure)], expected, atol=1e-5)
            zones = scene_zones(setting.scenes[0])
            ends = [zones[nearest_poses(places[0].live.scene, walk)[1:]] == Zone.COLLISION for walk in table.walks]
            share = [np.concatenate(ends[2 * target : 2 * target + 2]).mean() for target in range(2)]
            np.testing.assert_allclose(found[number, :, -1], share, atol=1e-6)
    assert (found[0] != found[1]).any()


@pytest.mark.parametrize("walker", ["nearest picture", "random walk"])
def test_who_needs_no_training_walks_beside_a_run_s_agent(
    setting: Setting, monkeypatch: pytest.MonkeyPatch, walker: str
) -> None:
    def never(folder: Path) -> None:
        raise AssertionError(f"{folder}: its agent was loaded")

    monkeypatch.setattr(live_trial, "load_network", never)
    run = setting.runs(setting.learners["paper"], COLLISION_AWARE)[0]
    trials = [LiveTrial(SETTINGS, 2, 40, seed, walker) for seed in (3, 3, 4)]
    paths = [setting.out / f"{number}.json" for number in range(3)]
    for path, trial in zip(paths, trials, strict=True):
        live_trial.walk_live(path, setting.out / "run", setting.scenes, run, trial)
    figures, again, others = (read_live(path, SETTINGS, 2) for path in paths)
    np.testing.assert_array_equal(figures, again)
    assert (figures != others).any()
    world = setting.world()
    seen = seen_by_walkers(world, frames_of(world, MOST_A_POSE), 3)
    by_pose = (
        RandomWalk() if walker == "random walk" else MapPlanner(seen, nearest_pictures(seen, world.features.numpy()))
    )
    on_grid = run_episodes(world, by_pose, episodes_per_target=2, step_limit=40, seed=3)
    assert 0 < on_grid.reached.sum() < 4  # some poses of this room look the same
    success = figures[0, :, FIGURES.index("success")]
    np.testing.assert_array_equal(success, on_grid.reached.reshape(2, 2).mean(1))  # nothing is changed in the room
    assert json.loads(paths[0].read_text())["about"]["walker"] == walker
    at_target = scene_zones(setting.scenes[0])[np.array(setting.targets[0])][on_grid.target] == Zone.COLLISION
    in_zone = on_grid.zone_steps[:, Zone.COLLISION] + (on_grid.reached & at_target)  # a target is no zone of the grid
    share = in_zone.reshape(2, 2).sum(1) / on_grid.steps.reshape(2, 2).sum(1)
    np.testing.assert_allclose(figures[0, :, FIGURES.index("in the collision zone")], share, atol=1e-6)


def test_trials_of_trained_agents_keep_their_names() -> None:
    """As their files are called in the record that is published."""
    trial = LiveTrial((Condition("none", Perturbations()),), 2, 4, 3)
    assert trial.name == "live-1s-18903049aa"
    assert len({trial.name, *(replace(trial, walker=own).name for own in ("nearest picture", "random walk"))}) == 3


def test_tables_hold_who_needs_no_training(setting: Setting) -> None:
    walked(setting, lambda reward, seed: {"contacts": 1.0 + seed})
    (table,) = off_grid.section(setting).tables
    rows = by_heading(table)
    own = [row for row in rows if row["learner"] in ("nearest picture", "walked")]
    assert {row["agent"] for row in own} == {"4,700 frames", "random walk"}
    assert all((row["seeds"], row["contacts"]) == (5, 3.0) for row in own)
    assert len(own) == 2 * (1 + len(off_grid.settings(setting)))
    for job in off_grid.jobs(setting):
        if job.trials[0].walker == "random walk":
            trial_path(setting.out, job.run, job.trials[0]).unlink()
    assert len(unfinished(setting.out, off_grid.jobs(setting))) == 5


def test_a_damaged_file_is_named(tmp_path: Path) -> None:
    path = tmp_path / "live.json"
    path.write_text('{"format_version": 1, "settings": {"none": [{}]}}')
    with pytest.raises(RunError, match=r"live.json: not readable .* Remove it"):
        read_live(path, SETTINGS, 2)


def test_the_nearest_pose_is_one_of_the_nearest_place(live: LiveRoom) -> None:
    scene = live.scene
    places = np.column_stack([scene.locations_m, scene.headings_deg])
    away = places + np.array([0.2, -0.2, 40.0])
    for walk in (places, away, away + np.array([0, 0, 360.0]), away - np.array([0, 0, 720.0])):
        np.testing.assert_array_equal(nearest_poses(scene, walk), np.arange(len(places)))


def test_scenes_that_are_no_rooms_are_left_out(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    assert not off_grid.jobs(setting)
    assert "there is no room to walk in" in off_grid.section(setting).text


@pytest.mark.parametrize(
    ("encoder", "why"), [(None, "no features by a known encoder"), (depth_grid.find_record(), "sees depth")]
)
def test_rooms_whose_pictures_cannot_be_encoded_again_are_left_out(
    setting: Setting, encoder: EncoderRecord | None, why: str
) -> None:
    other = replace(setting, scenes=tuple(replace(scene, encoder=encoder) for scene in setting.scenes))
    assert off_grid.jobs(setting)
    assert not off_grid.jobs(other)
    assert why in off_grid.section(other).text


def walked(setting: Setting, kept: Callable[[str, int], dict[str, float]]) -> dict[str, Claim]:
    """What is claimed where every episode of a reward's seed has these columns."""
    labels = [one.label for one in off_grid.settings(setting)]
    for job in off_grid.jobs(setting):
        (trial,) = job.trials
        usual = dict.fromkeys(COLUMNS, 1.0) | {"steps": 20.0} | kept(job.run.reward.name, job.run.seed)
        scene = {name: [value] * 2 * len(setting.targets[0]) for name, value in usual.items()}
        path = trial_path(setting.out, job.run, trial)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps({"format_version": 1, "settings": {label: [scene] for label in labels}}))
    section = corrected(off_grid.section(setting))
    return {claim.text: claim for claim in section.claims}


def test_what_was_walked_is_told_where_no_more_could_be(setting: Setting) -> None:
    """As of a record, on a machine that lacks the encoder."""
    walked(setting, lambda reward, seed: {"contacts": 1.0 + seed})
    gone = replace(setting, scenes=tuple(replace(scene, encoder=None) for scene in setting.scenes))
    there, elsewhere = (off_grid.section(own) for own in (setting, gone))
    assert off_grid.jobs(gone) == off_grid.jobs(setting)  # whose runs the report names
    assert elsewhere.tables == there.tables and elsewhere.claims == there.claims and elsewhere.tables
    assert not elsewhere.missing and elsewhere.text == there.text
    job, *others = off_grid.jobs(setting)
    trial_path(setting.out, job.run, job.trials[0]).unlink()
    assert off_grid.jobs(gone) == others
    lacking = off_grid.section(gone)
    assert lacking.missing == (job.run.name,)
    assert "No more can be walked here: scene walkable has no features by a known encoder" in lacking.text
    (told,) = _gathered(ReproduceRequest(["off-grid"], setting.out, "smoke"), gone).sections
    assert told.missing == (job.run.name,)  # though it is no job here


def test_fewer_contacts_of_five_seeds_are_told(setting: Setting) -> None:
    def kept(reward: str, seed: int) -> dict[str, float]:
        aware = reward == "collision-aware"
        return {"contacts": (1 if aware else 3) + 0.1 * seed, "close_s": (2 if aware else 1) + 0.1 * seed}

    claims = walked(setting, kept)
    assert len(claims) == 15
    assert claims["paper, touching: collision-aware, fewer contacts than shortest"].verdict == "holds"
    assert claims["paper, touching: collision-aware, fewer contacts than bump"].verdict == "holds"
    assert claims["paper, touching: clearance, fewer contacts than shortest"].verdict == "undecided"
    near = claims["paper, staying near: collision-aware, less time within 10 cm than shortest"]
    assert near.verdict == "does not hold"
    assert near.numbers["first"].value == pytest.approx(2.2 / 20)
    beside = claims["paper, staying near, bump: collision-aware, less time within 10 cm than bump"]
    assert beside.verdict == "does not hold" and "for 3 claims" in beside.evidence and "for 6 claims" in near.evidence


def test_who_arrives_less_often_is_not_told_better(setting: Setting) -> None:
    def kept(reward: str, seed: int) -> dict[str, float]:
        aware = reward == "collision-aware"
        return {"least_gap_m": (0.3 if aware else 0.1) + 0.01 * seed, "reached": 0.9 if aware else 1.0}

    claims = walked(setting, kept)
    claim = claims["paper, touching: collision-aware, a larger least clearance than shortest"]
    assert claim.verdict == "undecided"
    assert "compare different episodes" in claim.evidence
