"""Rewards of whoever asks, each against the first of them."""

import json
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.errors import ArgumentError, RunError
from clearway.evaluation.metrics import METRIC_NAMES
from clearway.experiments import reproduce, rewards
from clearway.experiments.correction import corrected
from clearway.experiments.groups import Group, Scores
from clearway.experiments.job import episodes_of
from clearway.experiments.reproduce import ReproduceRequest, planned
from clearway.experiments.request_file import REQUEST_FILE, keep_request, read_request, with_earlier
from clearway.experiments.section import Claim
from clearway.experiments.setting import DEFAULT_REWARDS, Setting, named_rewards, prepare
from clearway.reward import BUMP, CLEARANCE, SHORTEST, RewardError
from helpers.own_terms import imported
from helpers.report_tables import by_heading
from helpers.small_setting import do_here, small_setting


@pytest.fixture
def setting(tmp_path: Path) -> Setting:
    """One learner, five seeds, three rewards."""
    setting = small_setting(tmp_path, seeds=5)
    return replace(setting, learners={"paper": setting.learners["paper"]}, rewards=(BUMP, CLEARANCE, SHORTEST))


def test_figures_are_those_of_the_rewards_own_agents(setting: Setting) -> None:
    own = replace(setting, seeds=(0, 1), rewards=(CLEARANCE, BUMP))
    jobs = planned(own, [rewards.NAME])
    agents = [job for job in jobs if job.run.reward in own.rewards]
    assert [job.run.reward for job in agents] == [CLEARANCE] * 2 + [BUMP] * 2
    do_here(own.out, jobs, threads=1)
    section = rewards.section(own)
    rows = {row["agent"]: row for row in by_heading(section.tables[0]) if row["figure"] == "collisions"}
    for name in ("clearance", "bump"):
        found = [episodes_of(own.out, job.run, job.trials[0]) for job in agents if job.run.reward.name == name]
        by_target = [[each.collisions[each.target == target].mean() for target in range(5)] for each in found]
        means = [(np.mean(run[:3]) + np.mean(run[3:])) / 2 for run in by_target]  # scene by scene
        assert rows[name]["average"] == pytest.approx(np.mean(means))
    assert "judged against the first, clearance" in section.text
    assert [row["agent"] for row in by_heading(section.tables[-1])] == ["clearance", "bump"]


def test_table_1_s_rewards_are_compared_where_none_are_named(setting: Setting) -> None:
    request = asked(setting.out, "rewards")
    assert request.rewards is None and list(request.compared) == ["shortest", "bump", "collision-aware"]
    small = small_setting(setting.out, seeds=1)
    assert {job.run.reward.name for job in rewards.jobs(small)} == {*request.compared}


@pytest.fixture
def judged(setting: Setting, monkeypatch: pytest.MonkeyPatch) -> Callable[..., dict[str, Claim]]:
    """The claims where figures rise from reward to reward, in the order that the setting names them."""

    def claims(arrives: float) -> dict[str, Claim]:
        def scores(group: Group, out: Path, count: int) -> Scores:
            place = ("bump", "clearance", "shortest").index(group.agent)
            values = np.ones((5, count, len(METRIC_NAMES)))
            apart = 0.001 * np.arange(5)[:, None]
            values[:, :, METRIC_NAMES.index("collisions")] = (0.2, 0.1, 0.3)[place] + apart
            values[:, :, METRIC_NAMES.index("steps")] = (10.0, 10.1, 12.0)[place] + apart
            values[:, :, METRIC_NAMES.index("success")] = arrives if group.agent == "clearance" else 1.0
            return Scores(tuple(range(5)), values)

        def frames(out: Path, group: Group, mark: float) -> tuple[np.ndarray, int]:
            return (100.0 if group.agent == "bump" else 90.0) + np.arange(5.0)[:, None], 5

        monkeypatch.setattr(Group, "scores", scores)
        monkeypatch.setattr(rewards, "frames_until_settled", frames)
        return {claim.text: claim for claim in corrected(rewards.section(setting)).claims}

    return claims


def test_each_reward_is_judged_against_the_first(judged: Callable[..., dict[str, Claim]]) -> None:
    claims = judged(1.0)
    assert {text.removeprefix("paper: "): claim.verdict for text, claim in claims.items()} == {
        "clearance, fewer collisions than bump": "holds",
        "clearance, no more steps than bump": "holds",  # within 2 %
        "clearance, settles sooner than bump": "holds",
        "shortest, fewer collisions than bump": "does not hold",
        "shortest, no more steps than bump": "does not hold",
        "shortest, settles sooner than bump": "holds",
    }
    assert all(claim.further for claim in claims.values())


def test_agents_that_arrive_less_often_win_nothing(judged: Callable[..., dict[str, Claim]]) -> None:
    found = judged(0.9)
    assert found["paper: clearance, fewer collisions than bump"].verdict == "undecided"


def test_rewards_of_one_s_own_are_asked_for_by_name(setting: Setting, tmp_path: Path, monkeypatch) -> None:
    module = imported(tmp_path / "turning.py", monkeypatch)
    given = {"encoder": "auto", "learners": ["paper"], "dumps": [scene.path for scene in setting.files]}
    own = prepare(tmp_path, setting.budget, rewards=["shortest", "own_turning:REWARD"], **given)
    assert own.rewards == (SHORTEST, module.REWARD)
    with pytest.raises(RewardError, match="rewards bump, clearance_of_package, bump2: two are called alike") as refusal:
        monkeypatch.setattr(
            "clearway.experiments.setting.reward_named", lambda name: CLEARANCE if name != "bump" else BUMP
        )
        prepare(tmp_path, setting.budget, rewards=["bump", "clearance_of_package", "bump2"], **given)
    assert "Rename one" in str(refusal.value)


@pytest.mark.parametrize(
    ("names", "asked", "said"),
    [
        (["table1"], ["shortest", "bump"], "those of the experiment rewards. Name it, too, or leave them out"),
        (["table1"], list(DEFAULT_REWARDS), "those of the experiment rewards. Name it, too, or leave them out"),
        (["table1", "table1"], None, r"names=\['table1', 'table1'\]: expected each once"),
        (["rewards"], ["bump"], r"rewards=\['bump'\]: expected two or more, each once"),
        (["rewards"], ["bump", "shortest", "bump"], "expected two or more, each once"),
        (["rewards"], "bump", "rewards='bump': expected a list"),
        (["rewards"], ["bump", 3], "rewards: holds 3, expected texts"),
        (["rewards"], [], "expected two or more, each once"),
    ],
)
def test_a_request_that_compares_nothing_is_refused(names, asked, said, tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match=said):
        ReproduceRequest(names, tmp_path, "smoke", rewards=asked)


@pytest.mark.parametrize("name", ["cost 1/2", "../out", "two\nlines", "a" * 300])
def test_a_name_that_is_no_folder_s_is_refused(name: str, monkeypatch) -> None:
    odd = replace(SHORTEST, name=name)
    monkeypatch.setattr("clearway.experiments.setting.reward_named", lambda asked: odd if asked == "odd" else BUMP)
    with pytest.raises(RewardError, match="its name is part of folders' names"):
        named_rewards(["bump", "odd"])


def asked(out: Path, *names: str, rewards: tuple[str, ...] | None = None) -> ReproduceRequest:
    return ReproduceRequest(names, out, "smoke", rewards=rewards)


def test_other_experiments_do_not_depend_on_the_rewards_asked_for(tmp_path: Path) -> None:
    keep_request(asked(tmp_path, "rewards", rewards=("bump", "shortest")))
    both = with_earlier(asked(tmp_path, "table3"))
    assert list(both.names) == ["table3", "rewards"] and list(both.rewards) == ["bump", "shortest"]
    same = with_earlier(asked(tmp_path, "fig3", "rewards", rewards=("bump", "shortest")))
    assert list(same.names) == ["fig3", "rewards"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        keep_request(asked(tmp_path, "table3"))
    other = asked(tmp_path, "rewards", rewards=("shortest", "bump"))
    assert with_earlier(other) == other
    with pytest.warns(UserWarning, match="held a reproduction of table3, rewards, seeds 0 to 1; this one"):
        keep_request(other)


@pytest.mark.parametrize("again", [None, DEFAULT_REWARDS])
def test_a_kept_request_for_the_default_rewards_asks_the_same_again(again, tmp_path: Path) -> None:
    keep_request(asked(tmp_path, "rewards"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        keep_request(asked(tmp_path, "fig3", "rewards", rewards=again))
    assert set(read_request(tmp_path).names) == {"fig3", "rewards"}


@pytest.mark.parametrize("kept", [[], list(DEFAULT_REWARDS)])
def test_a_request_that_was_kept_by_an_older_version_is_gone_on_with(kept: list[str], tmp_path: Path) -> None:
    keep_request(asked(tmp_path, "table3"))
    path = tmp_path / REQUEST_FILE
    path.write_text(json.dumps(json.loads(path.read_text()) | {"rewards": kept}))
    assert list(with_earlier(asked(tmp_path, "fig3")).names) == ["fig3", "table3"]


def test_experiments_that_were_kept_twice_are_reported_once(tmp_path: Path) -> None:
    keep_request(asked(tmp_path, "table3"))
    path = tmp_path / REQUEST_FILE
    path.write_text(json.dumps(json.loads(path.read_text()) | {"names": ["table3", "fig3", "table3"]}))
    assert read_request(tmp_path).names == ["table3", "fig3"]


@pytest.mark.parametrize("edit", [{"new_field": 1}, {"changes": ["gone=3"]}])
def test_who_replaces_a_request_that_cannot_be_read_is_told(edit: dict[str, object], tmp_path: Path) -> None:
    keep_request(asked(tmp_path, "table3"))
    path = tmp_path / REQUEST_FILE
    path.write_text(json.dumps(json.loads(path.read_text()) | edit))
    with pytest.warns(
        UserWarning, match=r"held a reproduction that cannot be gone on with \(.*(new_field|gone).* stay"
    ):
        keep_request(asked(tmp_path, "fig3"))
    assert read_request(tmp_path).names == ["fig3"]


def test_a_reward_that_a_learner_cannot_pay_is_refused_before_it_is_kept(setting, tmp_path: Path, monkeypatch) -> None:
    clipped = replace(SHORTEST, name="clipped", clip=True)
    named = {"clipped": clipped, "bump": BUMP}
    monkeypatch.setattr("clearway.experiments.setting.reward_named", named.get)
    request = replace(asked(tmp_path, "rewards", rewards=("bump", "clipped")), learners=["default"])
    with pytest.raises(RunError, match="reward clipped clips, and ppo's setting clip_rewards does not"):
        reproduce.reproduce(replace(request, dumps=[scene.path for scene in setting.files]))
    assert not (tmp_path / REQUEST_FILE).exists() and not (tmp_path / "runs").exists()


def test_a_report_gives_the_remedy_of_its_fault(setting: Setting, tmp_path: Path, monkeypatch) -> None:
    alike = replace(asked(tmp_path, "rewards", rewards=("bump", "bump2")), learners=["paper"])
    keep_request(replace(alike, dumps=[scene.path for scene in setting.files]))
    monkeypatch.setattr("clearway.experiments.reproduce.named_rewards", lambda names: named_rewards(["bump", "bump"]))
    with pytest.raises(RunError, match=r"two are called alike, of bump. Rename one$"):
        reproduce.gather(tmp_path)


def test_a_report_tells_where_a_reward_cannot_be_imported(setting: Setting, tmp_path: Path) -> None:
    lost = asked(tmp_path, "rewards", rewards=("shortest", "nowhere:mine"))
    lost = replace(lost, dumps=[scene.path for scene in setting.files], learners=["paper"])
    keep_request(lost)
    with pytest.raises(RunError, match=r"json: reward=nowhere:mine: .*Run the command in the folder where"):
        reproduce.gather(tmp_path)
    keep_request(replace(lost, names=("zone-time", "rewards")))
    with pytest.warns(UserWarning, match=r"nowhere:mine.*The report leaves the experiment rewards out"):
        found = reproduce.gather(tmp_path)
    assert [section.name for section in found.sections] == ["zone-time"]
