"""A run is exported to the cache once, and again when the file is damaged."""

import shutil
from pathlib import Path

import pytest

from clearway.deploy import cached


@pytest.mark.slow
def test_a_run_is_exported_once_and_again_when_the_file_is_damaged(deployed, tmp_path, monkeypatch) -> None:
    exported: list[Path] = []

    def export(chosen, path: Path) -> None:
        exported.append(path)
        shutil.copy(deployed.agent, path)

    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path))
    monkeypatch.setattr(cached, "export_onnx", export)
    told: list[str] = []
    for _ in range(2):
        assert cached.cached_agent(deployed.chosen, told.append).card.scene == "cellar"
    assert told == ["exporting the agent for scene cellar, once ..."]
    (path,) = exported
    assert path.parent == tmp_path / "agents" and path.name.startswith("cellar-")
    path.write_bytes(path.read_bytes()[:-1])
    assert cached.cached_agent(deployed.chosen, told.append).card.scene == "cellar"
    assert exported == [path, path]


def test_another_agent_has_another_file(deployed) -> None:
    key = cached._key(deployed.chosen)
    weight = deployed.chosen.trained.network.output_bias.data
    before = float(weight[0, 0])
    weight[0, 0] = before + 1e-6
    changed = cached._key(deployed.chosen)
    weight[0, 0] = before
    assert changed != key
    assert cached._key(deployed.chosen) == key


@pytest.mark.parametrize("package", ["agents", "deploy", "model", "perception"])
def test_other_code_of_what_is_exported_makes_another_file(deployed, monkeypatch, package) -> None:
    key = cached._key(deployed.chosen)
    read = Path.read_bytes

    def changed(path: Path) -> bytes:
        return read(path) + (b"# new" if path.parent.name == package else b"")

    monkeypatch.setattr(Path, "read_bytes", changed)
    assert cached._key(deployed.chosen) != key


def test_another_version_makes_another_file(deployed, monkeypatch) -> None:
    key = cached._key(deployed.chosen)
    monkeypatch.setattr(cached, "__version__", "99", raising=False)
    assert cached._key(deployed.chosen) != key
