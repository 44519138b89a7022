"""What the pages say of the published settings' agents off the grid is what their record comes to."""

import re
from pathlib import Path

import numpy as np
import pytest

from clearway.experiments import off_grid
from clearway.experiments.convergence import (
    mark_steps,
    settled_row,
)
from clearway.experiments.job import run_folder
from clearway.experiments.reproduce import gather
from clearway.experiments.section import Section
from clearway.experiments.setting import Setting
from helpers.published import (
    EVIDENCE,
    assert_written,
    seconds_of_runs,
    section_of,
    unpack,
    words_of,
)
from helpers.report_tables import by_heading


@pytest.mark.slow
def test_off_the_grid_is_what_its_record_comes_to(tmp_path: Path) -> None:
    unpack("off-grid-bathroom", tmp_path / "off-grid")
    report = gather(tmp_path / "off-grid")
    page = section_of(EVIDENCE, "Five seeds, published settings")
    (section,) = report.sections
    assert not section.missing
    check_off_the_grid(section, page)
    check_who_had_settled(report.setting, page)


@pytest.mark.slow
def test_fifteen_seeds_off_the_grid_are_what_their_record_comes_to(tmp_path: Path) -> None:
    unpack("off-grid-settled", tmp_path / "settled")
    report = gather(tmp_path / "settled")
    page = section_of(EVIDENCE, "Fifteen seeds, after 1.5 M frames")
    (section,) = report.sections
    assert not section.missing
    check_off_the_grid(section, page)
    has = settled_by_agent(report.setting)
    assert list(has) == ["shortest", "bump", "collision-aware", "clearance"]
    assert all(len(own) == 15 for own in has.values())
    told = words_of(r"settled by their training: (\d+), (\d+), (\d+) and (\d+) of fifteen", page).groups()
    assert list(map(int, told)) == [sum(own) for own in has.values()]
    seconds = seconds_of_runs(tmp_path / "settled")
    assert len(seconds) == 60 and f"{min(seconds):.0f} to {max(seconds):.0f} s of training a run" in page


def settled_by_agent(setting: Setting) -> dict[str, list[bool]]:
    """Of each trained kind of agents which runs had settled."""
    mark = mark_steps(setting, setting.targets)
    return {
        agent: [settled_row(run_folder(setting.out, job.run).metrics(), mark) is not None for job in jobs]
        for (_, agent), jobs in [*off_grid._planned(setting).items()][:4]
    }


def check_off_the_grid(section: Section, page: str) -> None:
    """Means, what each setting comes to, and the claims."""
    (table,) = section.tables
    rows = by_heading(table)
    lines = page.splitlines()
    figures = [heading for heading in table.headings[4:] if not heading.startswith("95 %")]
    means = [row for row in rows if row["setting"] == "all settings, mean"]
    assert len(means) == 6
    names = {"nearest picture": "nearest picture", "walked": "random walk"}
    for row in means:
        name = names.get(str(row["learner"]), row["agent"])
        (line,) = [line for line in lines if line.startswith(f"| {name} |") and line.count("|") == 8]
        for cell, name in zip(line.strip("|").split("|")[1:], figures, strict=True):
            scale = 1 if name == "contacts" else 100
            ends = (float(end) for end in str(row[f"95 % of {name}"]).split(" to "))
            for written, value in zip(re.findall(r"[\d.]+", cell), (float(str(row[name])), *ends), strict=True):
                assert abs(float(written) - scale * value) <= (0.0051 if name == "contacts" else 0.051), (
                    f"{row['agent']}, {name}"
                )
    under = [line.strip("| ").split(" | ") for line in lines if line.count("|") == 8 and "%, " in line]
    assert [label for label, *_ in under] == [str(row["setting"]) for row in rows[6::6]]
    for number, (label, *cells) in enumerate(under, start=1):
        for cell, row in zip(cells, rows[6 * number : 6 * number + 6], strict=True):
            success, contacts = cell.split(" %, ")
            assert_written(success, 100 * row["success"], label)
            assert_written(contacts, row["contacts"], label)
    claims = [
        line.strip("|").split("|") for line in lines if line.endswith(("undecided |", "holds |", "does not hold |"))
    ]
    assert len(claims) == len(section.claims) == 15
    for (text, difference, p, corrected, verdict), claim in zip(claims, section.claims, strict=True):
        assert claim.text.endswith(f": {text.strip()}")
        found = claim.numbers["difference"]
        assert found.interval is not None
        told = f"{found.value:.3g} ({found.interval[0]:.3g} to {found.interval[1]:.3g})"
        assert difference.strip() == told
        family = 3 if "staying near, bump: " in claim.text else 6
        assert f"p = {p.strip()}, for {family} claims {corrected.strip()} (Holm)" in claim.evidence
        assert verdict.strip() == claim.verdict


def check_who_had_settled(setting: Setting, page: str) -> None:
    """What unsettled runs do off the grid: of `shortest` unperturbed, of `bump` over all settings."""
    mark, told = mark_steps(setting, setting.targets), {}
    for (_, agent), jobs in [*off_grid._planned(setting).items()][:2]:
        scores = off_grid._scores(setting, jobs)
        has = [settled_row(run_folder(setting.out, job.run).metrics(), mark) is not None for job in jobs]
        told[agent] = np.array(has), scores[:, 0, :, 0].mean(1), scores[..., 1].mean((1, 2))
    assert off_grid.FIGURES[:2] == ("success", "contacts")
    has, arrive, _ = told["shortest"]
    assert has.sum() == 3 and set(arrive[~has].round(2)) == {0.3}
    assert (
        f"these three arrive in {100 * arrive[has].min():.0f} to {100 * arrive[has].max():.0f} %, the others in 30 %"
        in page
    )
    has, arrive, contacts = told["bump"]
    assert has.sum() == 3 and "by their training, two had not settled either" in page
    worst = arrive.argmin()
    assert not has[worst]
    others = np.delete(contacts, worst)
    words = r"them arrives in (\d+) %, and has ([\d.]+) contacts .* the other four have ([\d.]+) to ([\d.]+)\."
    values = (100 * arrive[worst], contacts[worst], others.min(), others.max())
    for written, value in zip(words_of(words, page).groups(), values, strict=True):
        assert_written(written, value, "of bump")
