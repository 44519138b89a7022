"""The loop of a pretraining: batches of views, updates of the eyes, figures and checkpoints; it goes on bit for bit.

What an update does follows from the settings, the seed and its own number alone: which pictures, under which light,
compared with which. So a checkpoint holds the network, the optimiser and that number.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from clearway.choices import TrackerName
from clearway.errors import ArgumentError, RunError
from clearway.learn.checkpoint import (
    Progress,
    newest_checkpoint,
    read_network,
    read_progress,
    read_training,
    write_checkpoint,
)
from clearway.learn.interruption import interruption
from clearway.learn.metrics_log import MetricsLog
from clearway.learn.optimiser import clip_gradients
from clearway.learn.tracking import check_tracker, tracker_of
from clearway.model.precision import multiplies_bfloat16
from clearway.perception.eyes import EyesEncoder
from clearway.perception.eyes_network import Eyes
from clearway.pretraining.ahead import made_ahead
from clearway.pretraining.augment import relit, standardised
from clearway.pretraining.eyes_folder import EyesFolder, record_of
from clearway.pretraining.labels import pair_labels
from clearway.pretraining.losses import Lesson, drawn_pairs, losses
from clearway.pretraining.settings import PretrainSettings
from clearway.scenes.sensors import DEPTH, RGB
from clearway.torch_device import usable_device
from clearway.views.stream import ViewBatch, Views

ROWS = 200  # of metrics.jsonl, about
SECONDS_BETWEEN_CHECKPOINTS = 120.0
LIGHT, PARTNERS = 0, 1  # streams of random numbers of an update


@dataclass(frozen=True, eq=False)
class PretrainRequest:
    """What to train eyes on, and how.

    Attributes:
        views: with colour and depth, two takes of each pose.
        settings: how.
        seed: of the first parameters, of the order of the views, and of all other chances.
        keeping: eyes that are taught on, whose features stay as they are; None: all is learnt anew.
        device: of torch, for example "cpu" or "cuda".

    Raises:
        ArgumentError: the views are of another kind, or too few.
    """

    views: Views
    settings: PretrainSettings
    seed: int = 0
    keeping: EyesEncoder | None = None
    device: str = "cpu"

    def __post_init__(self) -> None:
        self.settings.check()
        sensors = {sensor.name: sensor.shape[:2] for sensor in self.views.sensors}
        shape = self.settings.shape
        size = (shape.height_px, shape.width_px)
        if sensors.get(RGB) != size or sensors.get(DEPTH) != size:
            seen = ", ".join(f"{name} {rows} x {columns}" for name, (rows, columns) in sensors.items())
            wanted = f"rgb and depth of {size[0]} x {size[1]}"
            raise ArgumentError(f"views={seen}: expected {wanted}. Take them with --sensors rgb depth")
        if self.views.takes != 2:
            raise ArgumentError(f"views={self.views.takes} takes of each pose: expected 2. Take them with --takes 2")
        if not self.batches_an_epoch:
            problem = f"views={len(self.views)} pictures: fewer than one batch of {self.settings.batch}"
            raise ArgumentError(f"{problem}. Take more views, or give a smaller batch")

    @property
    def batches_an_epoch(self) -> int:
        """Whole batches."""
        settings = self.settings
        count = self.views.batch_count(settings.batch, settings.together)
        poses = sum(len(shard) // 2 // settings.together * settings.together for shard in self.views.shards)
        return count if poses * 2 == count * settings.batch else count - 1


def pretrain(
    request: PretrainRequest,
    out: Path,
    *,
    resume: bool = False,
    track: TrackerName | None = None,
    done: Callable[[int], object] = lambda pictures: None,
) -> EyesFolder:
    """Train eyes until all pictures are used, and leave them in a folder.

    Args:
        request: what to train on, and how.
        out: the folder.
        resume: go on from the newest checkpoint in `out`; without one, begin.
        track: where figures are shown as they come, see `learn.tracking`.
        done: is told how many pictures are used.

    Raises:
        RunError: `out` holds a training already (and resume is off) or another one, is in use, training failed, or
            there is no such device.
        SceneError: a shard is damaged or gone.
        KeyboardInterrupt: the user interrupted; it can be resumed.
    """
    check_tracker(track)
    usable_device(request.device)
    folder = EyesFolder(out)
    with folder.held():
        trainer = Pretrainer(request)
        seconds = 0.0
        if folder.begin(record_of(request), resume):
            seconds = _resumed(trainer, folder)
        _run(trainer, folder, done, seconds, track)
        folder.write_eyes(trainer.eyes, trainer.pictures)
    return folder


class Pretrainer:
    """Eyes that learn.

    Attributes:
        eyes: the network, on the device.
        updates: made so far.
    """

    def __init__(self, request: PretrainRequest) -> None:
        self.request, self.settings = request, request.settings
        with torch.random.fork_rng(devices=()):
            torch.manual_seed(request.seed)
            self.eyes = Eyes(self.settings.shape)
        if request.keeping is not None:
            self.eyes.teach_on(request.keeping.eyes)
        self.device = usable_device(request.device)
        self.eyes.to(self.device)
        self._named = {name: value for name, value in self.eyes.named_parameters() if value.requires_grad}
        parameters = list(self._named.values())
        self._optimiser = torch.optim.AdamW(parameters, lr=0.0, weight_decay=self.settings.weight_decay, fused=True)
        for parameter in parameters:
            self._optimiser.state[parameter] = {
                "step": torch.zeros((), dtype=torch.float32, device=self.device),
                "exp_avg": torch.zeros_like(parameter),
                "exp_avg_sq": torch.zeros_like(parameter),
            }
        self._bfloat16 = multiplies_bfloat16(self.device)
        self.updates = 0

    @property
    def pictures(self) -> int:
        """Used so far."""
        return self.updates * self.settings.batch

    @property
    def finished(self) -> bool:
        """All pictures are used."""
        return self.updates >= self.settings.updates

    def batches(self) -> Iterator[ViewBatch]:
        """The batches that are next, without end."""
        settings, request = self.settings, self.request
        epoch, start = divmod(self.updates, request.batches_an_epoch)
        while True:
            batches = request.views.batches(
                settings.batch, seed=request.seed, epoch=epoch, start=start, together=settings.together
            )
            yield from (batch for batch in batches if len(batch) == settings.batch)
            epoch, start = epoch + 1, 0

    def lessons(self) -> Iterator[Lesson]:
        """The batches that are next, relit and paired, without end; on a GPU all of torch's threads make them."""
        threads = 1 if self.device.type == "cpu" else torch.get_num_threads()
        return made_ahead(enumerate(self.batches(), self.updates), self._lesson, threads)

    def _lesson(self, numbered: tuple[int, ViewBatch]) -> Lesson:
        """The batch of an update, relit and paired by that update's chances."""
        update, batch = numbered
        settings, number = self.settings, [self.request.seed, update]
        levels = relit(batch.seen[RGB], np.random.default_rng([*number, LIGHT]))
        rng = np.random.default_rng([*number, PARTNERS])
        first, second = drawn_pairs(len(batch), settings.partners, 2 * settings.together, rng)
        labels = pair_labels(batch.table, batch.seen[DEPTH], first, second, settings.shape.grid)
        return Lesson(batch, torch.from_numpy(standardised(levels)), first, second, labels)

    def update(self, lesson: Lesson) -> dict[str, float]:
        """Learn from the next lesson; gives its figures."""
        settings = self.settings
        self.eyes.train()
        if self.request.keeping is not None:
            self.eyes.trunk.eval()
        parts = losses(self.eyes, lesson, self._bfloat16)
        self.eyes.count(torch.from_numpy(lesson.labels.where), torch.from_numpy(lesson.batch.table.stands))
        self._optimiser.zero_grad()
        parts.total.backward()
        gradients = [parameter.grad for parameter in self._named.values() if parameter.grad is not None]
        norm = clip_gradients(gradients, settings.gradient_norm, each_tensor=False)
        rate = settings.rate_at(self.updates)
        self._optimiser.param_groups[0]["lr"] = rate
        self._optimiser.step()
        self.updates += 1
        return {**parts.figures(), "gradient_norm": norm.item(), "learning_rate": rate}

    def tensors(self) -> dict[str, Tensor]:
        """The optimiser's, see `load`."""
        return {
            f"{key}.{name}": value
            for name, parameter in self._named.items()
            for key, value in self._optimiser.state[parameter].items()
        }

    def load(self, network: dict[str, Tensor], tensors: dict[str, Tensor], updates: int) -> None:
        """Go on from where `eyes.state_dict` and `tensors` were taken."""
        self.eyes.load_state_dict(network)
        for name, parameter in self._named.items():
            for key, value in self._optimiser.state[parameter].items():
                value.copy_(tensors[f"{key}.{name}"])
        self.updates = updates


def _resumed(trainer: Pretrainer, folder: EyesFolder) -> float:
    """Load the newest checkpoint; the seconds trained so far."""
    checkpoint = newest_checkpoint(folder.checkpoints)
    progress = read_progress(checkpoint)
    try:
        trainer.load(read_network(checkpoint), read_training(checkpoint), progress.updates)
    except (LookupError, RuntimeError) as error:
        reason = " ".join(str(error).split())[:300]
        raise RunError(f"{checkpoint}: does not fit its training ({reason}). Remove it, or train again") from error
    folder.forget_metrics_after(progress.frames)
    return progress.seconds


def _run(
    trainer: Pretrainer,
    folder: EyesFolder,
    done: Callable[[int], object],
    seconds: float,
    track: TrackerName | None,
) -> None:
    """Update until all pictures are used or the user interrupts; ends with a checkpoint either way."""
    if trainer.finished:
        return
    settings = {"seed": trainer.request.seed, **trainer.settings.to_json()}
    log = MetricsLog(folder.metrics_path, tracker_of(track, folder.path, settings, folder.metrics(), seconds))
    every = max(1, trainer.settings.updates // ROWS)
    saved_at = time.monotonic()
    with interruption() as interrupted:
        try:
            for lesson in trainer.lessons():
                begun = time.monotonic()
                figures = trainer.update(lesson)
                seconds += time.monotonic() - begun
                if not np.isfinite(figures["loss"]):
                    problem = f"the loss is {figures['loss']} after {trainer.pictures} pictures"
                    raise RunError(f"{folder.path}: {problem}. Training stopped; lower the learning rate")
                if trainer.updates % every == 0 or trainer.finished:
                    counts = {"frames": trainer.pictures, "updates": trainer.updates, "seconds": round(seconds, 3)}
                    log.write({**counts, **{name: float(f"{value:.6g}") for name, value in figures.items()}})
                done(trainer.pictures)
                if trainer.finished or interrupted.is_set():
                    break
                if time.monotonic() - saved_at > SECONDS_BETWEEN_CHECKPOINTS:
                    _save(trainer, folder, seconds)
                    saved_at = time.monotonic()
            _save(trainer, folder, seconds)
        finally:
            log.close()
    if not trainer.finished:
        raise KeyboardInterrupt


def _save(trainer: Pretrainer, folder: EyesFolder, seconds: float) -> None:
    progress = Progress(trainer.pictures, trainer.updates, seconds)
    write_checkpoint(folder.checkpoints, trainer.eyes.state_dict(), trainer.tensors(), progress)
