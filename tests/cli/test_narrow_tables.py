"""What is printed fits a terminal of 80 columns, whole and rounded."""

import re
import shutil

import pytest

from clearway import progress

ELLIPSIS = "…"


@pytest.fixture
def narrow(clearway, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")

    def call(*words: object) -> list[str]:
        answer = clearway(*words)
        assert answer.code == 0, answer
        lines = [line.rstrip() for line in answer.out.splitlines()]
        assert max(map(len, lines)) <= 80
        assert ELLIPSIS not in answer.out
        return lines

    return call


@pytest.mark.slow
def test_evaluate_prints_three_rows_and_all_where_they_are_asked_for(narrow, trained):
    words = ("evaluate", trained.run, "--episodes", 3, "--step-limit", 200)
    lines = narrow(*words)
    table = lines[: next(number for number, line in enumerate(lines) if line.startswith("Encoder:"))]
    names = [line.split("  ")[0].strip() for line in table[3:] if line[1:2].isalpha()]
    assert len([name for name in names if name.startswith(("random", "shortest path"))]) == 2
    assert not [line for line in lines if "argmax" in line or line.startswith(" optimum")]
    assert any(line.startswith("4 more rows") and "--all" in line for line in lines)
    assert any("SPL %" in line for line in lines)
    every = narrow(*words, "--all")
    assert any("argmax" in line for line in every) and any(line.startswith(" optimum") for line in every)
    assert not any("--all" in line for line in every)


def test_a_long_evaluation_tells_how_far_it_is(clearway, trained, monkeypatch):
    monkeypatch.setattr(progress, "FIRST_LINE_S", 0.0)
    answer = clearway("evaluate", trained.run, "--episodes", 1, "--step-limit", 5, "--json")
    assert answer.json["others"] and answer.err.startswith("evaluating: 1 of 7 agents\n")


@pytest.mark.slow
def test_rows_of_targets_fit(narrow, trained):
    for further in ((), ("--all",)):
        lines = narrow("evaluate", trained.run, "--episodes", 3, "--step-limit", 200, "--targets", *further)
        (heading,) = (line for line in lines if line.split()[:2] == ["scene", "agent"])
        assert heading.endswith("sc %  SPL %")


def test_inspect_rounds(narrow, trained):
    lines = narrow("scenes", "inspect", trained.scene)
    assert not [line for line in lines if re.search(r"\d\.0*[1-9]\d{4,}", line)]


def test_oracle_and_comparisons_fit(narrow, trained, tmp_path, monkeypatch):
    assert any("shortest" in line for line in narrow("oracle", trained.scene))
    monkeypatch.chdir(tmp_path)
    runs = ["bathroom-collision-aware-ppo-s0", "bathroom-collision-aware-ppo-s1-2"]
    for run in runs:
        shutil.copytree(trained.run, run)
    assert set(runs) < set(narrow("runs", "compare", *runs))
    assert set(runs) < set(narrow("runs", "list", "."))
