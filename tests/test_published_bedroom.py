"""What the pages say of the published settings in the bedroom alone is what their records come to."""

import json
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from clearway.evaluation.across_seeds import mean_estimate
from clearway.experiments import table1, zone_time
from clearway.experiments.convergence import (
    ONE_TARGET,
    frames_until_settled,
    mark_steps,
    settled_by_seed,
)
from clearway.experiments.correction import holm
from clearway.experiments.groups import PAIR, compared
from clearway.experiments.reproduce import gather
from clearway.experiments.request_file import REQUEST_FILE
from clearway.experiments.section import Section
from clearway.experiments.setting import Setting
from clearway.experiments.verdicts import judged_less
from clearway.reward import BUMP
from helpers.published import (
    EVIDENCE,
    RESULTS,
    assert_judged,
    assert_shown,
    assert_written,
    check_ends,
    numbers,
    rows_of,
    seconds_of_runs,
    section_of,
    unpack,
)
from helpers.report_tables import by_heading


@pytest.mark.slow
def test_the_bedroom_alone_is_what_its_record_comes_to(tmp_path: Path) -> None:
    folder = tmp_path / "bedroom"
    unpack("bedroom", folder)
    page = EVIDENCE.partition("### The bedroom alone")[2]
    page = page.partition("\n## ")[0]
    asked = json.loads((folder / REQUEST_FILE).read_text(encoding="utf-8"))
    compared = 0
    for millions, settled in (("2.5", []), ("5", [("shortest", 2.3, 3), ("collision-aware", 4.25, 2)])):
        (folder / REQUEST_FILE).write_text(json.dumps({**asked, "frames": int(float(millions) * 1e6)}))
        (section,) = gather(folder).sections
        assert not section.missing
        ends, late = section.tables[:2]
        of_agents = [row for row in ends.rows if row[0] == "paper"]
        for _, agent, frames, _, failed, steps, between, collisions, between_collisions in of_agents:
            begin = f"| {agent} | {frames / 1e6:g} M | {millions} M |"
            (line,) = [line for line in page.splitlines() if line.startswith(begin)]
            written = line.removeprefix(begin).strip(" |").split(" | ")
            for cell, value, interval in zip(written, (steps, collisions), (between, between_collisions), strict=False):
                mean, _, low_to_high = cell.replace(",", "").partition(" ")
                assert_written(mean, value, begin)
                assert low_to_high == f"({interval.replace(',', '').replace(' to ', '-')})", begin
            assert written[2] == failed
            compared += 1
        rows = {row[1]: row for row in late.rows}
        for agent, mean, count in settled:
            assert rows[agent][3:5] == (count, mean * 1e6)
            assert f"`{agent}` after {mean:.2f} M" in page
    assert compared == 8


@pytest.mark.slow
def test_the_bedroom_of_fresh_seeds_is_what_its_record_comes_to(tmp_path: Path) -> None:
    unpack("bedroom-fresh", tmp_path / "bedroom")
    found = gather(tmp_path / "bedroom")
    sections = {section.name: section for section in found.sections}
    assert list(sections) == ["table1", "fig3", "fig4", "zone-time"]
    assert [section.missing for name, section in sections.items() if name != "table1"] == [()] * 3
    section = sections["fig4"]
    page = section_of(EVIDENCE, "The bedroom, of fresh seeds")
    lines = rows_of(page.partition("**Figure 3 in numbers**")[0])
    ends, late = section.tables[:2]
    assert len(ends.rows) == 4 + 3  # the last three of no learner's
    for learner, agent, frames, _, failed, steps, between, collisions, between_collisions in ends.rows:
        trained = "" if frames is None else f"{frames / 1e6:g} M" if learner == "paper" else f"{frames:,}"
        ((*_, shown, bumps, lost),) = [line for line in lines if line[:2] == [agent or learner, trained]]
        assert_shown(shown, steps, between or "")
        assert_shown(bumps, collisions, between_collisions or "")
        assert lost == (failed if trained else "")
    for _, agent, _, settled, frames, interval in late.rows:
        ((*_, told, _, _, _),) = [line for line in lines if line[:2] == [agent, "5 M"]]
        assert told == f"{frames:,.0f} ({interval.replace(' to ', '-')}), {settled} of 5"
        results = rf"`{agent}`[^`]* after {frames / 1e6:.2f} M(?: frames)? \({'-'.join(numbers(millions(interval)))}\)"
        assert re.search(results, RESULTS), results
    check_bedroom(sections, found.setting, lines)
    check_ends(sections["fig3"], page)
    check_time_in_the_bedroom(sections["zone-time"], found.setting)
    # the question's own two claims
    setting, groups = found.setting, {group.agent: group for group in compared(found.setting, PAIR)}
    world, mark = setting.world(), mark_steps(setting, setting.targets)
    settled = {agent: frames_until_settled(setting.out, group, mark)[0] for agent, group in groups.items()}
    scores = {agent: group.scores(setting.out, world.target_count) for agent, group in groups.items()}
    bumps = [scores[agent].of("collisions") for agent in ("collision-aware", "shortest")]
    claims = [
        judged_less("sooner", "frames", settled["shortest"], settled["collision-aware"], ONE_TARGET),
        judged_less("fewer", "collisions", *bumps, world.target_scene.numpy()),
    ]
    told = [line for line in lines if line[-1] in ("holds", "undecided") and len(line) == 5]
    for claim, p_of_both, (_, difference, p, corrected, verdict) in zip(
        claims, holm([claim.p for claim in claims]), told, strict=True
    ):
        apart = claim.numbers["difference"]
        ends = re.findall(r"-?\d[\d,.]*", difference)
        for written, value in zip(ends, (apart.value, *apart.interval), strict=True):
            assert float(written.replace(",", "")) == pytest.approx(value, rel=0.01)
        assert_written(p, claim.p, verdict)
        assert_written(corrected, p_of_both, verdict)
        assert verdict == claim.verdict
    assert settled["shortest"].max() < settled["collision-aware"].min()
    aware, shortest = (np.sort(own.mean(1)) for own in bumps)
    assert aware[3] < shortest[0]
    assert "have 0.046 to 0.092 collisions, fewer than all of `shortest` (0.228 to 0.296)" in page
    for written, value in (("0.046", aware[0]), ("0.092", aware[3]), ("6.8", aware[4]), ("0.228", shortest[0])):
        assert_written(written, value, "collisions")
    of_pair, of_bump = (
        sorted(s for name in names for s in seconds_of_runs(tmp_path / "bedroom", f"a2c-{name}-*"))
        for names in (("shortest", "collision-aware"), ("bump",))
    )
    assert (len(of_pair), len(of_bump)) == (10, 5)
    for own in (of_pair, of_bump):
        assert f"{round(own[0], -1):,.0f} to {round(own[-1], -1):,.0f} s a run" in page


def check_bedroom(sections: Mapping[str, Section], setting: Setting, lines: list[list[str]]) -> None:
    """The bedroom's claims but those without clipping, which were not run; and what stands beside the pair."""
    claims = [claim for name in ("table1", "fig3", "fig4") for claim in sections[name].claims]
    claims = [claim for claim in claims if "unclipped" not in claim.text]
    shown = [line for line in lines if len(line) == 7 and line[1] in ("holds", "does not hold", "undecided")]
    assert [line[0] for line in shown] == [claim.text.removeprefix("paper: ") for claim in claims]
    assert len(shown) == 10
    for claim, (_, verdict, own, other, apart, p, corrected) in zip(claims, shown, strict=True):
        assert_judged(claim, verdict, p, corrected, own, other, apart)
    table = sections["table1"].tables[0]
    found = {
        (row["figure"], row["agent"] if row["learner"] == "paper" else row["learner"]): row for row in by_heading(table)
    }
    for name, key in (("bump", "bump"), ("behaviour cloning", "bc"), ("Q-learning", "q-learning")):
        ((_, frames, _, steps, collisions, lost),) = [line for line in lines if line[0] == name]
        for cell, figure in ((steps, "steps"), (collisions, "collisions")):
            assert_shown(cell, found[figure, key]["average"], found[figure, key]["95 %"])
        assert lost == found["steps", key]["failed targets"]
        assert name == "bump" or found["steps", key]["agent"] == frames.replace(" M", ",000,000 frames")
    ((_, _, after, *_),) = [line for line in lines if line[0] == "bump"]
    (group,) = compared(setting, (BUMP,))
    frames, ran = frames_until_settled(setting.out, group, mark_steps(setting, setting.targets))
    told, count = after.split("), ")
    estimate = mean_estimate(frames, ONE_TARGET)
    assert_shown(told, estimate.value, str(estimate.ends))
    assert count == f"{ran} of 5"
    least, most = (f"{end / 1e6:.3f}" for end in (frames.min(), np.sort(frames.ravel())[ran - 1]))
    assert f"three of five, after {least} to {most} M frames; one more does by its last row" in EVIDENCE and ran == 3


def check_time_in_the_bedroom(section: Section, setting: Setting) -> None:
    """How long agents stay in the zones there."""
    part, mark = section_of(EVIDENCE, "The bedroom: time in the zones"), mark_steps(setting, setting.targets)
    lines, settled, shares = rows_of(part), dict[str, int](), dict[str, list[float]]()
    for group in compared(setting, table1.TABLE_1_REWARDS):
        by_seed = settled_by_seed(setting.out, group, mark)
        share = group.scores(setting.out, setting.world().target_count).of("share_collision").mean(1)
        settled[group.agent] = sum(has for _, has in by_seed.values())
        shares[group.agent] = sorted(
            100 * own for own, (_, has) in zip(share, by_seed.values(), strict=True) if has or group.agent == "shortest"
        )
    ends = [f"{each[0]:.1f} to {each[-1]:.1f} %" for each in (shares["collision-aware"], *list(shares.values())[:2])]
    told = (
        "Settled runs of `collision-aware` have {} of their steps there, all of `shortest` {}, settled ones of `bump`"
    )
    assert f"{told.format(*ends[:2])} {ends[2]}" in part
    for row in by_heading(section.tables[0]):
        name = row["agent"] if row["learner"] in ("paper", "walked") else row["learner"]
        ((_, *cells, ran),) = [line for line in lines if line[0] == name and len(line) == 6]
        assert len(cells) == len(zone_time.FIGURES)
        for cell, words in zip(cells, zone_time.FIGURES.values(), strict=True):
            scale = 100 if words.startswith("share") else 1
            assert_shown(cell, row[words], row[f"95 % of {words}"] or "" if row["learner"] == "paper" else "", scale)
        assert ran == (f"{settled[name]} of 5" if row["learner"] == "paper" else "")
    for claim in section.claims:
        text = claim.text.removeprefix("paper: collision-aware, ")
        ((_, difference, p, corrected, verdict),) = [line for line in lines if line[0] == text]
        assert_judged(claim, verdict, p, corrected, difference=difference)


def millions(interval: str) -> str:
    """Frames of an interval, in millions."""
    return " ".join(f"{int(end) / 1e6:.2f}" for end in numbers(interval.replace(",", "")))
