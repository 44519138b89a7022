"""How fast the eyes see: processor time of a picture on one core, and the share of this machine's matrix-product peak.

    python benchmarks/eyes.py

Pictures of 400 x 300 pixels to features, resizing included, on PyTorch as it comes (eager) and by the exported file,
beside the random ResNet-50 of the same run. One thread; of every case the median and range of the rounds, which take
turns. The share is of the best float32 product of square matrices measured between the rounds; multiplications and
additions are counted at the network's own input, of convolutions and linear layers alone.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import torch
from family import processor_s
from throughput import matrix_peak
from torch import nn
from torch.utils.flop_counter import FlopCounterMode

from clearway.deploy.export import export_generalist
from clearway.deploy.generalist import exported_generalist
from clearway.deploy.onnx_file import read_onnx
from clearway.mapping.settings import MappingSettings
from clearway.perception import eyes, random_resnet
from clearway.perception.encode import encoder_from_record
from clearway.perception.encoder import Encoder, NetworkEncoder
from clearway.perception.preprocess import Preprocessing, to_pixels

SIZE, BATCHES, PEAK_SIZES = (300, 400), (1, 64), (512, 1024)
LEAST_S = 1.0  # that a case is repeated for in a round


def cpu_ms(work: Callable[[], object], count: int) -> float:
    """Processor time of a picture, milliseconds, of work on so many."""
    work()
    begun, times = processor_s(), 0
    while processor_s() - begun < LEAST_S:
        work()
        times += 1
    return (processor_s() - begun) / times / count * 1000


def gflop(network: Callable[[torch.Tensor], object], preprocessing: Preprocessing) -> float:
    """Of a picture through a network."""
    pixels = to_pixels(np.zeros((1, *SIZE, 3), np.uint8), preprocessing)
    with FlopCounterMode(display=False) as counter, torch.no_grad():
        network(pixels)
    return counter.get_total_flops() / 1e9


def main() -> None:
    """Print the table as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    torch.set_num_threads(1)
    pictures = np.random.default_rng(0).integers(0, 256, (max(BATCHES), *SIZE, 3)).astype(np.uint8)
    own = eyes.from_record(eyes.find_record())
    resnet = encoder_from_record(random_resnet.fit_record([pictures[:16]], sample_pictures=16))
    assert isinstance(resnet, NetworkEncoder)
    with tempfile.TemporaryDirectory() as folder:
        export_generalist(own, MappingSettings(), Path(folder) / "generalist.onnx")
        exported = exported_generalist(read_onnx(Path(folder) / "generalist.onnx", threads=1)).generalist.encoder
    shape = own.eyes.shape
    needed = gflop(lambda x: own.eyes.glance(own.eyes(x)), Preprocessing(shape.height_px, shape.width_px))
    work: dict[str, tuple[Encoder, float]] = {
        "eyes, PyTorch": (own, needed),
        "eyes, onnxruntime": (exported, needed),
        "random ResNet-50, PyTorch": (resnet, gflop(resnet.features_of, resnet.preprocessing)),
    }
    found: dict[tuple[str, int], list[float]] = {(name, count): [] for name in work for count in BATCHES}
    peaks = []
    for _ in range(options.rounds):
        peaks.append(max(matrix_peak("cpu", PEAK_SIZES, 3).values()))
        for (name, count), ms in found.items():
            ms.append(cpu_ms(partial(work[name][0].encode, pictures[:count]), count))
    print(f"torch {torch.__version__}, one thread; peak {max(peaks):.0f} GFLOP/s ({min(peaks):.0f} at least)\n")
    print("| encoder | pictures a batch | ms a picture | range | GFLOP | share of the peak |")
    print("| --- | --- | --- | --- | --- | --- |")
    for (name, count), ms in found.items():
        middle, cost = statistics.median(ms), work[name][1]
        share = cost / (middle / 1000) / max(peaks)
        row = f"| {name} | {count} | {middle:.2f} | {min(ms):.2f}-{max(ms):.2f} | {cost:.2f} | {100 * share:.0f} % |"
        print(row)
    sizes = (sum(p.numel() for p in network.parameters()) / 1e6 for network in (own.eyes, _network(resnet)))
    print("\nparameters, millions: eyes {:.2f}, ResNet-50 {:.2f}".format(*sizes))


def _network(encoder: object) -> nn.Module:
    network = getattr(encoder, "network", None)
    assert isinstance(network, nn.Module)
    return network


if __name__ == "__main__":
    main()
