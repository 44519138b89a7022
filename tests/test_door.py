"""`import clearway`: what it offers, what it costs, and Gymnasium's knowledge of it."""

import os
import pydoc
import shutil
import subprocess
import sys
import tomllib
from importlib.util import find_spec
from pathlib import Path

import pytest

import clearway
from helpers.documents import ROOT
from helpers.imported import imported_by
from helpers.made import corridor_scene

OFFERED = {
    "load_scene",
    "load_scenes",
    "build_room",
    "encode_scenes",
    "make_env",
    "train",
    "evaluate",
    "load_agent",
    "Reward",
    "Learner",
    "Navigator",
}
MAKE = """
import gymnasium
env = gymnasium.make("Clearway/ImageGoal-v0", scenes={scene!r})
print(env.reset(seed=0)[1]["distance_to_go"])
"""


def test_every_name_can_be_had_and_is_shown() -> None:
    assert set(clearway.__all__) >= OFFERED
    assert set(clearway.__all__) == {*clearway._HOME, "__version__"}
    assert set(dir(clearway)) >= set(clearway.__all__)
    assert not {"TYPE_CHECKING", "_HOME", "_from_home", "register_with_gymnasium"} & set(dir(clearway))
    for name in clearway.__all__:
        assert getattr(clearway, name).__doc__
    shown = pydoc.plain(pydoc.render_doc(clearway))
    for name in OFFERED:
        assert f"{name}(" in shown, name


def test_what_is_not_offered_is_refused() -> None:
    with pytest.raises(AttributeError, match="module 'clearway' has no attribute 'trian'"):
        clearway.trian  # noqa: B018


def test_importing_it_is_light() -> None:
    found = imported_by("import clearway; dir(clearway)")
    heavy = {"numpy", "gymnasium", "torch", "h5py", "scipy", "typing", "pathlib", "dataclasses", "importlib.metadata"}
    assert {name for name in found if name.startswith("clearway")} == {
        "clearway",
        "clearway.gymnasium_hook",
        "clearway.version",
    }
    assert not heavy & (found - imported_by("pass"))


@pytest.mark.parametrize("first", ["gymnasium, clearway", "clearway, gymnasium", "clearway.envs, gymnasium"])
def test_gymnasium_knows_the_environment_whichever_is_imported_first(first) -> None:
    program = f"import {first}, sys\nprint('Clearway/ImageGoal-v0' in gymnasium.registry, 'torch' in sys.modules)"
    assert python(program, ROOT / "src") == "True False\n"


def test_importing_gymnasium_finds_its_own_faults(tmp_path) -> None:
    """A registry that cannot be loaded fails as it would without us."""
    folder = tmp_path / "gymnasium/envs"
    folder.mkdir(parents=True)
    (tmp_path / "gymnasium/__init__.py").write_text("import gymnasium.envs.registration\n")
    (folder / "__init__.py").write_text("")
    (folder / "registration.py").write_text("raise ImportError('out of order')\n")
    program = "import clearway\ntry:\n    import gymnasium\nexcept ImportError as error:\n    print(error)"
    assert python(program, tmp_path, ROOT / "src") == "out of order\n"


def python(program: str, *paths: Path) -> str:
    """What a program prints, with these folders before all others on its path."""
    places = os.pathsep.join(map(str, paths))
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**environment, "PYTHONPATH": places},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package as installed: by pip where the build backend is here, else as that lays it out."""
    folder = tmp_path_factory.mktemp("site")
    if find_spec("hatchling"):
        command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation"]
        subprocess.run([*command, "--target", folder, ROOT], check=True, timeout=300)
        return folder
    wheel = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    for package in wheel["packages"]:
        shutil.copytree(ROOT / package, folder / Path(package).name)
    for source, place in wheel["force-include"].items():
        shutil.copy(ROOT / source, folder / place)
    return folder


@pytest.mark.slow
def test_once_installed_gymnasium_makes_it_without_being_told(installed, tmp_path) -> None:
    from clearway.scenes.thor_v1 import write_scene

    path = tmp_path / "corridor.h5"
    write_scene(corridor_scene(), path)
    as_site_packages = f"import site\nsite.addsitedir({str(installed)!r})\n"  # which reads the .pth files there
    said = python(as_site_packages + MAKE.format(scene=str(path)), installed)
    assert int(said) > 0


def test_gymnasium_is_found_however_it_is_installed() -> None:
    """An editable installation may bring a finder of its own."""
    program = (
        "import sys, clearway\nfrom importlib.machinery import PathFinder\n"
        "class Own:\n    @staticmethod\n    def find_spec(name, path=None, target=None):\n"
        "        return PathFinder.find_spec(name, path, target) if name.startswith('gymnasium') else None\n"
        "sys.meta_path = [finder for finder in sys.meta_path if finder is not PathFinder] + [Own, PathFinder]\n"
        "import gymnasium\nprint('Clearway/ImageGoal-v0' in gymnasium.registry)"
    )
    assert python(program, ROOT / "src") == "True\n"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: clearway.Navigator(5), "source is 5, expected an ONNX file"),
        (lambda: clearway.build_room("bathroom", sensors=None), "None is no list of names"),
        (lambda: clearway.build_room("bathroom", sensors=[["a"]]), "there is no"),
    ],
)
def test_wrong_types_at_the_door_are_one_clear_error(call, message) -> None:
    with pytest.raises(clearway.ClearwayError, match=message):
        call()


def test_an_encoder_of_one_s_own_that_fails_is_named() -> None:
    class Broken:
        name, identity, feature_count = "broken", "broken-1", 3

        def encode(self, pictures):
            raise KeyError("spoon")

    with pytest.raises(clearway.ClearwayError, match=r"encoder broken: failed .KeyError: 'spoon'"):
        clearway.encode_scenes(corridor_scene(), Broken())
