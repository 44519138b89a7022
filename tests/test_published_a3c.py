"""What the pages say of the published algorithm, A3C, is what the records come to."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from clearway.evaluation.oracle import expected, make_task
from clearway.learn.presets import PAPER_A3C
from clearway.reward import SHORTEST
from clearway.scenes.thor_v1 import read_scene
from clearway.zones import scene_zones
from helpers.published import DOCS, EVIDENCE, RESULTS, assert_written, rows_of, seconds_of_runs, section_of, unpack

ARMS = {
    ("a2c", 512, 100, "drawn", 0): "A2C, targets drawn, 1 M frames",
    ("a2c", 512, 100, "kept", 0): "A2C, targets kept, 1 M frames",
    ("a3c", 128, 20, "kept", 0): "A3C, a small network, 0.5 M",
    ("a3c", 128, 20, "drawn", 0): "the same, targets drawn",
    ("a3c", 128, 5, "kept", 0): "the same, one worker a target",
    ("a3c", 128, 20, "kept", 154_000): "the same, warm-up",
    ("a3c", 512, 20, "drawn", 0): "A3C as published, targets drawn, 1 M",
}
"""How the page calls an arm, by algorithm, width, environments or workers, rule of targets and warm-up."""
DRAWN, KEPT, *SMALL = list(ARMS.values())[:6]
REWARDS = ("shortest", "collision-aware")
LOST_BY_A3C = 48
"""The target that A3C loses."""


def arms_of(folder: Path) -> Mapping[str, Mapping[str, list[dict[str, Any]]]]:
    """The agents of the ends of trainings, by arm and reward, in the order of seeds: lost episodes by target, means."""
    found: dict[str, dict[str, list[dict[str, Any]]]] = {}
    for path in folder.glob("runs/*/trials/*.json"):
        content, run = (json.loads(at.read_text(encoding="utf-8")) for at in (path, path.parents[1] / "run.json"))
        if content["about"]["halfway"]:
            continue
        learner = {"episode_targets": "drawn", "lr_warm_up": 0} | run["learner"]  # which earlier runs do not tell
        if learner["whiten_features"] or learner["lr_start"] != 0.0007:  # other step sizes of a record
            continue
        key = ("algorithm", "width", "envs", "episode_targets", "lr_warm_up")
        episodes = {name: np.array(column) for name, column in content["episodes"].items()}
        lost, (targets,) = episodes["reached"] == 0, content["about"]["targets"].values()
        agent = {
            "seed": run["seed"],
            "lost": {target: int(lost[episodes["target"] == number].sum()) for number, target in enumerate(targets)},
            "to it": episodes["steps"][episodes["target"] == targets.index(LOST_BY_A3C)].mean(),
            "to others": episodes["steps"][episodes["target"] != targets.index(LOST_BY_A3C)].mean(),
        }
        assert len(lost) == 500 and content["about"]["step_limit"] == 10_000
        called = ARMS[tuple(learner[name] for name in key)]
        assert learner["frames"] == (1_000_000 if " 1 M" in called else 500_000)
        assert learner["feature_basis"] == (0 if learner["width"] == 512 else 128)
        found.setdefault(called, {}).setdefault(run["reward"]["name"], []).append(agent)
    for by_reward in found.values():
        for agents in by_reward.values():
            agents.sort(key=lambda agent: agent["seed"])
    return found


def lost_by(arm: Mapping[str, list[dict[str, Any]]]) -> dict[tuple[str, int], int]:
    """Episodes that each run of an arm loses, by reward and seed."""
    return {(reward, agent["seed"]): sum(agent["lost"].values()) for reward, own in arm.items() for agent in own}


def mends_or_helps(arm: Mapping[tuple[str, int], int], first: Mapping[tuple[str, int], int]) -> str:
    """What question 71 says of an arm's lost episodes beside the first arm's."""
    assert arm.keys() == first.keys() and len(arm) == 10
    if not any(arm.values()):
        return "mends"
    return "helps" if all(arm[run] < first[run] or arm[run] == first[run] == 0 for run in arm) else "neither"


def test_an_arm_mends_helps_or_does_neither_as_the_question_says() -> None:
    runs = [(reward, seed) for reward in ("a", "b") for seed in range(5)]
    first = dict.fromkeys(runs, 9) | {runs[0]: 0}
    assert mends_or_helps(dict.fromkeys(runs, 0), first) == "mends"
    assert mends_or_helps(dict.fromkeys(runs, 8) | {runs[0]: 0}, first) == "helps"
    assert mends_or_helps(dict.fromkeys(runs, 8), first) == "neither"
    assert mends_or_helps(first, first) == "neither"


def test_why_a_target_is_lost_is_what_the_records_come_to(tmp_path: Path) -> None:
    unpack("a3c-targets", tmp_path / "why")
    unpack("step-size-bathroom", tmp_path / "steps")
    page = section_of(EVIDENCE, "A3C: why it loses a target")
    arms = dict(arms_of(tmp_path / "why"))
    arms[DRAWN] = arms_of(tmp_path / "steps")[DRAWN]
    told = rows_of(page)[1:]
    shown = sorted((row[0].partition(" ([record]")[0], row[1]) for row in told)
    assert shown == sorted((arm, reward) for arm, by_reward in arms.items() for reward in by_reward)
    for called, reward, lost, to_it, to_others in told:
        agents = arms[called.partition(" ([record]")[0]][reward]
        assert lost == ", ".join(str(sum(agent["lost"].values())) for agent in agents)
        assert {target for agent in agents for target, count in agent["lost"].items() if count} <= {LOST_BY_A3C}
        for written, name in ((to_it, "to it"), (to_others, "to others")):
            assert_written(written.replace(",", ""), float(np.mean([agent[name] for agent in agents])), called)
    assert {seed for name in (KEPT, DRAWN) for _, seed in lost_by(arms[name])} == {15, 16, 17, 18, 19}
    assert {seed for name in SMALL for _, seed in lost_by(arms[name])} == {5, 6, 7, 8, 9}
    kept, drawn = (lost_by(arms[name]) for name in (KEPT, DRAWN))
    assert kept.keys() == drawn.keys()
    losing = [sum(map(bool, arm.values())) for arm in (kept, drawn)]
    assert losing == [10, 1]  # of ten; question 70: yes from eight on
    first, *others = (lost_by(arms[name]) for name in SMALL)
    assert sum(map(bool, first.values())) == 9  # of ten; below eight question 71 says nothing
    assert "A3C (small network) loses episodes to one target in nine runs of ten;" in RESULTS
    assert [mends_or_helps(arm, first) for arm in others] == ["helps", "neither", "neither"]
    assert "drawn targets help, fewer workers or a warm-up are not seen to." in RESULTS
    assert "in ten runs of ten where its environments keep their targets; where they draw them, in one." in page
    assert "A2C keeping targets does in ten (drawing: one);" in RESULTS
    assert [sum(arm.values()) for arm in (first, *others)] == [679, 2, 633, 571]
    assert "Of 5,000 episodes each the four arms lose 679, 2, 633 and 571." in page
    searching = {
        reward: sorted(agent["to it"] for agent in agents) for reward, agents in arms["the same, targets drawn"].items()
    }
    assert f"({searching['shortest'][0]:,.0f} to {searching['shortest'][-1]:,.0f})" in page
    (file,) = (tmp_path / "steps").rglob("bathroom.h5")
    scene = read_scene(file)
    task = make_task(scene.graph, scene_zones(scene), LOST_BY_A3C, SHORTEST)
    walk = expected(task, np.full((scene.state_count, 4), 0.25)).steps
    assert f"in {walk:,.0f} steps (exactly, over all starts)" in page and searching["shortest"][0] > walk
    learnt = [steps for steps in searching["collision-aware"] if steps < 500]
    assert len(learnt) == 3 and f"({learnt[0]:.0f} to {learnt[-1]:.0f} steps)" in page
    published = lost_by(arms[list(ARMS.values())[-1]])
    assert published == {("shortest", 5): 0, ("collision-aware", 5): 0}
    assert "A3C as published, drawing, in neither of two (of a seed that loses none anyway)" in RESULTS
    pairs = [
        sum(one["lost"].values()) < sum(other["lost"].values())
        for name in (KEPT, SMALL[0], *SMALL[2:])
        for one, other in zip(arms[name]["shortest"], arms[name]["collision-aware"], strict=True)
    ]
    assert (sum(pairs), len(pairs)) == (18, 20) and "in 18 of 20 pairs (not asked)" in page


def test_more_frames_come_to_what_the_record_holds(tmp_path: Path) -> None:
    unpack("a3c-longer", tmp_path / "longer")
    page = section_of(EVIDENCE, "The published algorithm, A3C")
    runs = {run.parent: json.loads(run.read_text(encoding="utf-8")) for run in tmp_path.glob("longer/runs/*/run.json")}
    of_preset = asdict(PAPER_A3C) | {"frames": 3_000_000}
    assert all(
        {name: run["learner"].get(name, own) for name, own in of_preset.items()} == of_preset for run in runs.values()
    )
    agents: dict[tuple[str, str], dict[int, dict[str, Any]]] = {}
    for folder, run in runs.items():
        for path in folder.glob("trials/*.json"):
            content = json.loads(path.read_text(encoding="utf-8"))
            (targets,), episodes = content["about"]["targets"].values(), content["episodes"]
            steps, collisions, reached = (np.array(episodes[name]) for name in ("steps", "collisions", "reached"))
            of_it = np.array(targets)[episodes["target"]] == LOST_BY_A3C
            assert content["about"]["step_limit"] == 10_000 and (len(reached), of_it.sum()) == (500, 100)
            assert reached[~of_it].all()  # no other target is lost
            after = "1.5 M" if content["about"]["halfway"] else "3 M frames"
            agents.setdefault((run["reward"]["name"], after), {})[run["seed"]] = {
                "lost": int((reached == 0).sum()),
                "figures": (
                    *(steps.mean(), collisions.mean()),
                    *(steps[of_it].mean(), steps[~of_it].mean(), collisions[~of_it].mean()),
                ),
            }
    assert len(runs) == 6 and all(set(own) == {5, 6, 7} for own in agents.values())
    ends = [(folder / "metrics.jsonl").read_text(encoding="utf-8").splitlines()[-1] for folder in runs]
    updates = [json.loads(end)["updates"] for end in ends]
    assert {round(count, -5) for count in updates} == {700_000} and "some 700,000 updates" in page
    shown = {(row[0], row[1]): row[2:] for row in rows_of(page)[1:]}
    assert set(shown) == set(agents)
    for arm, (lost, *written) in shown.items():
        own = [agents[arm][seed] for seed in (5, 6, 7)]
        assert lost == ", ".join(str(agent["lost"]) for agent in own)
        for number, cell in enumerate(written):
            cells = [one.replace(",", "") for one in cell.split(", ")]
            for one, agent in zip(cells, own, strict=True):
                assert_written(one, float(agent["figures"][number]), f"{arm}, {cell}")
    finals = {reward: [agents[reward, "3 M frames"][seed]["figures"] for seed in (5, 6, 7)] for reward in REWARDS}
    more = [own[1] / other[1] for own, other in zip(finals["collision-aware"], finals["shortest"], strict=True)]
    assert more[0] < 1 and all(200 < times < 250 for times in more[1:]) and "some 200 times `shortest`'s" in page
    assert all(own[4] < other[4] for own in finals["collision-aware"] for other in finals["shortest"])
    losing = {reward: sum(agents[reward, "3 M frames"][seed]["lost"] > 0 for seed in (5, 6, 7)) for reward in REWARDS}
    assert losing == {"shortest": 0, "collision-aware": 2}  # neither none in all, nor one in each: question 63
    lost_at = [
        {(name, seed) for (name, after), own in agents.items() if after == when for seed in own if own[seed]["lost"]}
        for when in ("1.5 M", "3 M frames")
    ]
    assert lost_at[0] == lost_at[1] and not any(seed == 5 for _, seed in lost_at[0])
    assert "Seed 5, recorded in 3 M frames, loses none with targets kept either, halfway nor in the end" in EVIDENCE
    assert "by 1.5 M frames each run has learnt pose 48, or loses it to the end" in page
    log = (DOCS / "log.md").read_text(encoding="utf-8").replace("\n", " ")
    for told in ("4 to 47 %", "29 to 91 %"):  # of which no record is kept
        assert told in page and told in log
    assert "Whether 3 M frames mend its lost target is undecided" in page
    assert "undecided: two of three `collision-aware` runs lose one, none of `shortest` (" in RESULTS
    minutes = [seconds / 60 for seconds in seconds_of_runs(tmp_path / "longer")]
    assert f"{min(minutes):.0f} to {max(minutes):.0f} minutes a run" in page
