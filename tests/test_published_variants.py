"""What the pages say of 50 environments, and of a constant learning rate, is what their records come to."""

from pathlib import Path

import pytest

from clearway.experiments.reproduce import gather
from helpers.published import (
    EVIDENCE,
    RESULTS,
    assert_judged,
    check_arms,
    check_beside,
    rows_of,
    seconds_of_runs,
    section_of,
    unpack,
)
from helpers.report_tables import by_heading

PAGE = section_of(EVIDENCE, "Fewer environments, and a constant learning rate")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("record", "article", "variant", "setting"),
    [
        ("fewer-environments", "", "50 environments", "envs=50"),
        ("constant-rate", "a ", "constant rate", "lr_end=0.0007"),
    ],
)
def test_a_variant_is_what_its_record_comes_to(
    record: str, article: str, variant: str, setting: str, tmp_path: Path
) -> None:
    unpack(record, tmp_path / record)
    found = gather(tmp_path / record)
    (section,) = found.sections
    assert section.name == "rewards" and not section.missing
    name, value = setting.split("=")
    assert {f"{getattr(learner, name):g}" for learner in found.setting.learners.values()} == {value}
    table, *_, late = section.tables
    lines = rows_of(PAGE)
    assert [(row["agent"], row["seeds"]) for row in by_heading(late)] == [("shortest", 5), ("collision-aware", 5)]
    check_arms(lines, table, late, {"paper": variant})
    told = {line[0]: line[1:] for line in lines if line[0].startswith(f"{variant}: ")}
    assert len(told) == len(section.claims) == 3
    for claim in section.claims:
        verdict, ours, theirs, difference, p, corrected = told[f"{variant}: {claim.text.removeprefix('paper: ')}"]
        assert_judged(claim, verdict, p, corrected, ours, theirs, difference)
    assert check_beside(lines, table.rows, 3, 4) == {"planner on a learnt map", "nearest picture", "random walk"}
    seconds = seconds_of_runs(tmp_path / record)
    assert len(seconds) == 10 and f"{min(seconds):.0f} to {max(seconds):.0f} s a run with {article}{variant}" in PAGE
    verdicts = [claim.verdict for claim in section.claims if "no more steps" not in claim.text]
    assert verdicts == ["holds"] * 2 and "or a constant rate, `collision-aware` settles sooner, with fewer" in RESULTS
