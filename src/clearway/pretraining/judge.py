"""How well eyes see in rooms that no training has shown them.

Of each pose the first take is what is remembered, and the second is what is seen, under another light and with noise.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
import torch
from torch import Tensor

from clearway.perception.around import PLACES_M
from clearway.perception.eyes_network import NEAREST_M, Eyes
from clearway.pretraining.augment import chances, relit, standardised
from clearway.pretraining.labels import pair_labels, token_depth_m
from clearway.pretraining.losses import OVERLAPPING, SHALLOWEST_M
from clearway.scenes.sensors import DEPTH, RGB
from clearway.views.shard import Shard
from clearway.views.stream import Views

NEAR_M, NEAR_DEG = 0.5, 30.0  # poses no farther apart count as one step
CLOSE_M, CLOSE_DEG = 0.5, 15.0  # relative poses told no worse are right
FREE_M = 0.25  # free ways told no worse are right
STEP_AHEAD = PLACES_M.index((0.5, 0.0))
LIGHT, PAIRED = 0, 1  # streams of random numbers of a room
PAIRS = 4000  # of a room
BATCH = 64


@dataclass(frozen=True)
class Judgement:
    """How well eyes see: means over rooms.

    Attributes:
        rooms: number of them.
        recognised: share of pictures whose description is nearest to that of the same pose among all of its room.
        recognised_near: the nearest one is of a pose within half a metre and 30 degrees.
        free_ahead: share of free ways ahead told within a quarter of a metre.
        free: the same of all four directions, three of which are out of sight.
        stands: share of the places around the body of which it is rightly told whether it could stand there.
        step_ahead: the same of the place half a metre ahead.
        depth: median error of depth, share of it.
        place_m, turn_deg: median errors of relative poses of pictures that see a quarter alike or more.
        poses: share of these right within half a metre and 15 degrees.
        overlap: share of pairs rightly told to see a quarter alike, or not.
        where_nats: mean surprise of the true bin of the relative pose, all pairs.
    """

    rooms: int
    recognised: float
    recognised_near: float
    free_ahead: float
    free: float
    stands: float
    step_ahead: float
    depth: float
    place_m: float
    turn_deg: float
    poses: float
    overlap: float
    where_nats: float

    def to_json(self) -> dict[str, float]:
        """As JSON values."""
        return asdict(self)


def judge(eyes: Eyes, views: Views, seed: int = 0) -> Judgement:
    """Try eyes on views, two takes of each pose, with depth.

    Raises:
        SceneError: a shard is damaged or gone.
    """
    found = judge_rooms(eyes, views, seed)
    means = {name: float(np.nanmean([room[name] for room in found])) for name in found[0]}
    return Judgement(len(found), **means)


def judge_rooms(eyes: Eyes, views: Views, seed: int = 0, *, relight: bool = True) -> list[dict[str, float]]:
    """The figures of each room, see `Judgement`; NaN where a room has nothing to tell one from.

    relight: second takes are seen under another light and with noise; else as they were taken.
    """
    training = eyes.training
    eyes.eval()
    with torch.inference_mode():
        found = [_in_room(eyes, shard, [seed, room], relight) for room, shard in enumerate(views.shards)]
    eyes.train(training)
    return found


def _in_room(eyes: Eyes, shard: Shard, numbers: list[int], relight: bool) -> dict[str, float]:
    """The figures of a room, by chances that follow from numbers."""
    every = slice(None)
    table, depth, pictures = shard.table, shard.seen(DEPTH, every), shard.seen(RGB, every)
    levels = torch.from_numpy(pictures.astype(np.float32))
    if relight:
        levels[1::2] = relit(torch.from_numpy(pictures[1::2]), chances([*numbers, LIGHT], levels.device))
    pixels = standardised(levels)
    tokens = torch.cat([eyes(pixels[first : first + BATCH]) for first in range(0, len(pixels), BATCH)])
    glance = eyes.glance(tokens)
    free_m = (glance.free.exp() - NEAREST_M).numpy()
    free_right = np.abs(free_m - table.free_m) < FREE_M
    stands_right = (glance.stands > 0).numpy() == table.stands
    told_m, true_m = glance.depth.exp().numpy(), np.maximum(token_depth_m(depth, eyes.shape.grid), SHALLOWEST_M)
    return {
        **recognition(glance.description, np.column_stack([table.x_m, table.z_m, table.heading_deg])),
        "free_ahead": float(free_right[:, 0].mean()),
        "free": float(free_right.mean()),
        "stands": float(stands_right.mean()),
        "step_ahead": float(stands_right[:, STEP_AHEAD].mean()),
        "depth": float(np.median(np.abs(told_m / true_m - 1))),
        **_relative_poses(eyes, tokens, glance.depth, shard, np.random.default_rng([*numbers, PAIRED])),
    }


def recognition(features: Tensor, poses: np.ndarray) -> dict[str, float]:
    """How often the second take of a pose is nearest to its first one, by the cosine of (2 N, F) features.

    poses: (2 N, 3) x and z in metres, heading in degrees, of both takes in turn.
    """
    unit = torch.nn.functional.normalize(features, dim=1)
    nearest = (unit[1::2] @ unit[0::2].T).argmax(dim=1).numpy()
    kept = poses[0::2]
    apart_m = np.linalg.norm(kept[:, :2] - kept[nearest, :2], axis=1)
    apart_deg = np.abs((kept[:, 2] - kept[nearest, 2] + 180) % 360 - 180)
    near = (apart_m <= NEAR_M) & (apart_deg <= NEAR_DEG)
    return {
        "recognised": float(np.mean(nearest == np.arange(len(nearest)))),
        "recognised_near": float(np.mean(near)),
    }


def _relative_poses(
    eyes: Eyes, tokens: Tensor, depth: Tensor, shard: Shard, rng: np.random.Generator
) -> dict[str, float]:
    """Errors of relative poses; NaN where no two pictures of the room see enough alike."""
    first, second = rng.integers(len(shard), size=(2, PAIRS))
    labels = pair_labels(shard.table, shard.seen(DEPTH, slice(None)), first, second, eyes.shape.grid)
    told = eyes.compare(tokens[first], tokens[second], depth[first], depth[second])
    off_m = np.linalg.norm(told.place_m.numpy() - labels.place_m, axis=1)
    turned, true = (np.arctan2(turn[:, 1], turn[:, 0]) for turn in (told.turn.numpy(), labels.turn))
    off_deg = np.abs((np.degrees(turned - true) + 180) % 360 - 180)
    alike = labels.overlap > OVERLAPPING
    right = (off_m < CLOSE_M) & (off_deg < CLOSE_DEG)
    some = alike.any()
    return {
        "place_m": float(np.median(off_m[alike])) if some else float("nan"),
        "turn_deg": float(np.median(off_deg[alike])) if some else float("nan"),
        "poses": float(right[alike].mean()) if some else float("nan"),
        "overlap": float(np.mean((told.overlap.numpy() > 0) == alike)),
        "where_nats": float(torch.nn.functional.cross_entropy(told.whereabouts, torch.from_numpy(labels.where))),
    }
