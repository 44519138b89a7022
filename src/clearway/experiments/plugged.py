"""Experiments of other packages (`clearway.plugins`), behind checks of what they give.

An entry point of the group `clearway.experiments` is an `Experiment`, whose section has the entry point's name.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import get_args

from clearway.errors import ClearwayError, PluginError, kind_and_reason
from clearway.experiments.experiment import Experiment
from clearway.experiments.plan import Job
from clearway.experiments.section import Claim, ReportFigure, ReportMap, ReportTable, Section, Verdict
from clearway.experiments.setting import Setting
from clearway.plugins import Plugin, load_plugin, place_in
from clearway.scenes.parts import is_name

PARTS = {"tables": ReportTable, "figures": ReportFigure, "maps": ReportMap, "claims": Claim}


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
            fault = _fault(given, plugin.name, [scene.name for scene in setting.scenes])
        if fault:
            raise PluginError(f"{plugin}: {fault}. Ask its authors")
        return given

    return Experiment(jobs, section)


def _fault(section: object, name: str, scenes: Sequence[str]) -> str:
    """Why it is no section of that name that a report of some scenes can hold; empty where it is one."""
    if not isinstance(section, Section):
        return f"section gives {section!r:.60}, expected a Section"
    if section.name != name:
        return f"its section is called {section.name!r:.40}, expected {name!r}"
    for called, kind in PARTS.items():
        given = getattr(section, called)
        if not isinstance(given, tuple) or not all(isinstance(part, kind) for part in given):
            return f"its section's {called} are {given!r:.60}, expected a tuple of {kind.__name__}"
    texts = (section.title, section.text, section.unjudged, *(claim.text for claim in section.claims))
    if others := [text for text in texts if not isinstance(text, str)]:
        return f"its section has {others[0]!r:.60} where a text is expected"
    if wrong := [part.name for part in (*section.tables, *section.pictures) if not is_name(part.name)]:
        return f"no file can be called {wrong[0]!r:.60}, as a table or figure is"
    verdicts = get_args(Verdict)
    if odd := [claim for claim in section.claims if claim.verdict not in verdicts or not _is_share(claim.p)]:
        told = f"its claim {odd[0].text!r:.60} has verdict {odd[0].verdict!r:.40} and p {odd[0].p!r:.40}"
        return f"{told}, expected one of {', '.join(verdicts)}, and from 0 to 1 or None"
    if bare := [claim.text for claim in section.claims if claim.verdict != "undecided" and not claim.judged]:
        return f"its claim {bare[0]!r:.60} has a verdict, and neither p nor that it was counted"
    if empty := [figure.name for figure in section.figures if not figure.series]:
        return f"its figure {empty[0]!r:.60} has no series"
    if strange := [shown.scene for shown in section.maps if shown.scene not in scenes]:
        return f"it has a map of {strange[0]!r:.60}, expected one of {', '.join(scenes)}"
    return ""


def _is_share(p: object) -> bool:
    """It is None, or a number from 0 to 1."""
    return p is None or (isinstance(p, float | int) and 0 <= p <= 1)


@contextmanager
def _faults_of(plugin: Plugin, what: str) -> Iterator[None]:
    try:
        yield
    except ClearwayError:
        raise
    except (Exception, SystemExit) as fault:  # another's code: anything can come of it; the user is told whose
        told = f"{what} failed ({kind_and_reason(fault)}){place_in(plugin, fault)}"
        raise PluginError(f"{plugin}: {told}. Ask its authors") from fault
