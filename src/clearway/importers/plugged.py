"""Importers of other packages (`clearway.plugins`).

An entry point of the group `clearway.importers` is a function that takes a `pathlib.Path`, a file or a folder, and
returns a `Scene` or several, with pictures or with features and the record of their encoder. Bad input it tells by a
`ClearwayError`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from clearway.errors import ClearwayError, PluginError, kind_and_reason
from clearway.plugins import BUILT_IN, Plugin, load_plugin, plugin_of
from clearway.scenes.parts import check_records
from clearway.scenes.scene import Scene
from clearway.scenes.validate import check_scene


def plugged_scenes(name: str, files: Sequence[Path]) -> list[Scene]:
    """The scenes that the importer of that name makes of some files or folders.

    Raises:
        PluginError: there is no such importer, it cannot be imported, it fails, or returns something else.
        SceneError: a scene of it is unsound.
        ClearwayError: there is no such file, or no scene in it.
    """
    if name in BUILT_IN["importers"]:
        raise PluginError(f"importer {name}: is no plugin. Use clearway scenes import {name}")
    plugin = plugin_of("importers", name)
    read = load_plugin(plugin)
    scenes: list[Scene] = []
    for file in files:
        if not file.exists():
            raise ClearwayError(f"{file}: no such file. Check the path")
        try:
            found = read(file)  # type: ignore[operator]
            given = [found] if isinstance(found, Scene) else list(found) if isinstance(found, Iterable) else [found]
            for scene in given:
                _check(scene, plugin, file)
        except ClearwayError:
            raise
        except (Exception, SystemExit) as fault:  # another's code, as in load_plugin
            reason = kind_and_reason(fault)
            raise PluginError(f"{file}: the {plugin} failed ({reason}). Check the file, or ask its authors") from fault
        if not given:
            raise ClearwayError(f"{file}: the {plugin} found no scene in it. Give another file")
        scenes += given
    return scenes


def _check(scene: object, plugin: Plugin, file: Path) -> None:
    """Raise PluginError or SceneError where it is no sound scene, of which a file can be written."""
    if not isinstance(scene, Scene):
        raise PluginError(f"the {plugin} returned {scene!r:.40}, expected scenes. Ask its authors")
    check_scene(scene, file)
    check_records(scene, file)
    if scene.observations is not None:
        scene.observations[:1]  # of what is read on demand, whether it can be
