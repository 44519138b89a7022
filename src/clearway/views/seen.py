"""Perturbed takes of scenes' grids, as agents see them: pictures, or features of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from clearway.agents.agent import FEATURES
from clearway.learn.seeds import SEED_LIMIT
from clearway.live.conditions import Perturbations, label_of
from clearway.scenes.scene import EncoderRecord, Scene
from clearway.scenes.sensors import RGB

if TYPE_CHECKING:
    from clearway.evaluation.takes import Takes
    from clearway.perception.encoder import Encoder

TAKES = 4  # of each pose, where nobody says how many


def seed_in_training(seed: int) -> int:
    """Seed of the takes that a run of a seed is trained on: no pictures that an evaluation with the same seed sees."""
    return SEED_LIMIT - 1 - seed


def takes_made(perturbations: Perturbations, takes: int) -> dict[str, object]:
    """How so many takes of each pose are made, see `Takes.made`."""
    return {"label": label_of(perturbations), "perturbations": perturbations.to_json(), "takes": takes}


def made_in_training(perturbations: Perturbations, takes: int, seed: int) -> dict[str, object]:
    """How the takes are made that a run of a seed is trained on, as its record has it."""
    return {**takes_made(perturbations, takes), "seed": seed}


def takes_seen(
    scenes: Sequence[Scene],
    perturbations: Perturbations,
    sees: Sequence[str],
    encoder: Encoder | None,
    *,
    takes: int,
    seed: int,
    workers: int | None = None,
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
        workers: processes that take pictures, a room at a time each; None: one a core.
        show_progress: draw a progress bar, if standard error is a terminal.

    Raises:
        ArgumentError, SceneError, RenderError: as of `views.grid.grid_takes`.
        EncoderError: the scenes' encoder cannot be had, or takes no colour pictures.
    """
    from clearway.evaluation.takes import Takes
    from clearway.progress import work_progress
    from clearway.views.grid import grid_takes

    made = takes_made(perturbations, takes)
    seen: dict[str, list[np.ndarray]] = {name: [] for name in (RGB, FEATURES) if name in sees}
    if not seen:
        return Takes(takes, seen, made)
    encode = _encoding(scenes, encoder) if FEATURES in seen else None
    with work_progress("taking perturbed pictures", len(scenes), show_progress, unit="scenes") as show_done:
        for pictures in grid_takes(scenes, perturbations, takes=takes, seed=seed, workers=workers, done=show_done):
            if RGB in seen:
                seen[RGB].append(pictures)
            if encode is not None:
                features = encode(pictures.reshape(-1, *pictures.shape[2:]))
                seen[FEATURES].append(features.reshape(-1, takes, features.shape[1]))
    return Takes(takes, seen, made)


def _encoding(scenes: Sequence[Scene], encoder: Encoder | None) -> Callable[[np.ndarray], np.ndarray]:
    """What makes features (N, F) of N pictures; those by the scenes' encoder are kept.

    Raises:
        EncoderError: theirs is unknown, cannot be had or takes no colour pictures.
    """
    from clearway.perception.encode import encoder_from_record, features_of, kept_features

    if encoder is not None:
        return partial(features_of, encoder=encoder)
    return partial(kept_features, encoder=encoder_from_record(record_for_takes(scenes[0])))


def record_for_takes(scene: Scene) -> EncoderRecord:
    """What encodes perturbed takes of a scene. Raises EncoderError where it is unknown or takes no colour pictures."""
    from clearway.perception.encoder import colour_encoder_record

    return colour_encoder_record(scene, "perturbed takes", "Leave perturb out")
