"""Whether scenes are rooms that can be built again and changed, and other pictures of them encoded as their own."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from clearway.errors import ClearwayError
from clearway.experiments.job import is_done
from clearway.experiments.plan import Job
from clearway.live.conditions import REFERENCE
from clearway.live.live_room import MODEL_SOURCE, check_is_room, check_movable
from clearway.live.walks import encoder_of
from clearway.scenes.scene import Scene
from clearway.views.grid import grid_settings
from clearway.views.seen import TAKES, record_for_takes


def feasible(out: Path, jobs: Iterable[Job], why: str | None) -> list[Job]:
    """All of the jobs; where something hinders them (`why`), those that are done, of which a report tells."""
    return [job for job in jobs if why is None or is_done(out, job)]


def hindrance(scenes: Iterable[Scene], *, pictured: bool = False) -> str | None:
    """Why other pictures of the scenes cannot be taken, and encoded as their own were; None where they can.

    Args:
        scenes: to be looked at.
        pictured: other pictures have to be as large as their own, so that these must be there.
    """
    try:
        for scene in scenes:
            check_is_room(scene)
            check_movable(scene.name, REFERENCE, fixed=scene.made_by.source == MODEL_SOURCE)
            if pictured:
                grid_settings(scene, REFERENCE, TAKES, seed=0).check()
                record_for_takes(scene)
            encoder_of(scene)
    except ClearwayError as error:
        return str(error)
    return None
