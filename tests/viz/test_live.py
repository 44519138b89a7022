from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from clearway.agents.agent import Decisions, Observation, State
from clearway.agents.by_pose import RandomWalk
from clearway.live.conditions import REFERENCE, Condition, Perturbations
from clearway.live.episodes import LiveProtocol, run_live_episodes
from clearway.live.results import Comparison, Figures, LiveResult, summarise
from clearway.live.walks import LiveOutcome, LiveScene
from clearway.perception.encode import encoder_from_record
from clearway.rooms.camera import eye_view
from clearway.rooms.render import studio
from clearway.scenes.sensors import RGB
from clearway.viz.figures import CURVES
from clearway.viz.live import PANELS, ROW_IN, _moves_to, _view, draw_live_figures
from clearway.world.world import make_world
from helpers.made import corridor_scene
from helpers.small_live import walkable_live


def figures(value: float) -> Figures:
    values = {metric: value for metric, _, _ in PANELS}
    return Figures(values, dict.fromkeys(values, (value - 0.1, value + 0.1)))


def results(count: int) -> list[LiveResult]:
    none: Comparison | None = None
    agents = {"shortest": figures(0.4), "collision-aware": figures(0.8)}
    return [LiveResult(f"setting {number}", Perturbations(), agents, none) for number in range(count)]


def colour_share(picture: np.ndarray, colour: str) -> float:
    wanted = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)])
    return float((np.abs(picture.astype(int) - wanted).max(axis=2) < 12).mean())


@pytest.mark.slow
def test_a_row_a_setting_and_a_colour_an_agent(tmp_path: Path) -> None:
    sizes = []
    for count in (1, 4):
        draw_live_figures(results(count), tmp_path / "live.png")
        picture = np.array(Image.open(tmp_path / "live.png").convert("RGB"))
        sizes.append(picture.shape[0])
        for style in CURVES[:2]:
            assert colour_share(picture, style.colour) > 1e-4
    assert sizes[1] - sizes[0] == round(3 * ROW_IN * 160)


def test_a_place_lies_ahead_where_free_moves_lead_there() -> None:
    scene = corridor_scene(5)  # state 4 * cell + heading / 90, cells along +z
    place_m = scene.locations_m[4 * 3]
    assert _moves_to(scene, 4 * 1, place_m) == 2  # two moves forward
    assert _moves_to(scene, 4 * 1 + 2, place_m) == 0  # looks the other way
    assert _moves_to(scene, 4 * 1 + 1, place_m) == 0  # blocked
    assert _moves_to(scene, 4 * 3, place_m) == 0  # stands there


@pytest.mark.slow
def test_the_view_is_what_the_agent_saw_in_that_episode() -> None:
    """At its start, under every perturbation: layout, light, jitter and noise are the episode's own."""
    live, seen = walkable_live(), []
    assert live.scene.encoder is not None
    encoder = encoder_from_record(live.scene.encoder)

    class Looking(RandomWalk):
        sees = (RGB,)

        def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
            seen.append(observation[RGB].copy())
            return super().act({}, state)

    world = make_world([live.scene], {live.scene.name: (8, 41)})
    protocol = LiveProtocol(episodes_per_target=2, step_limit=1, seed=5, selection="sampled")
    with studio(live.model, eye_view(), workers=1) as camera:
        table = run_live_episodes(live, world, Looking(), camera, REFERENCE, protocol)
        result = summarise("all", REFERENCE, {"uniform": (table,)}, seed=0)
        outcome = LiveOutcome(Condition("all", REFERENCE), result, {"uniform": (table,)})
        stage = LiveScene(live, world, encoder, camera)
        for episode, start in enumerate(seen[0]):
            x_m, z_m, heading_deg = table.walks[episode][0].tolist()
            np.testing.assert_array_equal(_view(stage, 0, outcome, episode, (x_m, z_m, heading_deg)), start)
