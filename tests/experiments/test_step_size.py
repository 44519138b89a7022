"""Both rewards at several step sizes."""

from dataclasses import replace
from pathlib import Path

import pytest

from clearway.experiments import convergence, step_size
from clearway.experiments.correction import corrected
from clearway.experiments.groups import Group
from clearway.experiments.reproduce import planned
from clearway.experiments.setting import Setting
from clearway.experiments.step_size import ALL, AS_IT_IS, LARGER, StepSize
from clearway.learn.presets import DEFAULT, PAPER_A2C
from clearway.learn.q_learning import QLearning
from helpers.small_setting import small_setting


def test_a_step_size_changes_rates_and_whitening_alone() -> None:
    assert AS_IT_IS.of(PAPER_A2C) == PAPER_A2C
    assert StepSize(1.0, whitened=True).of(DEFAULT) == DEFAULT
    larger = StepSize(4.0, whitened=True).of(DEFAULT)
    assert (larger.lr_start, larger.lr_end) == (4 * DEFAULT.lr_start, 4 * DEFAULT.lr_end)
    raw = StepSize(0.5, whitened=False).of(DEFAULT)
    assert not raw.whiten_features and not raw.centre_features
    changed = {"lr_start": DEFAULT.lr_start, "lr_end": DEFAULT.lr_end}
    assert replace(larger, **changed) == DEFAULT
    assert replace(raw, **changed, whiten_features=True, centre_features=True) == DEFAULT


def test_rates_are_half_once_twice_and_four_times_the_published_one() -> None:
    rates = sorted({step.of(PAPER_A2C).lr_start for step in ALL})
    assert rates == pytest.approx([3.5e-4, 7e-4, 1.4e-3, 2.8e-3])
    assert len(ALL) == len(set(ALL)) == 8


def test_every_step_size_is_trained_under_both_rewards(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    whole = replace(setting.budget, whole_grid=True)
    learners = {**setting.learners, "q": QLearning()}  # one whitens as it is, one has no such steps
    own = replace(setting, learners=learners, budget=whole)
    runs = [job.run for job in planned(own, [step_size.NAME])]
    assert len({run.name for run in runs}) == len(runs) == 8 * 2 * 2
    assert {run.learner.algorithm for run in runs} == {"a2c"}
    table1 = {job.run.name for job in planned(own, ["table1"])}
    assert len(table1 & {run.name for run in runs}) == 2 * 2  # the learner as it is


def test_a_smoke_run_trains_what_single_claims_are_of(tmp_path: Path) -> None:
    runs = [job.run for job in planned(small_setting(tmp_path), [step_size.NAME])]
    assert len(runs) == (1 + len(LARGER)) * 2 * 2


def test_learners_without_steps_give_an_empty_section(tmp_path: Path) -> None:
    setting = replace(small_setting(tmp_path), learners={"q": QLearning()})
    section = step_size.section(setting)
    assert not (section.tables or section.claims or step_size.jobs(setting))


@pytest.fixture
def settled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Setting:
    """Five seeds; zones halve the frames at every step size, four times the rate halves them too."""
    setting = small_setting(tmp_path, seeds=5)

    def frames(out: Path, group: Group, mark: float) -> dict[int, tuple[float, bool]]:
        learner = group.runs[0].learner
        base = 1000.0 / (2 if learner.lr_start > 2.5e-3 else 1) / (2 if group.agent == "collision-aware" else 1)
        return {run.seed: (base + run.seed, True) for run in group.runs}

    for module in (step_size, convergence):
        monkeypatch.setattr(module, "settled_by_seed", frames)
    return replace(setting, learners={"paper": PAPER_A2C}, budget=replace(setting.budget, whole_grid=True))


def test_seeds_are_not_mixed_where_a_run_is_missing(settled: Setting, monkeypatch: pytest.MonkeyPatch) -> None:
    def lacking(out: Path, group: Group, mark: float) -> dict[int, tuple[float, bool]]:
        found = {run.seed: (1000.0 * run.seed, True) for run in group.runs}
        if group.runs[0].learner.lr_start > 2.5e-3:
            del found[0]
        else:
            found[3] = (float(PAPER_A2C.frames), False)
        return found

    monkeypatch.setattr(step_size, "settled_by_seed", lacking)
    arms = [group for group in step_size._groups(settled) if group.agent == "shortest"]
    together = step_size._together(settled.out, arms, mark=1.0)
    assert together.shape == (4, 8)
    assert together[[0, 1, 3]].tolist() == [[1000.0 * seed] * 8 for seed in (1, 2, 4)]
    assert sorted(set(together[2])) == [3000.0, PAPER_A2C.frames]


def test_claims_are_six_and_each_compares_what_it_says(settled: Setting) -> None:
    claims = list(step_size._claims(settled, step_size._groups(settled)))
    told = {claim.text.removeprefix("paper: "): claim for claim in claims}
    assert len(told) == 6
    means = {
        text: tuple(round(claim.numbers[name].value) for name in ("first", "second")) for text, claim in told.items()
    }
    sooner = "collision-aware settles sooner than shortest"
    assert means == {
        f"{sooner}, mean of all step sizes": (440, 877),
        f"{sooner}, 4 x rate, features as they are": (252, 502),
        f"{sooner}, 1 x rate, whitened": (502, 1002),
        f"{sooner}, 4 x rate, whitened": (252, 502),
        "shortest with 4 x rate, features as they are, settles sooner than collision-aware with 1 x rate, features as "
        "they are": (502, 502),
        "shortest with 1 x rate, whitened, settles sooner than collision-aware with 1 x rate, features as they are": (
            1002,
            502,
        ),
    }
    section = corrected(replace(step_size.section(settled), claims=tuple(claims)))
    verdicts = [claim.verdict for claim in section.claims]
    assert verdicts == ["holds"] * 4 + ["undecided", "does not hold"]  # six claims leave five seeds room to decide
