"""The demo's pictures and its page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from clearway.agents.generalist import GENERALIST
from clearway.evaluation.summary import Evaluation
from clearway.evaluation.tables import REFERENCES, table_text
from clearway.experiments.demo import DemoResult
from clearway.experiments.demo_generalist import FirstWalk
from clearway.learn.presets import DEFAULT
from clearway.learn.provenance import facts_text, hardware, package_versions
from clearway.viz.contact_sheet import draw_contact_sheet
from clearway.viz.curves import draw_curves
from clearway.viz.figures import BY_REWARD, LINES, counted
from clearway.viz.held import held_picture
from clearway.viz.maps import Walk, draw_map
from clearway.viz.page import Opening, Page, Picture, write_page
from clearway.zones import scene_zones

PICTURES = "pictures"
BELIEF_PX = (960, 960)  # at most
VIEWS = 6  # first-person pictures of the room
SENTENCE = (
    "Two agents learnt to walk to the place where a picture was taken, from pictures alone: one is paid to anticipate "
    "collisions, the other to take the shortest way."
)


def make_demo_page(result: DemoResult, command: str, opening: Opening | None = None) -> Path:
    """Draw the pictures of a demo and write its index.html; returns the page's path.

    Args:
        result: what was trained and evaluated.
        command: the command line that made the demo.
        opening: shown first; its pictures are in the demo's folder already.
    """
    first = result.evaluations[0]
    page = Page(
        title="clearway: anticipating collisions on the way to a picture",
        sentence=SENTENCE,
        opening=opening or Opening(),
        unseen=_unseen(result),
        unseen_text=_unseen_text(result.first),
        maps=_maps(result),
        rooms=_views(result),
        table=table_text(_one_each(result.evaluations), "scenes", width="page"),
        more_tables={
            "All rows": table_text(result.evaluations, "scenes"),
            "Every target": table_text(result.evaluations, "targets"),
        },
        contact_sheets=_contact_sheets(result),
        curves=_curves(result),
        commands=(command,),
        facts={
            "encoder": first.encoder,
            "room": f"{result.scene.name}, {result.scene.cell_count} cells, {result.scene.state_count} poses",
            "training": _training(result),
            "evaluation": f"{first.protocol.episodes_per_target} episodes a target from random starts, at most "
            f"{first.protocol.step_limit:,} steps; intervals are 95 % bootstrap",
            "seconds": ", ".join(f"{name} {seconds:.0f}" for name, seconds in result.seconds.items()),
            "versions": facts_text(package_versions()),
            "hardware": facts_text(hardware()),
        },
    )
    return write_page(result.out, page)


def _one_each(evaluations: Sequence[Evaluation]) -> list[Evaluation]:
    """Every agent by its first way of acting, without the exact optima."""
    first: dict[str, Evaluation] = {}
    for evaluation in evaluations:
        first.setdefault(evaluation.agent, evaluation)
    return [one for name, one in first.items() if not name.startswith(tuple(REFERENCES))]


def _training(result: DemoResult) -> str:
    record = next(iter(result.runs.values())).read_record()
    return f"{record.learner.algorithm.upper()}, {record.learner.frames:,} frames an agent, seed {record.seed}"


def _maps(result: DemoResult) -> list[Picture]:
    show, file = result.showcase, f"{PICTURES}/map.png"
    draw_map(
        result.scene,
        result.out / file,
        zones=scene_zones(result.scene),
        target=show.target,
        walks=[Walk(name, show.walks[name].states) for name in BY_REWARD],
    )
    steps = ", ".join(f"{name} {len(show.walks[name].actions)}" for name in BY_REWARD)
    caption = f"The same start and target for both agents. Steps: {steps}; shortest path {show.shortest_path_steps}."
    return [Picture(file, caption, "The room from above with zones and the ways of both agents")]


def _unseen_text(first: FirstWalk) -> str:
    steps = counted(len(first.walk.actions), "step")
    went = f"It came to the target in {steps}" if first.reached else f"It did not find the target in {steps}"
    return (
        f"The generalist, which comes with clearway, in a room made from seed {first.seed} that it has never entered. "
        f"{went} with {counted(first.collisions, 'collision')}; "
        f"the shortest path has {first.shortest_path_steps}. Another room: --room-seed."
    )


def _unseen(result: DemoResult) -> list[Picture]:
    """The way on the map, what was held at its end, and what was seen."""
    first, zones = result.first, scene_zones(result.first.scene)
    way, belief, seen = (f"{PICTURES}/unseen-{name}.png" for name in ("map", "belief", "episode"))
    states, actions = first.walk.states, first.walk.actions
    draw_map(first.scene, result.out / way, zones=zones, target=first.target, walks=[Walk(GENERALIST, states)])
    picture = held_picture(first.scene, first.held, states, first.target, BELIEF_PX)
    picture.save(result.out / belief)
    draw_contact_sheet(
        first.scene,
        result.out / seen,
        states=states,
        actions=actions,
        zones=zones,
        target=first.target,
        title=GENERALIST,
    )
    held = "What it held at the end: light where a body can stand; green where the target may be; red, itself."
    return [
        Picture(way, "The room as it is, and its way.", "The room from above with zones and the way of the generalist"),
        Picture(belief, held),
        Picture(seen, "What it saw on that way. The first picture is the target."),
    ]


def _contact_sheets(result: DemoResult) -> list[Picture]:
    zones, show = scene_zones(result.scene), result.showcase
    pictures = []
    for name in BY_REWARD:
        walk = show.walks[name]
        file = f"{PICTURES}/episode-{name}.png"
        draw_contact_sheet(
            result.scene,
            result.out / file,
            states=walk.states,
            actions=walk.actions,
            zones=zones,
            target=show.target,
            title=f"{name} agent",
        )
        pictures.append(Picture(file, f"What the {name} agent saw on that way."))
    return pictures


def _curves(result: DemoResult) -> list[Picture]:
    file = f"{PICTURES}/curves.png"
    draw_curves({name: result.runs[name].metrics() for name in BY_REWARD}, result.out / file, looks=LINES)
    told = f"Training episodes: sampled actions, random starts, cut after {DEFAULT.step_limit} steps."
    return [Picture(file, told, "Learning curves")]


def _views(result: DemoResult) -> list[Picture]:
    """Pictures from poses spread over the room, the most varied of each cell."""
    from PIL import Image

    scene = result.scene
    assert scene.observations is not None
    pictures = []
    for number, cell in enumerate(np.linspace(0, scene.cell_count - 1, VIEWS).astype(int)):
        poses = np.flatnonzero(scene.cells == cell)
        views = scene.observations[poses]
        pose = int(np.argmax(views.reshape(len(views), -1).std(1)))
        file = f"{PICTURES}/view-{number}.png"
        Image.fromarray(views[pose]).save(result.out / file)
        x_m, z_m = scene.locations_m[poses[pose]]
        heading = scene.headings_deg[poses[pose]]
        pictures.append(Picture(file, f"From x {x_m:.2f} m, z {z_m:.2f} m, heading {heading}°"))
    return pictures
