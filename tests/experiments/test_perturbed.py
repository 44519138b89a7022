"""Perturbed pictures on the grid: what is planned and walked, and what is claimed of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.agents.agent import FEATURES
from clearway.agents.by_features import FeatureAgent
from clearway.agents.on_learnt_map import MOST_A_POSE, MapPlanner, frames_of, nearest_pictures, seen_by_walkers
from clearway.evaluation.episode_files import read_episodes, write_episodes
from clearway.evaluation.episodes import EpisodeTable, run_episodes
from clearway.experiments import expected_pictures, expected_time, expected_walks, grid_trial, perturbed
from clearway.experiments.correction import corrected
from clearway.experiments.job import do, run_folder, trial_path
from clearway.experiments.plan import Job, PerturbedPictures, SceneFile, Trial, merged
from clearway.experiments.section import Claim
from clearway.experiments.setting import Setting
from clearway.learn.load import load_network
from clearway.learn.presets import DEFAULT, PAPER_A2C, PAPER_A3C
from clearway.live.conditions import Perturbations
from clearway.live.live_room import MODEL_SOURCE, LiveRoom
from clearway.reward import COLLISION_AWARE
from clearway.scenes.digest import scene_digest
from clearway.scenes.scene import Provenance, Scene
from clearway.scenes.thor_v1 import read_scene, write_scene
from clearway.views.seen import made_in_training, seed_in_training, takes_seen
from clearway.world.world import make_world
from helpers.report_tables import by_heading
from helpers.small_runs import small_learner
from helpers.small_setting import BUDGET, FRAMES, small_setting

DARK = PerturbedPictures(Perturbations(light=0.5), takes=2)
FIRST, SECOND = (5, 40), (7, 12, 30)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Perturbations, int, int]]:
    """What takes were asked for: a scene's own pictures, darker by the light's strength, the later the more."""
    found = []

    def grid_takes(
        scenes: Sequence[Scene], wanted: Perturbations, *, takes: int, seed: int, workers: int | None, done
    ) -> Iterator:
        found.append((wanted, takes, seed))
        for scene in scenes:
            shades = 1 - wanted.light * np.arange(takes) / takes
            yield (scene.observations[:][:, None] * shades[:, None, None, None]).astype(np.uint8)

    monkeypatch.setattr("clearway.views.grid.grid_takes", grid_takes)
    return found


@pytest.fixture
def setting(tmp_path: Path, live: LiveRoom) -> Setting:
    """A small room of ours and its negative, five seeds of a learner that finishes in a blink."""
    scenes, files = [], []
    pictures = live.scene.observations
    for name, seen in (("walkable", pictures), ("again", 255 - pictures)):
        path = tmp_path / f"{name}.h5"
        write_scene(replace(live.scene, name=name, observations=seen), path)
        scenes.append(read_scene(path, name=name))
        files.append(SceneFile(name, path, scene_digest(scenes[-1])))
    return Setting(
        out=tmp_path,
        files=tuple(files),
        scenes=tuple(scenes),
        targets=(FIRST, SECOND),
        budget=replace(BUDGET, whole_grid=True),
        seeds=tuple(range(5)),
        learners={"paper": small_learner(PAPER_A2C, frames=FRAMES)},
    )


def own_job(setting: Setting, **changes) -> Job:
    """A run on perturbed pictures with a trial on others."""
    run = replace(setting.runs(setting.learners["paper"], COLLISION_AWARE)[2], perturbed=DARK)
    return Job(run, (replace(setting.trial(), seed=3, perturbed=DARK, **changes),))


def test_a_job_trains_on_perturbed_pictures_and_walks_on_others(setting: Setting, asked) -> None:
    job = own_job(setting)
    do(setting.out, job, threads=1)
    (trial,) = job.trials
    assert asked == [(DARK.perturbations, 2, seed_in_training(2)), (DARK.perturbations, 2, 3)]
    trained = load_network(run_folder(setting.out, job.run).path)
    assert trained.record.takes == made_in_training(DARK.perturbations, 2, 2)

    table, about = read_episodes(trial_path(setting.out, job.run, trial))
    assert about["targets"] == {"walkable": list(FIRST), "again": list(SECOND)} and "walker" not in about
    assert about["perturbed"] == {"perturbations": DARK.perturbations.to_json(), "takes": 2}
    on_own = run_episodes(
        setting.world(), trained.on_poses(setting.world()), episodes_per_target=3, step_limit=40, seed=3
    )
    for name in ("target", "start", "shortest_path_steps"):  # as of one walk through both scenes
        np.testing.assert_array_equal(getattr(table, name), getattr(on_own, name))
    takes = takes_seen(setting.scenes, DARK.perturbations, (FEATURES,), None, takes=2, seed=3)
    alone = run_episodes(
        make_world(setting.scenes[1:], {"again": list(SECOND)}),
        FeatureAgent(trained.in_scene(1)),
        takes=takes.of_scene(1),
        episodes_per_target=3,
        step_limit=40,
        seed=3,
    )
    second = table.target >= len(FIRST)
    for name in ("steps", "collisions", "reached"):
        np.testing.assert_array_equal(getattr(table, name)[second], getattr(alone, name))
    plain = replace(job, run=replace(job.run, perturbed=None))
    do(setting.out, plain, threads=1)
    weights = [load_network(run_folder(setting.out, one.run).path).network.state_dict() for one in (job, plain)]
    assert any((weights[0][name] != weights[1][name]).any() for name in weights[0])  # it has learnt from others


def test_of_a_trained_run_no_training_pictures_are_taken_again(setting: Setting, asked) -> None:
    job = own_job(setting)
    do(setting.out, replace(job, trials=()), threads=1)
    assert asked == [(DARK.perturbations, 2, seed_in_training(2))]
    on_own = replace(job.trials[0], perturbed=None)
    do(setting.out, replace(job, trials=(on_own,)), threads=1)
    assert len(asked) == 1 and trial_path(setting.out, job.run, on_own).exists()


def test_who_goes_by_the_nearest_picture_is_no_agent_of_the_run(setting: Setting, asked, monkeypatch) -> None:
    job = own_job(setting, walker="nearest picture")
    do(setting.out, replace(job, trials=()), threads=1)
    monkeypatch.setattr(grid_trial, "load_network", lambda *_: pytest.fail("loaded"))
    seeds, made = [], grid_trial.nearest_picture
    monkeypatch.setattr(grid_trial, "nearest_picture", lambda world, seed: seeds.append(seed) or made(world, seed))
    plain = replace(job.trials[0], perturbed=PerturbedPictures(Perturbations()))
    found = {}
    for trial in (*job.trials, plain):
        do(setting.out, replace(job, trials=(trial,)), threads=1)
        found[trial], about = read_episodes(trial_path(setting.out, job.run, trial))
        assert about["walker"] == "nearest picture"
    assert set(seeds) == {3}
    world = make_world(setting.scenes[:1], {"walkable": list(FIRST)})
    seen = seen_by_walkers(world, frames_of(world, MOST_A_POSE), 3)
    planner = MapPlanner(seen, nearest_pictures(seen, world.features.numpy()))
    as_it_was = run_episodes(world, planner, episodes_per_target=3, step_limit=40, seed=3)
    first = found[plain].target < len(FIRST)
    np.testing.assert_array_equal(found[plain].reached[first], as_it_was.reached)
    assert 0 < as_it_was.reached.sum() < len(as_it_was)  # some poses of this room look the same
    assert (found[plain].steps != found[job.trials[0]].steps).any()  # in the dark it takes others for them


def test_all_kinds_are_tried_on_all_that_is_seen(setting: Setting) -> None:
    jobs = merged(perturbed.jobs(setting))
    trained = [(job.run.reward.name, job.run.perturbed) for job in jobs if job.run.seed == 0]
    too = [(name, perturbed.EVERYTHING) for name in ("shortest", "bump", "collision-aware", "clearance")]
    assert sorted(trained, key=str) == sorted([*too, ("collision-aware", None)], key=str)
    assert len({job.run.name for job in jobs}) == 5 * 5
    for job in jobs:
        assert {trial.seed for trial in job.trials} == {job.run.seed}
        assert {trial.step_limit for trial in job.trials} == {40}  # the budget's
        own = [trial for trial in job.trials if trial.walker == "agent"]
        assert [trial.perturbed for trial in own] == list(perturbed.SEEN.values())
        beside = [trial.perturbed for trial in job.trials if trial.walker == "nearest picture"]
        is_first = (job.run.reward.name, job.run.perturbed) == trained[0]
        assert beside == (list(perturbed.SEEN.values())[1:] if is_first else [])
    smoke = merged(perturbed.jobs(replace(setting, budget=BUDGET)))
    assert len(smoke) == 5 * 3 and {len(job.trials) for job in smoke} == {2, 3}
    two = replace(setting, learners={**setting.learners, "default": small_learner(DEFAULT, frames=FRAMES)})
    assert len(merged(perturbed.jobs(two))) == 2 * 5 * 5


@pytest.mark.parametrize("walker", ["nearest picture", "random walk"])
def test_nobody_else_is_tried_on_own_pictures(walker: str) -> None:
    with pytest.raises(AssertionError):
        Trial(((1,),), walker=walker)


def test_what_cannot_be_asked_is_left_out(setting: Setting, tmp_path: Path) -> None:
    no_rooms = small_setting(tmp_path / "grids")
    of_a_model = tuple(replace(scene, made_by=Provenance(MODEL_SOURCE)) for scene in setting.scenes)
    bare = tuple(replace(scene, observations=None) for scene in setting.scenes)
    for other, why in (
        (no_rooms, "there is no room to walk in"),
        (replace(setting, scenes=of_a_model), "nothing can be moved in a MuJoCo model"),
        (replace(setting, scenes=bare), "has no pictures, so no rgb"),
        (replace(setting, learners={"paper-a3c": small_learner(PAPER_A3C)}), "No learner of paper-a3c learns from"),
    ):
        assert not perturbed.jobs(other)
        section = perturbed.section(other)
        assert not section.tables and not section.claims and why in section.text
    both = replace(setting, learners={**setting.learners, "paper-a3c": small_learner(PAPER_A3C)})
    assert [job.run.name for job in perturbed.jobs(both)] == [job.run.name for job in perturbed.jobs(setting)]
    assert "paper-a3c: learns from no perturbed pictures" in perturbed.section(both).text
    assert "is left out" not in perturbed.section(setting).text


def test_what_was_walked_is_told_where_no_more_could_be(setting: Setting) -> None:
    """As of a record, on a machine that lacks the encoder."""
    walked(setting, {}, {})
    gone = tuple(replace(scene, encoder=None) for scene in setting.scenes)
    there, elsewhere = (perturbed.section(replace(setting, scenes=own)) for own in (setting.scenes, gone))
    assert perturbed.jobs(replace(setting, scenes=gone)) == perturbed.jobs(setting)  # whose runs the report names
    assert elsewhere.tables == there.tables and elsewhere.claims == there.claims and elsewhere.tables
    assert not elsewhere.missing and elsewhere.text == there.text
    jobs = perturbed.jobs(setting)
    trial_path(setting.out, jobs[0].run, jobs[0].trials[0]).unlink()
    assert perturbed.jobs(replace(setting, scenes=gone)) == jobs[1:]
    lacking = perturbed.section(replace(setting, scenes=gone))
    assert lacking.missing == (jobs[0].run.name,)
    assert "No more can be walked here: scene walkable has no features by" in lacking.text


def test_episodes_of_another_experiment_are_not_its_own(setting: Setting) -> None:
    """Own pictures are seen elsewhere, too, by the same agents."""
    walked(setting, {}, {})
    gone = replace(setting, scenes=tuple(replace(scene, encoder=None) for scene in setting.scenes))
    for (seen, *_), jobs in perturbed._planned(setting).items():
        for job in jobs if seen != OWN else ():
            trial_path(setting.out, job.run, job.trials[0]).unlink()
    assert perturbed.section(gone).text.startswith("Nothing was walked. ")


def test_what_perturbed_pictures_take_is_told_beforehand(setting: Setting, asked, monkeypatch) -> None:
    monkeypatch.setattr(expected_time, "TRIED_S", 0.01)
    monkeypatch.setattr(expected_pictures, "picture_time", lambda *_: 0.5)
    monkeypatch.setattr(expected_walks, "walking_time", lambda *_: 0.0)
    tried, measure = [], expected_time.frames_per_second
    monkeypatch.setattr(
        expected_time, "frames_per_second", lambda run, n: tried.append(run.perturbed) or measure(run, n)
    )
    jobs = merged(perturbed.jobs(setting))
    told = expected_time.told_time(setting.out, jobs, jobs, 1, 1)
    taken = 3 * 5 * 4 * 2 * setting.scenes[0].state_count  # trained on, two seen; of five seeds, four takes, two scenes
    assert told.startswith("25 runs, 25 to be trained, 1 at a time: ")
    assert f"; {taken:,} perturbed pictures " in told
    assert tried == [perturbed.EVERYTHING, None] and not asked  # no picture is taken beforehand


@pytest.mark.parametrize("takes", [1, 4])
def test_training_on_perturbed_pictures_is_tried_on_as_many(setting: Setting, takes: int, monkeypatch) -> None:
    wanted = PerturbedPictures(Perturbations(light=0.5), takes)
    run = replace(setting.runs(setting.learners["paper"], COLLISION_AWARE)[0], perturbed=wanted)
    request = expected_time._request_without_pictures(run)
    for scene, given in zip(setting.scenes, request.takes, strict=True):
        np.testing.assert_array_equal(given, np.stack([np.asarray(scene.features)] * takes, axis=1))
    assert expected_time._request_without_pictures(replace(run, perturbed=None)).takes is None


def walked(setting: Setting, collisions: dict[str, int], steps: dict[str, int], lost: str = "") -> dict[str, Claim]:
    """What is claimed where episodes of a kind have these collisions and steps and its seed's, and `lost` is lost."""
    count = setting.world().target_count * setting.budget.episodes_per_target
    for (seen, _, agent, trained_on), jobs in perturbed._planned(setting).items():
        key = f"{agent}, {trained_on}, {seen}"
        for job in jobs:
            (trial,) = job.trials
            table = EpisodeTable(
                target=np.arange(setting.world().target_count).repeat(trial.episodes_per_target),
                start=np.zeros(count, np.int64),
                steps=np.full(count, steps.get(key, 10) + job.run.seed),
                collisions=np.full(count, collisions.get(key, 10) + job.run.seed),
                reached=np.full(count, key != lost),
                shortest_path_steps=np.full(count, 5),
                zone_steps=np.zeros((count, 3), np.int64),
                looped=np.zeros(count, bool),
            )
            path = trial_path(setting.out, job.run, trial)
            path.parent.mkdir(parents=True, exist_ok=True)
            write_episodes(path, table, {})
    return {claim.text: claim for claim in corrected(perturbed.section(setting)).claims}


AWARE = "collision-aware, perturbed pictures too"
ON_OWN = "collision-aware, own pictures alone"
ALL, OWN = "everything perturbed", "own pictures"


def test_claims_are_of_what_is_perturbed_and_of_what_was_trained_on(setting: Setting) -> None:
    claims = walked(
        setting,
        collisions={
            f"{AWARE}, {ALL}": 30,
            f"bump, perturbed pictures too, {ALL}": 50,
            f"clearance, perturbed pictures too, {ALL}": 30,
            f"shortest, perturbed pictures too, {ALL}": 20,
            f"{ON_OWN}, {ALL}": 90,
            f"{ON_OWN}, {OWN}": 1,
        },
        steps={f"{ON_OWN}, {ALL}": 30},
    )
    assert {text: claim.verdict for text, claim in claims.items()} == {
        "paper: everything perturbed, collision-aware, fewer collisions than shortest": "does not hold",
        "paper: everything perturbed, collision-aware, fewer collisions than bump": "holds",
        "paper: everything perturbed, clearance, fewer collisions than shortest": "does not hold",
        "paper: everything perturbed, collision-aware, fewer collisions if trained on perturbed pictures too "
        "than on own pictures alone": "holds",
        "paper: everything perturbed, collision-aware, higher SPL if trained on perturbed pictures too "
        "than on own pictures alone": "holds",
        "paper: own pictures, collision-aware, fewer collisions if trained on own pictures alone "
        "than on perturbed pictures too": "holds",
    }
    assert all(claim.further and "6 claims" in claim.evidence for claim in claims.values())
    (table,) = perturbed.section(setting).tables
    rows = {(row["seen on the way"], row["agent"], row["trained on"]): row for row in by_heading(table)}
    assert rows[ALL, "collision-aware", "own pictures alone"]["collisions"] == 92
    assert rows[OWN, "collision-aware", "own pictures alone"]["collisions"] == 3
    assert (OWN, "9,300 frames", None) not in rows and rows[ALL, "9,300 frames", None]["learner"] == "nearest picture"
    assert rows[None, "shortest path", None]["SPL"] == 1 > rows[None, "random walk", None]["SPL"] > 0
    smoke = perturbed.section(replace(setting, budget=BUDGET))
    assert len(smoke.claims) == 4 and len(smoke.tables[0].rows) < len(table.rows)


def test_who_arrives_less_often_is_not_told_better(setting: Setting) -> None:
    claims = walked(setting, collisions={f"{AWARE}, {ALL}": 1}, steps={}, lost=f"{AWARE}, {ALL}")
    claim = claims["paper: everything perturbed, collision-aware, fewer collisions than shortest"]
    assert claim.verdict == "undecided" and "compare different episodes" in claim.evidence


def test_names_tell_what_is_perturbed_and_keep_those_of_before(setting: Setting) -> None:
    (run, *_), trial = setting.runs(setting.learners["paper"], COLLISION_AWARE), Trial(((1, 2), (3,)))
    others = [PerturbedPictures(Perturbations(light=0.5), takes) for takes in (2, 3)]
    assert len({run.name, *(replace(run, perturbed=one).name for one in others)}) == 3
    assert len({run.kind, *(replace(run, perturbed=one).kind for one in others)}) == 3
    assert len({trial.name, *(replace(trial, perturbed=one).name for one in others)}) == 3
    assert replace(trial, perturbed=DARK, walker="nearest picture").name != replace(trial, perturbed=DARK).name
    assert trial.name == "end-3t-fb5f09c731"
