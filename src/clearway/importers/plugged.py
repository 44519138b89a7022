"""Importers of other packages (`clearway.plugins`).

An entry point of the group `clearway.importers` is a function that takes a `pathlib.Path`, a file or a folder, and
returns a `Scene` or several, with pictures or with features and the record of their encoder. Bad input it tells by a
`ClearwayError`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from clearway.errors import ClearwayError, PluginError
from clearway.plugins import BUILT_IN, load_plugin, plugin_of
from clearway.scenes.scene import Scene
from clearway.scenes.validate import check_scene


def plugged_scenes(name: str, files: Sequence[Path]) -> list[Scene]:
    """The scenes that the importer of that name makes of some files or folders.

    Raises:
        PluginError: there is no such importer, it cannot be imported, it fails, or returns something else.
        SceneError: a scene of it is unsound.
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
        except ClearwayError:
            raise
        except Exception as fault:  # another's code, as in load_plugin
            reason = f"{type(fault).__name__}: {' '.join(str(fault).split())[:200]}"
            raise PluginError(f"{file}: the {plugin} failed ({reason}). Check the file, or ask its authors") from fault
        for scene in given:
            if not isinstance(scene, Scene):
                raise PluginError(f"the {plugin} returned {scene!r:.40}, expected scenes. Ask its authors")
            check_scene(scene, file)
        scenes += given
    return scenes
