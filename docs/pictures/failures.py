"""Episodes of the generalist that failed, on one sheet: what it held, the target's picture, what looked most like it.

    python docs/pictures/failures.py flats-validation docs/pictures/failures.jpg

Scenes with pictures, in order; of each the episode that took longest. The right pictures: the target's, and the one on
the way whose evidence for the target was greatest although it was not there.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import clearway
from clearway import colours
from clearway.agents.generalist import Generalist
from clearway.evaluation.episodes import Trajectory
from clearway.evaluation.goals import drawn_goals
from clearway.evaluation.single import episode_in, memories
from clearway.mapping.held import Laid
from clearway.scenes.scene import Scene
from clearway.viz.held import held_picture

MAP_PX, VIEW_PX, SPACE_PX, CAPTION_PX = (460, 400), (224, 168), 8, 20
STEP_LIMIT = 500


def main() -> None:
    """Draw the sheet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", type=Path)
    parser.add_argument("path", type=Path, help="of the sheet")
    parser.add_argument("--goals", type=int, default=10, help="of each scene")
    parser.add_argument("--count", type=int, default=4, help="of scenes")
    given = parser.parse_args()
    generalist = Generalist.shipped()
    scenes = generalist.seen(clearway.load_scenes([given.scenes])[: given.count])
    tiles = [tile(scene, generalist, given.goals) for scene in scenes]
    width, height = tiles[0].width + SPACE_PX, max(one.height for one in tiles) + SPACE_PX
    sheet = Image.new("RGB", (2 * width, -(-len(tiles) // 2) * height), colours.PAPER)
    for number, one in enumerate(tiles):
        sheet.paste(one, (number % 2 * width, number // 2 * height))
    sheet.save(given.path, quality=84, optimize=True)


def tile(scene: Scene, generalist: Generalist, goals: int) -> Image.Image:
    """The longest episode to some goals: its end on the map, the target's picture and what was taken for it."""
    walks = {
        goal: episode_in(scene, generalist.on_poses, goal, step_limit=STEP_LIMIT, seed=0)[1]
        for goal in drawn_goals(scene, goals, 0)
    }
    target = max(walks, key=lambda goal: len(walks[goal].actions))
    states = walks[target].states
    laid = Laid.around(scene, int(states[0]))
    world, _ = episode_in(scene, generalist.on_poses, target, step_limit=1, seed=0)
    agent = generalist.on_poses(world)
    *_, (_, state) = memories(world, agent, walks[target])
    above = held_picture(scene, agent.holds(state, laid), states, target, MAP_PX)
    size = MAP_PX[0] + SPACE_PX + VIEW_PX[0], max(above.height, 2 * (VIEW_PX[1] + CAPTION_PX)) + CAPTION_PX
    whole = Image.new("RGB", size, colours.PAPER)
    whole.paste(above, (0, CAPTION_PX))
    pen = ImageDraw.Draw(whole)
    there = "found" if states[-1] == target else "not found"
    pen.text((2, 4), f"{scene.name}, pose {target}: {there} in {len(states) - 1} steps", fill=colours.INK)
    pictures = {"the target": target, "most alike elsewhere": mistaken(scene, generalist, walks[target], target)}
    for number, (caption, pose) in enumerate(pictures.items()):
        top = CAPTION_PX + number * (VIEW_PX[1] + CAPTION_PX)
        whole.paste(Image.fromarray(scene.observations[pose]).resize(VIEW_PX), (MAP_PX[0] + SPACE_PX, top))
        pen.text((MAP_PX[0] + SPACE_PX, top + VIEW_PX[1] + 3), caption, fill=colours.INK)
    return whole


def mistaken(scene: Scene, generalist: Generalist, walk: Trajectory, target: int) -> int:
    """The pose of the way, not within two metres of the target, that eyes held most surely to be near it."""
    states = np.unique(walk.states)
    far = np.linalg.norm(scene.locations_m[states] - scene.locations_m[target], axis=1) > 2
    states = states[far] if far.any() else states
    seen, sought = (scene.features[poses].astype(np.float32) for poses in (states, [target] * len(states)))
    return int(states[generalist.sight.whereabouts(seen, sought).max(axis=1).argmax()])


if __name__ == "__main__":
    main()
