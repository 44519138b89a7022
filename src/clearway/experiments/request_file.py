"""The file in which a folder keeps what was asked of it: what joins it, and what takes its place."""

from __future__ import annotations

import json
import warnings
from dataclasses import asdict, replace
from pathlib import Path

from clearway.errors import RunError, reason_of
from clearway.experiments.budget import BUDGETS
from clearway.experiments.catalogue import in_order
from clearway.experiments.request import ReproduceRequest
from clearway.experiments.rewards import NAME as REWARDS_EXPERIMENT
from clearway.experiments.setting import changed_learners
from clearway.files import locked, read_json, written_whole

REQUEST_FILE = "reproduction.json"
HOW_NOT_WHAT = ("out", "workers", "threads", "ray")  # parts of a request that a report does not depend on
WHO_ASKED = ("names", "commands", "packages", "rewards")  # parts that may differ between requests of one report


def read_request(out: Path) -> ReproduceRequest:
    """What the folder keeps.

    Raises:
        RunError: there is none, or it is not readable.
    """
    path = out / REQUEST_FILE
    try:
        content = read_json(path)
        dumps = [out / dump for dump in content.pop("dumps")]  # a record's lie in the folder
        content["names"] = list(dict.fromkeys(content["names"]))  # each once, however it was kept
        if REWARDS_EXPERIMENT not in content["names"] or not content.get("rewards"):
            content["rewards"] = None  # also where it was kept as an empty list, or as the names of the default
        return ReproduceRequest(out=out, dumps=dumps, **content)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise RunError(f"{out}: no reproduction here. Name a folder that clearway reproduce made") from error
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise RunError(f"{path}: not readable ({error}). Run clearway reproduce on the folder again") from error


def keep_request(request: ReproduceRequest) -> None:
    """Write the file: what is asked, and what was asked before where both stand in one report.

    Warns where the last request asks something else, or cannot be read, so that its report is replaced.
    """
    kept = request.out / REQUEST_FILE
    with locked(kept), written_whole(kept) as part:  # none of two that begin together is lost
        _warn_of_another(request)
        part.write_text(json.dumps(_request_json(with_earlier(request)), indent=2) + "\n", encoding="utf-8")


def with_earlier(request: ReproduceRequest) -> ReproduceRequest:
    """The request, and the experiments that the folder's last one asked for where all else is alike."""
    try:
        earlier, same = _earlier(request)
    except RunError:
        same = False
    if not same:
        ordered = in_order(request.names)
        return request if ordered == list(request.names) else replace(request, names=ordered)
    names = {*earlier.names, *request.names}
    commands = dict.fromkeys((*earlier.commands, *request.commands))
    packages = {**earlier.packages, **request.packages}
    rewards = request.rewards if REWARDS_EXPERIMENT in request.names else earlier.rewards
    return replace(request, names=in_order(names), rewards=rewards, commands=tuple(commands), packages=packages)


def _earlier(request: ReproduceRequest) -> tuple[ReproduceRequest, bool]:
    """The folder's last request, and whether it asks the same.

    Raises:
        RunError: there is none, or none that could be gone on with.
    """
    earlier = read_request(request.out)
    same = _question(request) == _question(earlier)
    if same and all(REWARDS_EXPERIMENT in asked.names for asked in (request, earlier)):
        same = list(request.compared) == list(earlier.compared)
    return earlier, same


def _warn_of_another(request: ReproduceRequest) -> None:
    if not (request.out / REQUEST_FILE).exists():
        return
    try:
        earlier, same = _earlier(request)
    except RunError as fault:
        held = f"a reproduction that cannot be gone on with ({reason_of(fault)})"
    else:
        if same:
            return
        first, count = earlier.first_seed, earlier.seeds or BUDGETS[earlier.budget].seeds
        seeds = f"seed {first}" if count == 1 else f"seeds {first} to {first + count - 1}"
        held = f"a reproduction of {', '.join(earlier.names)}, {seeds}"
    told = f"{request.out} held {held}; this one takes its place in the report"
    warnings.warn(f"{told}. Its runs stay; use another --out to keep both", stacklevel=4)


def _question(request: ReproduceRequest) -> str:
    """All of a request that must agree for its experiments to stand in one report, defaults filled in."""
    budget = BUDGETS[request.budget].changed(request.rooms, request.frames)
    learners = changed_learners(request.learners, budget, request.changes)
    content = _request_json(request) | {
        "budget": asdict(budget),
        "rooms": None,
        "frames": None,
        "seeds": request.seeds or budget.seeds,
        "learners": {name: asdict(learner) for name, learner in learners.items()},
        "changes": None,
    }
    return json.dumps({name: value for name, value in content.items() if name not in WHO_ASKED}, sort_keys=True)


def _request_json(request: ReproduceRequest) -> dict[str, object]:
    content = {name: value for name, value in asdict(request).items() if name not in HOW_NOT_WHAT}
    return {**content, "dumps": [str(dump.resolve()) for dump in request.dumps]}
