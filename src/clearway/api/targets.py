"""Which targets a user means: words and numbers to state ids by scene name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TypeAlias

from clearway.api.arguments import as_whole
from clearway.errors import ArgumentError
from clearway.scenes.scene import Scene
from clearway.scenes.targets import default_targets

Targets: TypeAlias = Mapping[str, Iterable[int]] | Iterable[int] | None
"""State ids by scene name, or state ids alone for a single scene; None: default ones."""


def chosen_targets(scenes: Sequence[Scene], targets: Targets, seed: int) -> dict[str, tuple[int, ...]]:
    """Targets of every scene by its name, default ones where none are given.

    Raises:
        ArgumentError: they are no whole numbers, or leave open which scene they mean, or name one that is not given.
    """
    expected = "expected state ids by scene name, such as {'bathroom': [26, 37]}"
    if targets is None:
        targets = {}
    if not isinstance(targets, Mapping):
        if len(scenes) > 1 or isinstance(targets, str) or not isinstance(targets, Iterable):
            raise ArgumentError(f"targets={targets!r:.80}: {expected}. Name the scene of each")
        targets = {scenes[0].name: targets}
    names = [scene.name for scene in scenes]
    chosen: dict[str, tuple[int, ...]] = dict.fromkeys(names, ())
    for name, states in targets.items():
        if name not in names:
            raise ArgumentError(f"targets: no scene {name!r:.80} is given. Name one of {', '.join(names)}")
        if isinstance(states, str) or not isinstance(states, Iterable):
            raise ArgumentError(f"targets[{name!r}]={states!r:.80}: {expected}. Give a list of them")
        chosen[name] = tuple(as_whole(f"targets[{name!r}]", state) for state in states)
    return {scene.name: chosen[scene.name] or default_targets(scene, seed) for scene in scenes}
