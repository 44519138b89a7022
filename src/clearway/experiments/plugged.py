"""Experiments of other packages (`clearway.plugins`), behind checks of what they give.

An entry point of the group `clearway.experiments` is an `Experiment`. Its section has its name. So have tables, figures
and maps, which are files of the report; behind it may come an underscore and more.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from clearway.errors import ClearwayError, PluginError, kind_and_reason
from clearway.experiments.experiment import Experiment
from clearway.experiments.plan import Job
from clearway.experiments.section import Section
from clearway.experiments.setting import Setting
from clearway.plugins import Plugin, load_plugin
from clearway.scenes.parts import is_name


def plugged_experiment(plugin: Plugin) -> Experiment:
    """The experiment that a plugin is; what it raises is told as its fault, a `PluginError` in one line.

    Raises:
        PluginError: it cannot be imported, or is none.
    """
    found = load_plugin(plugin)
    if not isinstance(found, Experiment):
        wanted = "expected an Experiment (clearway.experiments.experiment)"
        raise PluginError(f"{plugin}: is {found!r:.60}, {wanted}. Ask its authors")

    def jobs(setting: Setting) -> list[Job]:
        with _faults_of(plugin, "jobs"):
            given = list(found.jobs(setting))
        if others := [job for job in given if not isinstance(job, Job)]:
            raise PluginError(f"{plugin}: jobs gives {others[0]!r:.60}, expected jobs. Ask its authors")
        return given

    def section(setting: Setting) -> Section:
        with _faults_of(plugin, "section"):
            given = found.section(setting)
        if not isinstance(given, Section):
            raise PluginError(f"{plugin}: section gives {given!r:.60}, expected a Section. Ask its authors")
        if given.name != plugin.name:
            raise PluginError(f"{plugin}: its section is called {given.name!r:.40}. Call it {plugin.name!r}")
        for files in (given.tables, given.pictures):
            _check_names([part.name for part in files], plugin)
        return given

    return Experiment(jobs, section)


def _check_names(names: list[str], plugin: Plugin) -> None:
    """Raise PluginError where one is not the plugin's own, or no file can be called so, or two are called so."""
    for place, name in enumerate(names):
        if name != plugin.name and not name.startswith(f"{plugin.name}_"):
            wanted = f"Call it {plugin.name!r}, or {plugin.name + '_'!r} and more"
            raise PluginError(f"{plugin}: a table or figure is called {name!r:.60}, as another's may be. {wanted}")
        if not is_name(name) or name in names[:place]:
            raise PluginError(f"{plugin}: two tables or figures, or no file, can be called {name!r:.60}. Rename it")


@contextmanager
def _faults_of(plugin: Plugin, what: str) -> Iterator[None]:
    try:
        yield
    except ClearwayError:
        raise
    except Exception as fault:  # another's code: anything can come of it, and the user has to be told whose it is
        raise PluginError(f"{plugin}: {what} failed ({kind_and_reason(fault)}). Ask its authors") from fault
