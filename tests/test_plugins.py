"""Plugins: what is listed, what is refused, and one of each kind from a package of its own."""

import json
import re
import sys
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pytest

import clearway
from clearway.agents.named import agent_maker
from clearway.cli.imports.command import ImportScenes
from clearway.cli.imports.plugin import ImportPlugin
from clearway.cli.main import main
from clearway.deploy.export import export_onnx
from clearway.deploy.from_run import load_run_in_scene
from clearway.errors import AgentError, EncoderError, PluginError
from clearway.experiments.catalogue import EXPERIMENTS
from clearway.importers.plugged import plugged_scenes
from clearway.learn.algorithms import ALGORITHMS, algorithm
from clearway.learn.presets import PRESETS
from clearway.perception import check_encoder, depth_grid, encode, encode_scenes, encoder_from_record, eyes
from clearway.plugins import BUILT_IN, KINDS, Plugin, find_plugin, imported, load_plugin, offered, plugin_of, plugins
from clearway.reward import REWARDS, Arrival, Reward, RewardError, Time, reward_named
from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.made import corridor_scene, grid_scene
from helpers.plugin_package import MODULE, clearway_with, write_package


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_package(tmp_path_factory.mktemp("site"))


@pytest.fixture
def here(package, monkeypatch, tmp_path):
    """The package on this process's path."""
    monkeypatch.syspath_prepend(str(package))
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    yield package
    sys.modules.pop("tiny_plugins", None)


MADE = """
from dataclasses import replace
import numpy as np
from clearway.scenes.scene import EncoderRecord, Provenance
from helpers.made import corridor_scene
class Dark:
    shape = (20, 8, 8, 3)
    def __getitem__(self, index): raise OSError("lens cap")
"""


def offer(folder: Path, group: str, lines: str, module: str = "", package: str = "others") -> Path:
    return write_package(folder, package=package, module=module, entry_points=f"[clearway.{group}]\n{lines}\n")


def test_the_built_in_names_are_those_that_there_are() -> None:
    kinds = get_args(get_type_hints(ImportScenes, include_extras=True)["kind"])
    importers = [get_args(kind)[1].name for kind in kinds if get_args(kind)[0] is not ImportPlugin]
    assert BUILT_IN["encoders"] == (encode.AUTO, encode.TRAINED, encode.RANDOM, depth_grid.NAME, eyes.NAME)
    assert BUILT_IN["importers"] == tuple(importers)
    assert set(BUILT_IN["rewards"]) == set(REWARDS)
    assert BUILT_IN["algorithms"] == (*ALGORITHMS, *PRESETS)
    assert BUILT_IN["experiments"] == (*EXPERIMENTS, "all")
    assert set(BUILT_IN) == set(KINDS)


@pytest.mark.slow
def test_one_of_each_kind_is_listed_after_our_own(package, tmp_path) -> None:
    listed = clearway_with(package, words=("plugins", "--json"), cache=tmp_path)
    assert listed.returncode == 0, listed.stderr
    rows = json.loads(listed.stdout)
    foreign = {(row["kind"], row["name"]) for row in rows if row["package"] == "tiny-plugins"}
    assert foreign == {
        ("encoders", "mean-colour"),
        ("rewards", "dear"),
        ("agents", "still"),
        ("importers", "pair"),
        ("algorithms", "hasty"),
        ("experiments", "twice"),
    }
    assert {row["version"] for row in rows if row["package"] == "tiny-plugins"} == {"1.2"}
    assert not any(row["problem"] for row in rows)
    for kind in KINDS:
        names = [row["name"] for row in rows if row["kind"] == kind]
        assert tuple(names[: len(BUILT_IN[kind])]) == BUILT_IN[kind]
    table = clearway_with(package, words=("plugins",), cache=tmp_path).stdout
    assert any(line.split() == ["encoders", "mean-colour", "tiny-plugins", "1.2"] for line in table.splitlines())


@pytest.mark.slow
def test_its_importer_and_its_encoder_make_scenes(package, tmp_path) -> None:
    write_scene(grid_scene(1), tmp_path / "grid.h5")
    (tmp_path / "two.txt").write_text("grid.h5\n")
    words = ("scenes", "import", "plugin", "pair", tmp_path / "two.txt", "--out", tmp_path, "--encoder", "mean-colour")
    done = clearway_with(package, words=words, cache=tmp_path / "cache")
    assert done.returncode == 0, done.stderr
    for name in ("left", "right"):
        scene = read_scene(tmp_path / f"{name}.h5")
        assert scene.encoder_name == "mean-colour"
        assert scene.encoder.settings["package"] == "tiny-plugins"
        expected = scene.observations[:][:, :6, :8].mean((1, 2)) / 255
        np.testing.assert_allclose(np.asarray(scene.features)[:, :3], expected, rtol=1e-6)
    with pytest.raises(EncoderError, match="the package tiny-plugins that offers it is not installed"):
        encoder_from_record(scene.encoder)


def test_an_encoder_is_made_again_from_its_record(here) -> None:
    (scene,) = encode_scenes([grid_scene(1)], "mean-colour")
    encoder = encoder_from_record(scene.encoder)
    assert encoder.feature_count == 12
    assert np.array_equal(encoder.encode(scene.observations), scene.features)
    assert scene.features.dtype == np.float32


def test_the_sensor_of_its_encoder_is_to_be_rendered(here, tmp_path, monkeypatch) -> None:
    deep = "from tiny_plugins import MeanColour\nclass Deep(MeanColour): sensor = 'depth'"
    monkeypatch.syspath_prepend(str(offer(tmp_path, "encoders", "deep = others:Deep", deep)))
    sys.modules.pop("others", None)
    with pytest.raises(EncoderError, match=r"deep sees depth, and it is not rendered\. Add --sensors rgb depth"):
        check_encoder("deep", ("rgb",))
    check_encoder("deep", ("rgb", "depth"))
    check_encoder("mean-colour", ("rgb",))
    sys.modules.pop("others", None)


def test_another_version_of_the_encoder_is_refused(tmp_path, here, monkeypatch) -> None:
    (scene,) = encode_scenes([grid_scene(1)], "mean-colour")
    newer = write_package(tmp_path / "newer", version="2.0", module=MODULE.replace("colour-1", "colour-2"))
    monkeypatch.setattr(sys, "path", [str(newer), *(place for place in sys.path if place != str(here))])
    sys.modules.pop("tiny_plugins")
    problem = r"is that of tiny-plugins 2\.0 \(mean-colour-2\), the features were made by that of tiny-plugins 1\.2"
    with pytest.raises(EncoderError, match=problem):
        encoder_from_record(scene.encoder)


def test_rewards_agents_and_algorithms_are_found_by_name(here) -> None:
    assert load_plugin(plugin_of("rewards", "dear")) == Reward("dear", (Time(-0.5), Arrival())) == reward_named("dear")
    assert load_plugin(plugin_of("agents", "still")).__name__ == "Still"
    assert algorithm("hasty")().explore_end == 0.5
    assert find_plugin("rewards", "shortest") is None
    assert find_plugin("rewards", "cheap") is None
    with pytest.raises(PluginError, match=r"reward cheap: no installed package offers one .* use one of these: dear"):
        plugin_of("rewards", "cheap")


def test_unknown_names_are_answered_with_those_of_other_packages_too(here) -> None:
    with pytest.raises(
        AgentError, match=r"'stil': unknown\. Did you mean still\? Use one of random, shortest path, still"
    ):
        agent_maker("stil")
    with pytest.raises(RewardError, match=r"'deer' is unknown\. Did you mean dear\? .*'clearance', 'dear', a Reward"):
        reward_named("deer")
    assert [offered(kind) for kind in KINDS] == [["mean-colour"], ["dear"], ["still"], ["pair"], ["hasty"], ["twice"]]


@pytest.mark.slow
def test_its_algorithm_trains_for_its_reward_and_its_agent_walks_beside(here, tmp_path, capsys) -> None:
    write_scene(grid_scene(1), tmp_path / "grid.h5")
    chosen = ("--algorithm", "hasty", "--reward", "dear", "--frames", "4000", "--targets", "5")
    evaluate = ("evaluate", tmp_path / "run", "--beside", "still", "--episodes", "3", "--step-limit", "20", "--json")
    for words in (("train", tmp_path / "grid.h5", "--out", tmp_path / "run", *chosen), evaluate):
        with pytest.raises(SystemExit) as leaving:
            main([str(word) for word in words])
        told = capsys.readouterr()
        assert leaving.value.code == 0, told.err
    first = json.loads(told.out)
    others = first["others"]
    assert first["agent"] == "dear" and first["trained"]["reward"]["name"] == "dear"
    (still,) = [other for other in others if other["agent"] == "still"]
    assert still["average"]["collisions"] == 0 and still["average"]["steps"] > first["average"]["steps"]


def test_looking_up_imports_none_of_them(tmp_path, monkeypatch) -> None:
    monkeypatch.syspath_prepend(str(offer(tmp_path, "encoders", "loud = others:x", "raise SystemError('loud')")))
    assert [plugin.name for plugin in plugins("encoders")] == ["loud"]
    assert "others" not in sys.modules


def test_two_of_one_name_are_refused_and_shown(here, tmp_path, monkeypatch) -> None:
    other = offer(tmp_path / "other", "encoders", "mean-colour = others:x\nauto = others:y")
    monkeypatch.syspath_prepend(str(other))
    with pytest.raises(PluginError, match=r"mean-colour of the package others 1\.2: tiny-plugins offers one of this"):
        encode_scenes([grid_scene(1)], "mean-colour")
    assert find_plugin("encoders", "auto") is None  # ours
    listed = clearway_with(other, here, words=("plugins", "--json"), cache=tmp_path)
    problems = {(row["name"], row["package"]): row["problem"] for row in json.loads(listed.stdout) if row["problem"]}
    assert problems.keys() == {("mean-colour", "others"), ("mean-colour", "tiny-plugins"), ("auto", "others")}
    assert "clearway has one of this name itself" in problems["auto", "others"]


@pytest.mark.parametrize(
    ("module", "part"),
    [
        ("raise SystemError('out of\\norder')", r"others:Made cannot be imported \(SystemError: out of order\)"),
        ("Other = 3", "others:Made cannot be imported"),
        ("raise SystemExit(0)", r"others:Made cannot be imported \(SystemExit: 0\)"),
        ("Made = 3", r"cannot be made \(TypeError"),
        ("class Made: pass", "its identity is None, expected a text"),
        ("class Made: identity = 'a'; feature_count = 0", "its feature_count is 0"),
        ("class Made: identity = 'a'; feature_count = 2", "has no method encode"),
    ],
)
def test_a_broken_encoder_is_named_with_its_package_and_the_remedy(tmp_path, monkeypatch, module, part) -> None:
    monkeypatch.syspath_prepend(str(offer(tmp_path, "encoders", "odd = others:Made", module)))
    sys.modules.pop("others", None)
    with pytest.raises(PluginError, match=part) as caught:
        encode_scenes([grid_scene(1)], "odd")
    assert "encoder odd of the package others 1.2" in str(caught.value)
    assert "uninstall others" in str(caught.value) and "\n" not in str(caught.value)
    sys.modules.pop("others", None)


@pytest.mark.parametrize(
    ("returned", "part"),
    [
        ("numpy.zeros((len(pictures), 3))", r"float64 \(\d+, 3\), expected floats \(\d+, 2\)"),
        ("numpy.zeros((len(pictures), 2), complex)", "complex128"),
        ("numpy.full((len(pictures), 2), numpy.nan)", "NaN or Inf"),
        ("numpy.full((len(pictures), 2), 1e300)", "NaN or Inf of a picture, in float32"),
    ],
)
def test_features_that_cannot_be_used_are_refused(tmp_path, monkeypatch, returned, part) -> None:
    module = (
        "import numpy\nclass Made:\n    identity = 'a'\n    feature_count = 2\n"
        f"    def encode(self, pictures): return {returned}"
    )
    monkeypatch.syspath_prepend(str(offer(tmp_path, "encoders", "odd = others:Made", module)))
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    sys.modules.pop("others", None)
    with pytest.raises(EncoderError, match=part):
        encode_scenes([grid_scene(1)], "odd")
    sys.modules.pop("others", None)


@pytest.mark.parametrize(
    ("module", "part"),
    [
        ("def read(path): return 3", "returned 3, expected scenes"),
        ("def read(path): return [3]", "returned 3, expected scenes"),
        ("def read(path): return 1 / 0", r"failed \(ZeroDivisionError: division by zero\)"),
        (
            f"{MADE}def read(path): return replace(corridor_scene(), observations=Dark())",
            r"failed \(OSError: lens cap\)",
        ),
    ],
)
def test_a_broken_importer_is_named(tmp_path, monkeypatch, module, part) -> None:
    monkeypatch.syspath_prepend(str(offer(tmp_path, "importers", "odd = others:read", module)))
    sys.modules.pop("others", None)
    with pytest.raises(PluginError, match=rf"importer odd of the package others 1\.2 {part}"):
        plugged_scenes("odd", [tmp_path])
    sys.modules.pop("others", None)


@pytest.mark.parametrize(
    ("returned", "part"),
    [
        ("[]", r"file\.txt: the importer odd of the package others 1\.2 found no scene in it\. Give another file"),
        ("replace(corridor_scene(), graph=[[0]])", r"file\.txt: graph is of type list, expected a NumPy array"),
        ("replace(corridor_scene(), name=7)", r"file\.txt: 7 cannot be a scene's name"),
        ("replace(corridor_scene(), encoder='mine')", r"file\.txt: encoder is 'mine', expected an EncoderRecord"),
        (
            "replace(corridor_scene(), made_by=Provenance('x', notes={'a': {1}}))",
            r"file\.txt: made_by\.notes is no JSON",
        ),
        (
            "replace(corridor_scene(), encoder=EncoderRecord('x', '1', arrays={'labels': np.array(['a', 'b'])}))",
            r"file\.txt: encoder\.arrays\['labels'\] is an array of <U1, expected a NumPy array of numbers",
        ),
    ],
)
def test_an_importer_s_scenes_that_cannot_be_written_are_refused(tmp_path, monkeypatch, capsys, returned, part) -> None:
    module = f"{MADE}def read(path): return {returned}"
    monkeypatch.syspath_prepend(str(offer(tmp_path / "site", "importers", "odd = others:read", module)))
    sys.modules.pop("others", None)
    (tmp_path / "file.txt").touch()
    with pytest.raises(SystemExit) as leaving:
        main(["scenes", "import", "plugin", "odd", str(tmp_path / "file.txt"), "--out", str(tmp_path / "out")])
    (line,) = capsys.readouterr().err.splitlines()
    assert leaving.value.code == 2 and re.search(part, line)
    assert not (tmp_path / "out").exists()
    sys.modules.pop("others", None)


def test_importers_that_are_no_plugins_are_refused(tmp_path) -> None:
    with pytest.raises(PluginError, match="Use clearway scenes import mjcf"):
        plugged_scenes("mjcf", [tmp_path])
    with pytest.raises(PluginError, match="importer odd: no installed package offers one"):
        plugged_scenes("odd", [tmp_path])


@pytest.mark.slow
def test_scenes_with_features_are_written_as_they_are(tmp_path) -> None:
    module = f"import sys\nsys.path.append({str(Path(__file__).parent)!r})\nfrom helpers.made import corridor_scene\n"
    site = offer(tmp_path / "site", "importers", "made = others:read", f"{module}def read(p): return corridor_scene()")
    words = ("scenes", "import", "plugin", "made", tmp_path, "--out", tmp_path / "out")
    assert clearway_with(site, words=words, cache=tmp_path).returncode == 0
    assert np.array_equal(read_scene(tmp_path / "out/corridor.h5").features, corridor_scene().features)
    refused = clearway_with(site, words=(*words, "--encoder", "auto-2"), cache=tmp_path)
    assert refused.returncode == 2 and "gives scenes with features" in refused.stderr


def test_a_module_of_the_current_folder_stands_behind_what_is_installed(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [place for place in sys.path if place])
    Path("mine_alone.py").write_text("ANSWER = 7")
    Path("colorsys.py").write_text("raise SystemError('shadowed')")
    monkeypatch.delitem(sys.modules, "colorsys", raising=False)
    assert imported("mine_alone:ANSWER") == 7
    assert callable(imported("colorsys:rgb_to_hsv"))
    Path("leaves.py").write_text("import sys\nsys.exit(0)")
    with pytest.raises(PluginError, match=r"leaves:X: cannot be loaded \(SystemExit: 0\)"):
        imported("leaves:X")
    sys.modules.pop("mine_alone")


def test_a_plugin_says_what_it_is() -> None:
    assert str(Plugin("rewards", "dear", "tiny", "1.0", "tiny:DEAR")) == "reward dear of the package tiny 1.0"


def test_an_agent_that_sees_by_it_acts_from_its_run_folder_but_cannot_be_exported(here, tmp_path) -> None:
    scenes = encode_scenes([grid_scene(1)], "mean-colour")
    write_scene(scenes[0], tmp_path / "grid.h5")
    small = {"frames": 400, "envs": 10, "rollout_steps": 8, "width": 16}
    run = clearway.train(tmp_path / "grid.h5", [5], out=tmp_path / "run", **small)
    navigator = clearway.Navigator(run.folder, seed=0)
    navigator.set_target(scenes[0].observations[5])
    assert navigator.act(scenes[0].observations[9]).probabilities.shape == (4,)
    with pytest.raises(EncoderError, match="is another package's, which a file cannot hold"):
        export_onnx(load_run_in_scene(run.folder), tmp_path / "agent.onnx")
    assert not (tmp_path / "agent.onnx").exists()
