"""`random-resnet50`: a ResNet-50 with seeded random weights, for machines that cannot download trained ones.

Random weights alone give all pictures nearly the same features. Three steps make them tell states apart:
batch norms calibrated on a mixed sample of the scenes' own pictures, frozen from then on, and pooled features
standardised over that sample. Seed and statistics are kept in the record, so that the encoder can be made again.

Pictures are 128x128 here: on our bathroom and bedroom the features' effective rank was 19 and 22 and the closest
pair of states 0.15 and 0.08 apart (cosine distance), against 11 and 10, 0.09 and 0.03 at 224x224, at a third
of the pixels. A sample of 256 pictures was no better than one of 64.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from clearway.errors import EncoderError
from clearway.perception.encoder import NetworkEncoder, identity_of
from clearway.perception.preprocess import Preprocessing, preprocessing_from_json, to_pixels
from clearway.scenes.scene import EncoderRecord, Observations

if TYPE_CHECKING:
    import torch
    from torch import nn

KIND = "random-resnet"
VERSION = 2  # of what `fit_record` does; raise it when that changes, so that cached records are fitted again
PREPROCESSING = Preprocessing(128, 128)
SAMPLE_PICTURES = 64
MAX_WIDTH, MAX_LAYERS, MAX_STAGES = 4_096, 200, 5  # of an architecture; a record that asks for more is refused
MAX_PARAMETERS = 100_000_000  # four times ResNet-50's
REDUCTION = 4  # of a bottleneck's inner width
LEAST_STD = 1e-6  # a feature that varies less over the sample is only centred


@dataclass(frozen=True)
class ResNetShape:
    """Architecture of a ResNet, in the terms of `transformers.ResNetConfig`; the defaults are ResNet-50."""

    embedding_size: int = 64
    hidden_sizes: tuple[int, ...] = (256, 512, 1024, 2048)
    depths: tuple[int, ...] = (3, 4, 6, 3)
    layer_type: str = "bottleneck"

    def to_json(self) -> dict[str, object]:
        """As JSON values."""
        return {key: list(v) if isinstance(v, tuple) else v for key, v in asdict(self).items()}


RESNET50 = ResNetShape()


def fit_record(
    scenes: Sequence[Observations],
    *,
    seed: int = 0,
    shape: ResNetShape = RESNET50,
    preprocessing: Preprocessing = PREPROCESSING,
    sample_pictures: int = SAMPLE_PICTURES,
    name: str = "random-resnet50",
) -> EncoderRecord:
    """Calibrate a random ResNet on the pictures of some scenes; gives the record, see `from_record`.

    Args:
        scenes: pictures of each scene, (S, height, width, 3) uint8; each adds an equal share to the sample.
        seed: of the weights and of the sample.
        shape: the architecture.
        preprocessing: of pictures.
        sample_pictures: how many pictures calibrate; they are in memory together.
        name: of the encoder.
    """
    import torch

    network = _random_network(shape, seed)
    pixels = torch.cat([to_pixels(p, preprocessing) for p in _sample(scenes, sample_pictures, seed)])
    with torch.inference_mode():
        _calibrate(network, pixels)
        features = _pooled(network, pixels).numpy().astype(np.float64)
    std = features.std(axis=0)
    arrays = {
        "batch_norm_mean": _statistics(network, "running_mean"),
        "batch_norm_var": _statistics(network, "running_var"),
        "feature_mean": features.mean(axis=0).astype(np.float32),
        "feature_std": np.where(std > LEAST_STD, std, 1).astype(np.float32),
    }
    settings = {
        "kind": KIND,
        "seed": seed,
        "sample_pictures": len(pixels),
        "architecture": shape.to_json(),
        "preprocessing": preprocessing.to_json(),
        "weights": _weights_hash(network),
    }
    return EncoderRecord(name, _identity(settings, arrays), settings, arrays)


def from_record(record: EncoderRecord) -> NetworkEncoder:
    """The encoder that `fit_record` described. Raises EncoderError where the record is incomplete or altered."""
    remedy = "Encode the scene again"
    settings = {key: record.settings.get(key) for key in ("kind", "seed", "sample_pictures", "architecture")}
    settings |= {key: record.settings.get(key) for key in ("preprocessing", "weights")}
    if _identity(settings, record.arrays) != record.identity:
        raise EncoderError(f"encoder {record.name} ({record.identity}): its record was altered. {remedy}")
    shape, seed = _shape_of(record), _seed_of(record)
    _check_statistics(record, shape)
    network = _random_network(shape, seed)
    if _weights_hash(network) != settings["weights"]:
        problem = "its seed gives other weights with the numpy or transformers installed here"
        raise EncoderError(f"encoder {record.name} ({record.identity}): {problem}. {remedy}")
    _set_statistics(network, record)
    preprocessing = preprocessing_from_json(_object(settings["preprocessing"]), f"encoder {record.name}")
    mean, std = record.arrays["feature_mean"], record.arrays["feature_std"]
    features_of = partial(_pooled, network)
    return NetworkEncoder(record, preprocessing, network, features_of, len(mean), mean, std)


def _identity(settings: Mapping[str, object], arrays: Mapping[str, np.ndarray]) -> str:
    return identity_of(settings, (np.ascontiguousarray(arrays[name]).tobytes() for name in sorted(arrays)))


def _object(value: object) -> Mapping[str, object]:
    return value if isinstance(value, Mapping) else {}


def _shape_of(record: EncoderRecord) -> ResNetShape:
    kept = _object(record.settings.get("architecture"))
    embedding, layer = kept.get("embedding_size"), kept.get("layer_type")
    hidden, depths = _sizes(kept.get("hidden_sizes")), _sizes(kept.get("depths"))
    sane = _sizes([embedding]) and 1 <= len(hidden) == len(depths) <= MAX_STAGES and sum(depths) <= MAX_LAYERS
    if layer == "bottleneck":
        sane = sane and all(width % REDUCTION == 0 for width in hidden)
    if not sane or layer not in ("basic", "bottleneck"):
        raise EncoderError(f"encoder {record.name}: unknown architecture {dict(kept)}. Encode the scene again")
    return ResNetShape(_sizes([embedding])[0], hidden, depths, str(layer))


def _sizes(value: object) -> tuple[int, ...]:
    """A list of layer sizes as a tuple; empty where it is no such list."""
    sizes = value if isinstance(value, list) else []
    return tuple(sizes) if all(isinstance(v, int) and 1 <= v <= MAX_WIDTH for v in sizes) else ()


def _seed_of(record: EncoderRecord) -> int:
    seed = record.settings.get("seed")
    if not isinstance(seed, int) or seed < 0:
        raise EncoderError(f"encoder {record.name}: its seed is {seed!r}. Encode the scene again")
    return seed


def _check_statistics(record: EncoderRecord, shape: ResNetShape) -> None:
    """Check the size of the network and of what is set in it, before it takes memory. Raises EncoderError."""
    network = _network(shape, "meta")
    count = sum(values.numel() for values in network.parameters())
    if count > MAX_PARAMETERS:
        problem = f"its network has {count:,} parameters, more than {MAX_PARAMETERS:,}"
        raise EncoderError(f"encoder {record.name}: {problem}. Encode the scene again")
    norms = (sum(norm.num_features for norm in _batch_norms(network)),)
    wanted = dict.fromkeys(("batch_norm_mean", "batch_norm_var"), norms)
    wanted |= dict.fromkeys(("feature_mean", "feature_std"), (shape.hidden_sizes[-1],))
    for name, size in wanted.items():
        values = record.arrays.get(name)
        if values is None or values.shape != size or values.dtype != np.float32:
            problem = f"the statistics '{name}' do not fit the network, which needs {size} float32"
            raise EncoderError(f"encoder {record.name}: {problem}. Encode the scene again")


def _random_network(shape: ResNetShape, seed: int) -> nn.Module:
    """A ResNet whose convolutions are He-normal by numpy's generator, the same on every machine."""
    import torch
    from torch import nn

    network: Any = _network(shape, "cpu")  # torch tells checkers nothing of memory formats
    rng = np.random.default_rng(seed)
    with torch.no_grad():
        for module in network.modules():
            if isinstance(module, nn.Conv2d):
                fan_out = module.out_channels * module.kernel_size[0] * module.kernel_size[1]
                weights = rng.standard_normal(tuple(module.weight.shape), np.float32)
                module.weight.copy_(torch.from_numpy(weights * np.float32(np.sqrt(2 / fan_out))))
    return network.eval().requires_grad_(False).to(memory_format=torch.channels_last)


def _network(shape: ResNetShape, device: str) -> nn.Module:
    """A ResNet of a shape; on the device "meta" it takes no memory."""
    import torch
    from transformers.models.resnet.configuration_resnet import ResNetConfig
    from transformers.models.resnet.modeling_resnet import ResNetModel

    config = ResNetConfig(
        embedding_size=shape.embedding_size,
        hidden_sizes=list(shape.hidden_sizes),
        depths=list(shape.depths),
        layer_type=shape.layer_type,
    )
    with torch.random.fork_rng(devices=[]), torch.device(device):
        return ResNetModel(config)


def _sample(scenes: Sequence[Observations], count: int, seed: int) -> list[np.ndarray]:
    """About `count` pictures, an equal share of each scene, drawn without replacement."""
    rng = np.random.default_rng(seed)
    shares = [len(part) for part in np.array_split(np.arange(count), len(scenes))]
    drawn = []
    for pictures, share in zip(scenes, shares, strict=True):
        share = min(max(share, 1), pictures.shape[0])
        drawn.append(pictures[np.sort(rng.choice(pictures.shape[0], share, replace=False))])
    return drawn


def _calibrate(network: nn.Module, pixels: torch.Tensor) -> None:
    """Set the statistics of every batch norm to those of `pixels`, layer after layer in one pass."""
    for norm in _batch_norms(network):
        norm.momentum = 1.0
        norm.train()
    _pooled(network, pixels)
    for norm in _batch_norms(network):
        norm.eval()


def _pooled(network: nn.Module, pixels: torch.Tensor) -> torch.Tensor:
    return network(pixel_values=pixels).pooler_output.flatten(1)


def _batch_norms(network: nn.Module) -> list[nn.BatchNorm2d]:
    from torch import nn

    return [module for module in network.modules() if isinstance(module, nn.BatchNorm2d)]


def _statistics(network: nn.Module, which: str) -> np.ndarray:
    """The running means or variances of all batch norms, one after the other, float32."""
    return np.concatenate([getattr(norm, which).numpy() for norm in _batch_norms(network)])


def _set_statistics(network: nn.Module, record: EncoderRecord) -> None:
    import torch

    norms = _batch_norms(network)
    ends = np.cumsum([norm.num_features for norm in norms])
    for array, which in {"batch_norm_mean": "running_mean", "batch_norm_var": "running_var"}.items():
        for norm, part in zip(norms, np.split(record.arrays[array], ends[:-1]), strict=True):
            getattr(norm, which).copy_(torch.from_numpy(part.copy()))


def _weights_hash(network: nn.Module) -> str:
    from torch import nn

    convolutions = (module for module in network.modules() if isinstance(module, nn.Conv2d))
    return identity_of({}, (conv.weight.contiguous().numpy().tobytes() for conv in convolutions))
