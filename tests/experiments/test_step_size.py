"""Both rewards at several step sizes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.experiments import step_size
from clearway.experiments.correction import corrected
from clearway.experiments.reproduce import planned
from clearway.experiments.setting import Setting
from clearway.experiments.step_size import ALL, PUBLISHED, StepSize
from clearway.learn.presets import DEFAULT, PAPER_A2C
from clearway.learn.q_learning import QLearning
from helpers.small_setting import small_setting


def test_a_step_size_changes_rates_and_whitening_alone() -> None:
    assert PUBLISHED.of(PAPER_A2C) == PAPER_A2C
    assert StepSize(1.0, whitened=True).of(DEFAULT) == DEFAULT
    larger = StepSize(4.0, whitened=True).of(DEFAULT)
    assert (larger.lr_start, larger.lr_end) == (4 * DEFAULT.lr_start, 4 * DEFAULT.lr_end)
    raw = StepSize(0.5, whitened=False).of(DEFAULT)
    assert not raw.whiten_features and not raw.centre_features
    changed = {"lr_start": DEFAULT.lr_start, "lr_end": DEFAULT.lr_end}
    assert replace(larger, **changed) == DEFAULT
    assert replace(raw, **changed, whiten_features=True, centre_features=True) == DEFAULT


def test_the_rates_are_those_that_the_audit_asks_for() -> None:
    rates = sorted({step.of(PAPER_A2C).lr_start for step in ALL})
    assert rates == pytest.approx([3.5e-4, 7e-4, 1.4e-3, 2.8e-3])
    assert len(ALL) == len(set(ALL)) == 8


def test_every_step_size_is_trained_under_both_rewards(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    own = replace(setting, learners={"paper": setting.learners["paper"], "q": QLearning()})  # it has no such steps
    runs = [job.run for job in planned(own, [step_size.NAME])]
    assert len({run.name for run in runs}) == len(runs) == 8 * 2 * 2
    assert {run.learner.algorithm for run in runs} == {"a2c"}
    table1 = {job.run.name for job in planned(own, ["table1"])}
    assert len(table1 & {run.name for run in runs}) == 2 * 2  # the learner as it is


def test_learners_without_steps_give_an_empty_section(tmp_path: Path) -> None:
    section = step_size.section(replace(small_setting(tmp_path), learners={"q": QLearning()}))
    assert not (section.tables or section.claims or section.missing)


@pytest.fixture
def settled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Setting:
    """Five seeds; zones halve the frames at every step size, four times the rate halves them too."""
    setting = small_setting(tmp_path, seeds=5)

    def frames(out: Path, group: object, mark: float) -> tuple[np.ndarray, int]:
        learner = group.runs[0].learner
        base = 1000.0 / (2 if learner.lr_start > 2.5e-3 else 1) / (2 if group.agent == "collision-aware" else 1)
        return base + np.arange(5.0)[:, None], 5

    monkeypatch.setattr(step_size, "frames_until_settled", frames)
    return replace(setting, learners={"paper": PAPER_A2C})


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
