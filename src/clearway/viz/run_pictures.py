"""Pictures of a trained agent: for each scene a map and the views of one episode, and the learning curves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from clearway.evaluation.showcase import showcases
from clearway.learn.load import TrainedAgent, run_world
from clearway.learn.run_folder import RunFolder
from clearway.scenes.scene import Scene
from clearway.viz.contact_sheet import draw_contact_sheet
from clearway.viz.curves import draw_curves
from clearway.viz.maps import Walk, draw_map
from clearway.zones import scene_zones


def draw_run_pictures(
    run: Path, agent: TrainedAgent, scenes: Sequence[Scene], folder: Path, seed: int = 0
) -> list[Path]:
    """Draw them into `folder` and return their paths; scenes without pictures get no contact sheet."""
    folder.mkdir(parents=True, exist_ok=True)
    world, level = run_world(agent.record, scenes), agent.record.zone_level
    name = agent.record.reward.name
    shown = showcases(world, {name: agent.on_poses(world)}, scenes, seed=seed)
    made = [folder / "curves.png"]
    draw_curves({name: RunFolder(run).metrics()}, made[0])
    for scene, show in zip(scenes, shown, strict=True):
        zones, walk = scene_zones(scene, level), show.walks[name]
        made.append(folder / f"map-{scene.name}.png")
        draw_map(scene, made[-1], zones=zones, target=show.target, walks=[Walk(name, walk.states)])
        if scene.observations is not None:
            made.append(folder / f"episode-{scene.name}.png")
            draw_contact_sheet(
                scene, made[-1], states=walk.states, actions=walk.actions, zones=zones, target=show.target, title=name
            )
    return made
