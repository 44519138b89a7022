"""Which targets a user means: words and numbers to state ids by scene name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TypeAlias

from clearway.api.arguments import as_whole
from clearway.choices import HELD_OUT
from clearway.errors import ArgumentError
from clearway.scenes.scene import Scene
from clearway.scenes.targets import default_held_out_targets, default_targets, held_out_targets
from clearway.spelling import did_you_mean

Targets: TypeAlias = Mapping[str, Iterable[int]] | Iterable[int] | str | None
"""State ids by scene name, or state ids alone for a single scene; "held-out": some that are; None: default ones."""


def chosen_targets(scenes: Sequence[Scene], targets: Targets, seed: int) -> dict[str, tuple[int, ...]]:
    """Targets of every scene by its name, default ones where none are given.

    Raises:
        ArgumentError: they are no whole numbers, or leave open which scene they mean, or name one that is not given.
        SceneError: held-out ones are asked for, and nothing is held out in a scene.
    """
    if isinstance(targets, str) and targets == HELD_OUT:
        return {scene.name: default_held_out_targets(scene, seed) for scene in scenes}
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
        if name not in chosen:
            raise ArgumentError(
                f"targets: no scene {name!r:.80} is given.{did_you_mean(name, names)} Name one of {', '.join(names)}"
            )
        if isinstance(states, str) or not isinstance(states, Iterable):
            raise ArgumentError(f"targets[{name!r}]={states!r:.80}: {expected}. Give a list of them")
        chosen[name] = tuple(as_whole(f"targets[{name!r}]", state) for state in states)
        if not chosen[name]:
            raise ArgumentError(f"targets[{name!r}] is empty: {expected}. Leave it out for five seeded ones")
    return {scene.name: chosen[scene.name] or default_targets(scene, seed) for scene in scenes}


def told_of_held_out(scenes: Sequence[Scene], targets: Mapping[str, Sequence[int]]) -> list[str]:
    """For each scene with targets that should be held out of a training, a line that says so."""
    lines = []
    for scene in scenes:
        held = held_out_targets(scene)
        found = [str(state) for state in targets[scene.name] if 0 <= state < len(held) and held[state]]
        if found:
            count = "target" if len(found) == 1 else "targets"
            lines.append(
                f"scene {scene.name}: {count} {', '.join(found)} held out of training by its split of poses. What is "
                "trained on them cannot be tested on held-out targets of this scene"
            )
    return lines
