"""Perturbed takes of scenes' grids, for what an agent sees."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from clearway.agents.agent import FEATURES
from clearway.errors import ArgumentError
from clearway.live.conditions import Perturbations, label_of
from clearway.scenes.scene import Scene
from clearway.scenes.sensors import RGB

if TYPE_CHECKING:
    from clearway.evaluation.takes import Takes
    from clearway.perception.encoder import Encoder

TAKES = 4  # of each pose, where nobody says how many

Perturbed: TypeAlias = str | Sequence[str] | Perturbations
"""What is perturbed: words, "geometry light=0.2" or ("geometry", "light=0.2"), or strengths."""


def perturbations_asked(perturb: Perturbed) -> Perturbations:
    """The perturbations asked for. Raises ArgumentError where there are none of that name, or of that strength."""
    from clearway.errors import EnvError
    from clearway.live.words import perturbations_named
    from clearway.live_envs.arguments import checked_perturbations

    if isinstance(perturb, Perturbations):
        try:
            return checked_perturbations(perturb)
        except EnvError as fault:
            raise ArgumentError(f"perturb: {fault}") from fault
    return perturbations_named(perturb.split() if isinstance(perturb, str) else perturb)


def takes_made(perturbations: Perturbations, takes: int) -> dict[str, object]:
    """How so many takes of each pose are made, see `Takes.made`."""
    return {"label": label_of(perturbations), "perturbations": perturbations.to_json(), "takes": takes}


def takes_seen(
    scenes: Sequence[Scene],
    perturbations: Perturbations,
    sees: Sequence[str],
    encoder: Encoder | None,
    *,
    takes: int,
    seed: int,
    show_progress: bool = False,
) -> Takes:
    """Takes of all poses, taken where they are not kept, as an agent sees them.

    Args:
        scenes: with colour pictures, of rooms that can be built again.
        perturbations: how strong they are.
        sees: what the agent sees: pictures, features of them by the encoder, or both. Of others there are none.
        encoder: that of the features; None: that of the scenes.
        takes: of each pose.
        seed: of all chances.
        show_progress: draw a progress bar, if standard error is a terminal.

    Raises:
        ArgumentError, SceneError, RenderError: as of `views.grid.grid_takes`.
        EncoderError: the scenes' encoder cannot be had, or takes no colour pictures.
    """
    from clearway.evaluation.takes import Takes
    from clearway.perception.encode import features_of
    from clearway.progress import work_progress
    from clearway.views.grid import grid_takes

    made = takes_made(perturbations, takes)
    seen: dict[str, list[np.ndarray]] = {name: [] for name in (RGB, FEATURES) if name in sees}
    if not seen:
        return Takes(takes, seen, made)
    by = (encoder or _encoder_of(scenes)) if FEATURES in seen else None
    with work_progress("taking perturbed pictures", len(scenes), show_progress, unit="scenes") as show_done:
        for pictures in grid_takes(scenes, perturbations, takes=takes, seed=seed, done=show_done):
            if RGB in seen:
                seen[RGB].append(pictures)
            if by is not None:
                features = features_of(pictures.reshape(-1, *pictures.shape[2:]), by)
                seen[FEATURES].append(features.reshape(-1, takes, features.shape[1]))
    return Takes(takes, seen, made)


def _encoder_of(scenes: Sequence[Scene]) -> Encoder:
    """What made the scenes' features. Raises EncoderError where it is unknown or takes no colour pictures."""
    from clearway.errors import EncoderError
    from clearway.perception.encode import encoder_from_record
    from clearway.perception.encoder import sensor_of

    record = scenes[0].encoder
    if record is None:
        problem = f"scene {scenes[0].name} has no features by a known encoder, and the agent sees features"
        raise EncoderError(f"{problem}. Encode the scenes: clearway scenes encode FILES --out FOLDER")
    if (seen := sensor_of(record)) != RGB:
        problem = f"encoder {record.name} sees {seen}, and perturbed takes are colour pictures"
        raise EncoderError(f"{problem}. Leave perturb out")
    return encoder_from_record(record)
