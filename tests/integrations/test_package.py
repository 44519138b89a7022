"""What the ROS 2 package and the container files name is there, and says the same everywhere."""

import ast
import json
import re
import runpy
import sys
import tomllib
from types import ModuleType, SimpleNamespace
from xml.etree import ElementTree

import pytest

from clearway.cli.main import main
from clearway.cli.serve import Serve
from helpers.documents import ROOT
from helpers.ros_stand_in import stand_in

FOLDER = ROOT / "integrations/ros2"
CONTAINERS = [ROOT / "Containerfile", FOLDER / "Containerfile"]
NAMES = ["service", "ros2"]


def instructions(path):
    """(word, rest) of a container file."""
    text = re.sub(r"\\\n", " ", re.sub(r"^#.*\n", "", path.read_text(), flags=re.MULTILINE))
    return [tuple(line.split(maxsplit=1)) for line in text.splitlines() if line.strip()]


@pytest.mark.parametrize("path", CONTAINERS, ids=NAMES)
def test_a_container_file_copies_what_there_is_and_what_the_package_needs(path) -> None:
    copied = [word for name, rest in instructions(path) if name == "COPY" for word in rest.split()[:-1]]
    assert [name for name in copied if not (ROOT / name).exists()] == []
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    included = project["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    assert {"pyproject.toml", "src", project["project"]["readme"], "LICENSE", *included} <= set(copied)
    taken = {line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    assert set(copied) <= taken
    extras = re.findall(r'"\.\[(\w+)\]"|locked/(?:torch-cpu|(\w+))\.txt', path.read_text())
    extras = {name for pair in extras for name in pair if name}
    assert extras and extras <= set(project["project"]["optional-dependencies"])
    users = [rest for name, rest in instructions(path) if name == "USER"]
    assert users == ["clearway"]


def test_the_service_s_container_runs_a_command_that_there_is_and_asks_a_route_that_there_is(clearway_words) -> None:
    found = dict(instructions(CONTAINERS[0]))
    words = [*json.loads(found["ENTRYPOINT"]), *json.loads(found["CMD"])]
    served = clearway_words(words[1:])
    assert (served.host, served.port, str(served.agent)) == ("0.0.0.0", int(found["EXPOSE"]), "generalist")
    asked = re.search(r"http://127\.0\.0\.1:(\d+)(/\w+)", found["HEALTHCHECK"])
    assert asked[1] == found["EXPOSE"]
    assert f'@app.get("{asked[2]}"' in (ROOT / "src/clearway/serve/app.py").read_text()


@pytest.fixture
def clearway_words(monkeypatch):
    """What a command line of ours is read as."""

    def read(words):
        kept = []
        monkeypatch.setattr(Serve, "run", lambda self: kept.append(self))
        with pytest.raises(SystemExit) as ended:
            main(words)
        assert ended.value.code == 0
        return kept[0]

    return read


def test_the_package_s_files_are_there_and_its_program_is_the_node(monkeypatch) -> None:
    given = {}
    monkeypatch.setattr("setuptools.setup", lambda **kwargs: given.update(kwargs))
    runpy.run_path(str(FOLDER / "setup.py"))
    assert [name for _, names in given["data_files"] for name in names if not (FOLDER / name).exists()] == []
    program, _, place = given["entry_points"]["console_scripts"][0].partition(" = ")
    assert place == "clearway_ros.node:main"
    assert f'executable="{program}"' in (FOLDER / "launch/clearway.launch.py").read_text()
    package = ElementTree.parse(FOLDER / "package.xml").getroot()
    assert package.findtext("name") == given["name"] and package.findtext("version") == given["version"]
    assert f"lib/{given['name']}" in (FOLDER / "setup.cfg").read_text()


def test_the_package_depends_on_what_it_imports() -> None:
    package = ElementTree.parse(FOLDER / "package.xml").getroot()
    depends = {part.text for part in package.findall("exec_depend")}
    imported = set()
    for path in (*FOLDER.glob("clearway_ros/*.py"), *FOLDER.glob("launch/*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                imported.add(node.module.partition(".")[0])
            elif isinstance(node, ast.Import):
                imported |= {alias.name.partition(".")[0] for alias in node.names}
    by_pip = {"clearway", "clearway_ros", "numpy", "PIL", "ament_index_python"}  # the last comes with launch_ros
    assert imported - set(sys.stdlib_module_names) - by_pip == depends


def parameters_of_the_file():
    lines = (FOLDER / "config/clearway.yaml").read_text().splitlines()[2:]
    pairs = dict(line.strip().split(": ") for line in lines)
    return {
        name: json.loads(value) if re.match(r"true|false|[\d.-]+$", value) else value for name, value in pairs.items()
    }


def test_the_file_of_parameters_is_what_the_node_declares(monkeypatch) -> None:
    stand_in(monkeypatch)
    from clearway_ros import node

    declared = {**node.OWN, **dict(node.DRIVE), **dict(node.PATIENCE)}
    found = parameters_of_the_file()
    assert found == {name: declared[name] for name in found}
    assert {name: type(value) for name, value in found.items()} == {name: type(declared[name]) for name in found}
    assert declared.keys() - found.keys() == {"agent", "scene", "seed", "target"}
    readme = (FOLDER / "README.md").read_text()
    assert [name for name in declared if f"`{name}`" not in readme] == []


def test_the_launch_file_starts_the_node_with_its_topics(monkeypatch) -> None:
    made = {
        "launch": {"LaunchDescription": lambda parts: parts},
        "launch.actions": {"DeclareLaunchArgument": lambda name, **given: SimpleNamespace(name=name, **given)},
        "launch.substitutions": {"LaunchConfiguration": lambda name: f"${name}"},
        "launch_ros": {},
        "launch_ros.actions": {"Node": SimpleNamespace},
        "launch_ros.parameter_descriptions": {"ParameterValue": lambda value, value_type: value},
        "ament_index_python": {},
        "ament_index_python.packages": {"get_package_share_directory": lambda name: str(FOLDER)},
    }
    for name, contents in made.items():
        module = ModuleType(name)
        vars(module).update(contents)
        monkeypatch.setitem(sys.modules, name, module)
    *declared, node = runpy.run_path(str(FOLDER / "launch/clearway.launch.py"))["generate_launch_description"]()
    stand_in(monkeypatch)
    assert dict(node.remappings)["image"] == "$image" and dict(node.remappings)["cmd_vel"] == "$cmd_vel"
    assert node.parameters == ["$config", {"agent": "$agent", "target": "$target"}]
    usual = {part.name: getattr(part, "default_value", None) for part in declared}
    assert usual["agent"] is None  # has to be given
    assert usual["config"] == str(FOLDER / "config/clearway.yaml")
