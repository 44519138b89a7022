"""Eyes that learn: what to train them on, and the update of one batch of views.

What an update does follows from the settings, the seed, its own number and the kind of device alone: which pictures,
under which light, compared with which. So a checkpoint holds the network, the optimiser and that number.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from clearway.errors import ArgumentError
from clearway.learn.optimiser import clip_gradients
from clearway.learn.peers import ALONE, Peers
from clearway.model.precision import multiplies_bfloat16
from clearway.perception.eyes import EyesEncoder
from clearway.perception.eyes_network import Eyes, EyesShape
from clearway.pretraining.ahead import made_ahead
from clearway.pretraining.augment import chances, relit, standardised
from clearway.pretraining.labels import pair_labels
from clearway.pretraining.losses import Lesson, drawn_pairs, losses
from clearway.pretraining.settings import PretrainSettings
from clearway.pretraining.together import own_pictures, share_batch_norms
from clearway.scenes.sensors import DEPTH, RGB
from clearway.torch_device import usable_device
from clearway.views.stream import ViewBatch, Views

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
        check_views("views", self.views, self.settings.shape)
        if not self.batches_an_epoch:
            problem = f"views={len(self.views)} pictures: fewer than one batch of {self.settings.batch}"
            raise ArgumentError(f"{problem}. Take more: clearway scenes views with more scenes, or more --poses")

    @property
    def batches_an_epoch(self) -> int:
        """Whole batches."""
        settings = self.settings
        count = self.views.batch_count(settings.batch, settings.together)
        poses = sum(len(shard) // 2 // settings.together * settings.together for shard in self.views.shards)
        return count if poses * 2 == count * settings.batch else count - 1


def check_views(name: str, views: Views, shape: EyesShape) -> None:
    """Raise ArgumentError where views, an argument of that name, are none to teach eyes of a shape, or try them, on."""
    sensors = {sensor.name: sensor.shape[:2] for sensor in views.sensors}
    size = (shape.height_px, shape.width_px)
    if sensors.get(RGB) != size or sensors.get(DEPTH) != size:
        seen = ", ".join(f"{sensor} {rows} x {columns}" for sensor, (rows, columns) in sensors.items())
        wanted = f"rgb and depth of {size[0]} x {size[1]}"
        raise ArgumentError(f"{name}={seen}: expected {wanted}. Take them with --sensors rgb depth")
    if views.takes != 2:
        raise ArgumentError(f"{name}={views.takes} takes of each pose: expected 2. Take them with --takes 2")


class Pretrainer:
    """Eyes that learn.

    Args:
        request: from what, and how.
        peers: the workers, who have a part of every batch each.

    Attributes:
        eyes: the network, on the device.
        updates: made so far.
    """

    def __init__(self, request: PretrainRequest, peers: Peers = ALONE) -> None:
        self.request, self.settings, self.peers = request, request.settings, peers
        self._own = own_pictures(request.settings, peers)
        with torch.random.fork_rng(devices=()):
            torch.manual_seed(request.seed)
            self.eyes = Eyes(self.settings.shape)
        if request.keeping is not None:
            self.eyes.teach_on(request.keeping.eyes)
        self.device = usable_device(request.device)
        self.eyes.to(self.device)
        if peers.count > 1:
            share_batch_norms(self.eyes, peers, request.settings.batch)
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
        """What is next to learn from, without end; on a GPU all of torch's threads make it."""
        threads = 1 if self.device.type == "cpu" else torch.get_num_threads()
        return made_ahead(enumerate(self.batches(), self.updates), self._lesson, threads)

    def _lesson(self, numbered: tuple[int, ViewBatch]) -> Lesson:
        """This worker's part of the batch of an update, relit and paired by that update's chances."""
        update, batch = numbered
        settings, number = self.settings, [self.request.seed, update]
        pictures = torch.from_numpy(batch.seen[RGB]).to(self.device)
        levels = relit(pictures, chances([*number, LIGHT], self.device))
        rng = np.random.default_rng([*number, PARTNERS])
        first, second = drawn_pairs(len(batch), settings.partners, 2 * settings.together, rng)
        part, whole = self._own, len(batch)
        ours = (first >= part.start) & (first < part.stop)
        first, second = first[ours] - part.start, second[ours] - part.start
        own = batch[part]
        labels = pair_labels(own.table, own.seen[DEPTH], first, second, settings.shape.grid)
        return Lesson(own, standardised(levels[part]), first, second, labels, part, whole)

    def update(self, lesson: Lesson) -> dict[str, float]:
        """Learn from the next lesson; gives its figures."""
        settings = self.settings
        self.eyes.train()
        if self.request.keeping is not None:
            self.eyes.trunk.eval()
        parts = losses(self.eyes, lesson, self._bfloat16, self.peers)
        self._count(lesson)
        self._optimiser.zero_grad()
        parts.total.backward()
        gradients = [parameter.grad for parameter in self._named.values() if parameter.grad is not None]
        self.peers.add_up(*gradients)
        norm = clip_gradients(gradients, settings.gradient_norm, each_tensor=False)
        rate = settings.rate_at(self.updates)
        self._optimiser.param_groups[0]["lr"] = rate
        self._optimiser.step()
        self.updates += 1
        return {**parts.of_all(self.peers).figures(), "gradient_norm": norm.item(), "learning_rate": rate}

    def _count(self, lesson: Lesson) -> None:
        """Have the eyes count what all workers learn from."""
        counts = self.eyes.whereabouts_seen, self.eyes.stood
        before = [count.clone() for count in counts]
        self.eyes.count(torch.from_numpy(lesson.labels.where), torch.from_numpy(lesson.batch.table.stands))
        if self.peers.count > 1:
            added = [count - old for count, old in zip(counts, before, strict=True)]
            self.peers.add_up(*added)
            for count, old, new in zip(counts, before, added, strict=True):
                count.copy_(old + new)

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
