"""The generalist with small eyes, and its file: made once for all, as the translation to ONNX takes seconds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from clearway.agents.generalist import Generalist
from clearway.deploy.export import export_generalist
from clearway.deploy.generalist import GeneralistAgent, exported_generalist
from clearway.deploy.onnx_file import read_onnx
from clearway.mapping.settings import MappingSettings
from clearway.perception import eyes
from clearway.perception.eyes import write_eyes
from helpers.small_eyes import small_eyes


@dataclass(frozen=True)
class OneFile:
    """A generalist of small eyes in a folder, on PyTorch and exported."""

    folder: Path

    @cached_property
    def generalist(self) -> Generalist:
        write_eyes(self.folder / "eyes", small_eyes(), {})
        encoder = eyes.from_record(eyes.find_record(str(self.folder / "eyes")))
        return Generalist(encoder, Generalist.by_eyes(encoder).sight, MappingSettings(side_m=10.0, arrived=0.002))

    @cached_property
    def path(self) -> Path:
        export_generalist(self.generalist.encoder, self.generalist.settings, self.folder / "generalist.onnx")
        return self.folder / "generalist.onnx"

    @property
    def torch(self) -> GeneralistAgent:
        return GeneralistAgent(self.generalist)

    @property
    def onnx(self) -> GeneralistAgent:
        return exported_generalist(read_onnx(self.path))
