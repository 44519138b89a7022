"""`clearway export`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import tyro

from clearway.choices import GENERALIST, is_generalist
from clearway.cli.arguments import check_ending, scene_files
from clearway.cli.console import say, say_begun
from clearway.errors import ClearwayError, EncoderError


@dataclass(frozen=True)
class ExportAgent:
    """Write a trained agent as one file that runs without clearway: pictures in, action probabilities out.

    Example: clearway export runs/bathroom --format onnx --out bathroom.onnx
    """

    folder: Annotated[Path, tyro.conf.Positional]
    """The run folder; or generalist, which comes with clearway and walks in any room."""
    out: Path = Path("agent.onnx")
    """The file."""
    format: Literal["onnx"] = "onnx"
    """Its format."""
    encoder: bool = True
    """Put the encoder in, so that the agent takes pictures; without it, it takes feature vectors."""
    scene: str | None = None
    """Name of the scene that the agent is for; by default the run's first."""
    checkpoint: Path | None = None
    """A checkpoint folder of the run; by default the newest."""
    scenes: tuple[Path, ...] = ()
    """Scene files or folders, where they are no longer where they were at training."""

    def run(self) -> None:
        """Load the agent, write the file and say what is in it."""
        from clearway.deploy.export import export_onnx
        from clearway.deploy.from_run import load_run_in_scene

        check_ending(".onnx", out=self.out)
        if is_generalist(self.folder):
            self._generalist()
            return
        files = scene_files(self.scenes) if self.scenes else None
        chosen = load_run_in_scene(self.folder, self.scene, checkpoint=self.checkpoint, files=files)
        begun = partial(say_begun, f"exporting an agent for scene {chosen.scene.name}")
        try:
            export_onnx(chosen, self.out, with_encoder=self.encoder, on_begin=begun)
        except EncoderError as fault:
            raise EncoderError(f"{fault}, or export the policy alone with --no-encoder") from fault
        others = [name for name in chosen.scene_names if name != chosen.scene.name]
        what = f"policy with encoder {chosen.encoder_record.name}" if self.encoder else "policy"
        said = f"{what}: {self.out}, {self.out.stat().st_size / 1e6:.1f} MB, for scene {chosen.scene.name}"
        if others:
            said += f" (--scene chooses another: {', '.join(others)})"
        say(said)

    def _generalist(self) -> None:
        from clearway.agents.generalist import Generalist
        from clearway.deploy.export import check_can_export, export_generalist
        from clearway.perception import eyes

        given = {"--scene": self.scene, "--checkpoint": self.checkpoint, "--scenes": self.scenes}
        asked = [option for option, value in given.items() if value] + ([] if self.encoder else ["--no-encoder"])
        if asked:
            raise ClearwayError(f"{asked[0]}: not with {GENERALIST}, which is one agent for all rooms. Leave it out")
        check_can_export()
        say_begun(f"exporting {GENERALIST}")
        encoder = eyes.from_record(eyes.find_record())
        export_generalist(encoder, Generalist.by_eyes(encoder).settings, self.out)
        say(f"{GENERALIST} with its eyes: {self.out}, {self.out.stat().st_size / 1e6:.1f} MB, for any room")
