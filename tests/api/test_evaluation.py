import pytest

import clearway
from clearway.errors import ArgumentError
from clearway.evaluation.runs import evaluate_run
from clearway.files import read_json
from clearway.learn.load import run_scenes
from clearway.scenes.thor_v1 import write_scene
from helpers.made import corridor_scene, grid_scene
from helpers.small_runs import FEATURES

SMALL = {"frames": 800, "envs": 10, "rollout_steps": 8, "step_limit": 30, "width": 16}


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("trained")
    write_scene(corridor_scene(5, feature_count=FEATURES), folder / "corridor.h5")
    return clearway.train(folder / "corridor.h5", [16, 8], out=folder / "run", **SMALL)


@pytest.mark.slow
def test_it_is_the_command_s_evaluation_of_a_folder_an_agent_or_a_training(trained) -> None:
    agent = clearway.load_agent(trained.folder)
    expected = evaluate_run(agent, run_scenes(agent.record), episodes_per_target=4, step_limit=50, seed=1)
    for run in (trained, trained.agent, trained.folder, str(trained.folder)):
        found = clearway.evaluate(run, episodes=4, step_limit=50, seed=1)
        assert [one.to_json() for one in found.evaluations] == [one.to_json() for one in expected]
    assert found.figures == expected[0].average.values
    assert found.intervals == expected[0].average.intervals
    assert found.solved_targets == expected[0].average.solved_targets


def test_scenes_in_memory_need_not_be_named_again() -> None:
    trained = clearway.train(corridor_scene(5, feature_count=FEATURES), [16], **SMALL)
    assert clearway.evaluate(trained, episodes=2, step_limit=9).scenes == trained.scenes
    with pytest.raises(clearway.ClearwayError, match="the run's scene file is missing"):
        clearway.evaluate(trained.agent, episodes=2, step_limit=9)
    assert clearway.evaluate(trained.agent, trained.scenes, episodes=2, step_limit=9).scenes == trained.scenes
    with pytest.raises(clearway.ClearwayError, match="not the scene that the run was trained on"):
        clearway.evaluate(trained, grid_scene(2, feature_count=FEATURES, name="corridor"))


def test_its_tables_and_files(trained, tmp_path, capfd) -> None:
    result = clearway.evaluate(trained, episodes=3, step_limit=20)
    assert result.markdown().startswith("| agent | solved | steps |") and "shortest path" in result.markdown()
    assert result.markdown("targets").startswith("| scene | agent |") and "target 16" in result.markdown("targets")
    assert "collision-aware" in result.text() and "\x1b" not in result.text()
    assert result._repr_markdown_() == result.markdown()
    result.save(str(tmp_path / "new"))
    assert read_json(tmp_path / "new/evaluation.json")["average"] == result.to_json()["average"]
    assert (tmp_path / "new/evaluation.md").exists()
    assert repr(result).startswith("<EvaluateResult: ")
    assert capfd.readouterr() == ("", "")
    with pytest.raises(ArgumentError, match="level='target': expected one of 'average', 'scenes', 'targets'"):
        result.markdown("target")


def test_its_text_is_what_the_command_prints(trained, monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    result = clearway.evaluate(trained, episodes=3, step_limit=20)
    lines = [line.rstrip() for line in result.text().splitlines()]
    assert max(map(len, lines)) <= 80
    assert not [line for line in lines if "argmax" in line or line.startswith(" optimum")]
    assert "4 more rows, of other ways of acting and exact optima: text(all=True)." in lines
    every = result.text(all=True)
    assert "argmax" in every and " optimum" in every and "more rows" not in every
    assert max(len(line.rstrip()) for line in every.splitlines()) <= 80


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ({"agent": 5}, r"agent=5: expected a run folder, an \.onnx file, what train returned, or an agent"),
        ({"episodes": 0}, "episodes=0"),
        ({"step_limit": 2.5}, r"step_limit=2\.5"),
        ({"seed": "1"}, "seed='1'"),
        ({"scenes": 7}, "scenes=7"),
    ],
)
def test_what_does_not_fit_is_refused(trained, arguments, part) -> None:
    with pytest.raises(ArgumentError, match=part):
        clearway.evaluate(**{"agent": trained, **arguments})


def test_load_agent_takes_text_and_refuses_the_rest(trained) -> None:
    assert clearway.load_agent(str(trained.folder)).frames == 800
    assert repr(trained.agent) == f"<TrainedNetwork: ppo, 800 frames in {trained.scenes[0].name}>"
    with pytest.raises(clearway.ClearwayError, match="no run here"):
        clearway.load_agent("nowhere")
    with pytest.raises(clearway.ClearwayError, match=r"genralist: no run here .* Did you mean generalist\?"):
        clearway.load_agent("genralist")
    for ask in (clearway.load_agent, clearway.evaluate):
        with pytest.raises(
            ArgumentError, match=r"generalist: comes with clearway, .* Give it goals: clearway.evaluate_goals"
        ):
            ask("generalist")
    with pytest.raises(ArgumentError, match="run=None: expected a path"):
        clearway.load_agent(None)
