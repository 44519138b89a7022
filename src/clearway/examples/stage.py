"""The example on the viewer's stage."""

from __future__ import annotations

from pathlib import Path

from clearway.examples.shipped import SHIPPED, load_example
from clearway.view.generalist import generalist_stage
from clearway.view.stage import Stage, run_stage


def example_stage(folder: Path = SHIPPED) -> tuple[Stage, str]:
    """The agents in their scene, and the episode that the page opens with, as a query string. Raises ClearwayError."""
    example = load_example(folder)
    return run_stage(list(example.runs.values()), [example.scene]), example.episode


def generalist_example(tour: int = 0, folder: Path = SHIPPED) -> Stage:
    """The generalist in the example's scene. Raises ClearwayError."""
    return generalist_stage([load_example(folder).scene], tour)
