"""Trainers and agents of other packages: every fault in one line, and no folder of a run that could not act."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch

import clearway
from clearway.api.training import chosen_learner
from clearway.cli.goals import check_knows_any_room
from clearway.deploy import export
from clearway.deploy.export import export_onnx
from clearway.deploy.from_run import RunAgent, RunInScene, load_run_in_scene
from clearway.deploy.onnx_graph import AgentGraph
from clearway.errors import AgentError, ClearwayError, PluginError, RunError
from clearway.experiments import live_trial
from clearway.learn import running
from clearway.learn.foreign import ForeignTrainer, made_trainer
from clearway.learn.foreign_agent import ForeignTrained
from clearway.learn.load import TrainedNetwork, load_network
from clearway.learn.metrics_log import OWN_FIGURES, metrics_row
from clearway.learn.network_agent import NetworkAgent
from clearway.learn.peers import ALONE
from clearway.learn.q_learning import TableTrainer
from clearway.learn.recurrent import TrainedRecurrent
from clearway.learn.run_folder import RunFolder
from clearway.learn.run_record import record_of
from clearway.learn.train import RunRequest, train_part
from clearway.live import walks
from clearway.live.conditions import Condition, Perturbations
from clearway.live.episodes import LiveProtocol
from clearway.model.policy import ScenePolicy
from clearway.perception import Encoder, encoder_from_record
from clearway.perception.preprocess import Preprocessing
from clearway.perception.random_resnet import ResNetShape, fit_record
from clearway.reward import COLLISION_AWARE
from clearway.scenes.thor_v1 import write_scene
from clearway.view.saved import save_page
from clearway.view.stage import Stage, StageRun
from clearway.view.viewing import Viewing
from helpers.made import corridor_scene, grid_scene
from helpers.own_algorithm import CLASS, SMALL, SOURCE, forget_algorithm, offer_algorithm, with_body, with_trainer
from helpers.small_eyes import seen_by_eyes
from helpers.small_runs import CORRIDOR_TARGETS, corridor_world

SCENE = corridor_scene(5, feature_count=12)
PROTOCOL = LiveProtocol(1, 5, 0, "sampled")
FIGURES = "def update(self): return super().update() and {}"
TENSORS = "def tensors(self): return {}"
FURTHER = "def tensors(self): return super().tensors() | ({} if {} else {{}})"
CLOSES = "def close(self): open({!r}, 'w').close()"
NO_AGENT = "    agent = clearway.Learner.agent\n"  # after a class's last line
AGENT = "def agent(self, record, tensors, frames): {}"
OWN_AGENT = """
class Learnt:
    extra = 7

    def __init__(self, record, frames):
        self.record, self.frames = record, frames

    def on_poses(self, world):
        return {}
"""


def own_agent(agent: str, learner: str, part: str) -> str:
    """A learner whose agents are of a class of its own, derived from ours; what else is in that class is left open."""
    return f"""
from clearway.learn.load import TrainedNetwork
from clearway.learn.ppo import PPO
from clearway.learn.recurrent import Recurrent, TrainedRecurrent


class Mine({agent}):
    {{}}


@dataclass(frozen=True)
class Odd({learner}):
    algorithm: ClassVar[str] = "odd"

    def agent(self, record, tensors, frames):
        found = super().agent(record, tensors, frames)
        return Mine(record, found.network, found.{part}, frames)
"""


OWN_NETWORK = own_agent("TrainedNetwork", "PPO", "feature_map")
OWN_RECURRENT = own_agent("TrainedRecurrent", "Recurrent", "pairs")


def trained(out: Path | None = None, **settings):
    return clearway.train(SCENE, list(CORRIDOR_TARGETS), algorithm="odd", out=out, **{**SMALL, **settings})


def small_odd_request() -> RunRequest:
    learner = chosen_learner("odd", settings=SMALL)
    return RunRequest([SCENE], {SCENE.name: CORRIDOR_TARGETS}, learner, COLLISION_AWARE)


@pytest.mark.parametrize(
    ("source", "told"),
    [
        (with_body("def trainer(self, world): return None"), r"trainer failed \(TypeError: .* were given\)"),
        (with_body("def trainer(self, world, reward, seed): return world.no"), r"trainer failed \(AttributeError"),
        (with_body("def trainer(self, world, reward, seed): return None"), "trainer gives None, which lacks world, "),
        (
            with_trainer("statistics = property(lambda s: 3, lambda s, v: None)"),
            "its trainer's statistics are 3, expected",
        ),
        (with_trainer("def update(self): 1 / 0"), r"update failed \(ZeroDivisionError: division by zero\)"),
        (with_trainer("def update(self): return {}"), "update used no frames, and leaves them at 0"),
        (with_trainer(FIGURES.format("None")), "update gives None, expected figures by name"),
        (with_trainer(FIGURES.format("{'loss': float('nan')}")), "its figure loss is nan, expected a finite number"),
        (with_trainer(FIGURES.format("{'loss': 'big'}")), "its figure loss is 'big', expected a finite number"),
        (with_trainer(FIGURES.format("{'loss': torch.ones(2)}")), r"its figure loss failed \(RuntimeError"),
        (with_trainer(FIGURES.format("{'frames': 5.0}")), "its figure 'frames' has a name that is no text, or one of"),
        (with_trainer(FIGURES.format("{5: 5.0}")), "its figure 5 has a name that is no text"),
        (with_trainer(TENSORS.format("None")), "tensors gives None, expected tensors by name"),
        (with_trainer(TENSORS.format("{'table.values': [1]}")), r"tensors gives \[1\] by the name 'table.values'"),
        (with_trainer(TENSORS.format("{'net.values': self.values}")), "agent failed .*no tensors, by acts_on 'table'"),
        (with_trainer("def fixed_tensors(self): return 1 / 0"), r"fixed_tensors failed \(ZeroDivisionError"),
        (with_trainer("finished = property(lambda self: 1 / 0)"), r"trainer failed \(ZeroDivisionError"),
        (with_trainer("finished = True"), r"its trainer is finished before its first frame\. Ask its authors"),
        (
            with_trainer(FURTHER.format("{'x.y': torch.zeros(2, dtype=torch.complex128)}", "True")),
            r"keeping its tensors failed \(KeyError",
        ),
        (
            with_trainer(FURTHER.format("{'table.y': torch.zeros(2, device='meta')}", "True")),
            r"keeping its tensors failed \(NotImplementedError",
        ),
        (
            with_trainer(FURTHER.format("{'__metadata__': torch.zeros(2)}", "True")),
            r"keeping its tensors failed \(SafetensorError",
        ),
        (
            with_trainer(FURTHER.format("{'x.y': torch.zeros(2, dtype=torch.complex128)}", "self.frames")),
            r"keeping its tensors failed \(KeyError",
        ),
        (with_body("def warn_of(self, scenes): 1 / 0"), r"warn_of failed \(ZeroDivisionError"),
        (with_body("agent = clearway.Learner.agent"), r"agent failed \(KeyError: 'mean'\), given table.values"),
        (with_body(AGENT.format("return None")), "agent gives None, which lacks record, frames, on_poses"),
        (with_body(AGENT.format("return len(5)")), r"agent failed \(TypeError"),
    ],
)
def test_a_fault_is_one_line_that_says_whose_it_is_and_leaves_no_folder(tmp_path, monkeypatch, source, told) -> None:
    offer_algorithm(tmp_path, monkeypatch, source)
    with pytest.raises(PluginError, match=f"^{SOURCE}: {told}") as caught:
        trained(tmp_path / "run")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "run").exists()


def with_a_second_room(request: RunRequest) -> RunRequest:
    (scene,) = request.scenes
    other = replace(scene, name="other")
    return replace(request, scenes=[scene, other], targets={**request.targets, "other": request.targets[scene.name]})


@pytest.mark.parametrize(
    ("name", "asked"),
    [
        ("paid", lambda request: request.paid),
        ("check_workers", lambda request: with_a_second_room(request).check(2)),
        ("check_sees_takes", lambda request: replace(request, takes=())),
    ],
)
def test_what_a_request_asks_of_its_class_is_told_as_its_fault_too(tmp_path, monkeypatch, name, asked) -> None:
    offer_algorithm(tmp_path, monkeypatch, with_body(f"def {name}(self, *given): 1 / 0"))
    with pytest.raises(PluginError, match=rf"^{SOURCE}: {name} failed \(ZeroDivisionError: division by zero\)"):
        asked(small_odd_request())


def test_a_class_that_pays_no_reward_is_told_of(tmp_path, monkeypatch) -> None:
    offer_algorithm(tmp_path, monkeypatch, with_body("def paid(self, reward): return None"))
    with pytest.raises(PluginError, match=rf"^{SOURCE}: paid failed \(TypeError: gives None, expected a Reward\)"):
        trained(tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_run_whose_algorithm_fails_at_its_reward_by_now_is_told_of_in_a_line(tmp_path, monkeypatch) -> None:
    site = offer_algorithm(tmp_path / "then", monkeypatch, CLASS)
    trained(tmp_path / "run")
    forget_algorithm(site, monkeypatch)
    offer_algorithm(tmp_path / "now", monkeypatch, with_body("def paid(self, reward): 1 / 0"))
    with pytest.raises(RunError, match=rf"run\.json: {SOURCE}: paid failed \(ZeroDivisionError: division by zero\)"):
        clearway.load_agent(tmp_path / "run")


@pytest.mark.parametrize(
    ("trainer", "odd"),
    [
        ("", NO_AGENT),
        ("", ""),  # what is in the folder is in the way
        ("finished = True", ""),
        ("finished = property(lambda self: 1 / 0)", ""),
        ("statistics = property(lambda s: 3, lambda s, v: None)", ""),
    ],
)
def test_a_trainer_is_closed_where_its_training_is_refused(tmp_path, monkeypatch, trainer, odd) -> None:
    closed, left = tmp_path / "closed", tmp_path / "run" / "metrics.jsonl"
    left.parent.mkdir()
    left.touch()
    offer_algorithm(tmp_path, monkeypatch, with_trainer(f"{CLOSES.format(str(closed))}\n{trainer}") + odd)
    with pytest.raises((PluginError, RunError)):
        trained(left.parent, resume=True)  # so that it is refused as late as can be
    assert closed.exists()


def test_the_trainer_of_one_of_several_workers_is_closed_too(tmp_path, monkeypatch) -> None:
    closed, folder = tmp_path / "closed", RunFolder(tmp_path / "run")
    offer_algorithm(tmp_path, monkeypatch, with_trainer(CLOSES.format(str(closed))))
    request = small_odd_request()
    with folder.held(), folder.begun(record_of(request), resume=False):
        train_part(request, folder, ALONE, show_progress=False, until_solved=False, track=None, checkpoint_s=60.0)
    assert closed.exists()


def test_an_agent_that_cannot_be_made_is_told_of_before_the_first_frame(tmp_path, monkeypatch) -> None:
    def never(self):
        raise AssertionError("trained")

    monkeypatch.setattr(TableTrainer, "update", never)
    offer_algorithm(tmp_path, monkeypatch, with_body(AGENT.format("return tensors['policy']")))
    with pytest.raises(PluginError, match=r"agent failed \(KeyError: 'policy'\)"):
        trained()


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("raise AttributeError('none')", rf"{SOURCE}: load_tensors failed \(AttributeError: none\)"),
        ("pass", f"{SOURCE}: load_tensors leaves 0 frames and 0 updates, expected 400 and 5"),
        ("raise KeyError('table.other')", r"does not fit its run \('table\.other'\)"),
    ],
)
def test_a_fault_in_going_on_is_one_line_too(tmp_path, monkeypatch, body, told) -> None:
    offer_algorithm(tmp_path, monkeypatch, with_trainer(f"def load_tensors(self, tensors, frames, updates): {body}"))
    trained(tmp_path / "run")
    with pytest.raises((PluginError, RunError), match=told), pytest.warns(UserWarning):
        trained(tmp_path / "run", resume=True, frames=800)


def test_figures_that_are_pytorch_s_and_tensors_of_one_memory_are_kept(tmp_path, monkeypatch) -> None:
    figures = FIGURES.format("{'loss': torch.tensor(1.5)}")
    tensors = "def tensors(self): return super().tensors() | {'table.same': self.values, 'x.y': torch.zeros(3, 4).t()}"
    fixed = "def fixed_tensors(self): return {'fixed': self.values, 'again': self.values[1:]}"
    offer_algorithm(tmp_path, monkeypatch, with_trainer(f"{figures}\n{tensors}\n{fixed}"))
    run = trained(tmp_path / "run")
    assert run.figures["loss"] == 1.5
    assert trained(tmp_path / "run", resume=True).metrics == run.metrics


def test_a_figure_of_a_whole_number_is_kept_as_a_number_with_a_point(tmp_path, monkeypatch) -> None:
    offer_algorithm(tmp_path, monkeypatch, with_trainer(FIGURES.format("{'loss': torch.tensor(2)}")))
    trainer = made_trainer(chosen_learner("odd", settings=SMALL), corridor_world(), COLLISION_AWARE, 0)
    assert type(trainer.update()["loss"]) is float


def test_a_full_disk_is_not_told_as_the_package_s_fault(tmp_path, monkeypatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    offer_algorithm(tmp_path, monkeypatch, CLASS)
    monkeypatch.setattr(running, "write_checkpoint", full)
    with pytest.raises(OSError, match="No space left on device"):
        trained(tmp_path / "run")


def test_interruptions_pass_and_faults_of_ours_keep_their_traceback(tmp_path, monkeypatch) -> None:
    offer_algorithm(tmp_path, monkeypatch, with_trainer("def update(self): raise KeyboardInterrupt"))
    with pytest.raises(KeyboardInterrupt):
        trained()
    monkeypatch.setattr(TableTrainer, "update", lambda self: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        clearway.train(SCENE, algorithm="q-learning", **SMALL)


@pytest.mark.parametrize(
    ("gives", "told"),
    [
        (
            "1 / 0",
            rf"{SOURCE}: on_poses failed \(ZeroDivisionError: division by zero\) at .*/odd_learner\.py:\d+\. Ask its",
        ),
        ("None", f"{SOURCE}: gives None, expected an object with sees, reset and act"),
        (
            "clearway.agents.by_pose.PoseAgent(world, lambda history, target: 1 / 0)",
            rf"{SOURCE}: failed \(ZeroDivision",
        ),
    ],
)
def test_an_agent_s_faults_in_walking_are_told_as_its_package_s(tmp_path, monkeypatch, gives, told) -> None:
    body = with_body(AGENT.format("return Learnt(record, frames)"))
    offer_algorithm(tmp_path, monkeypatch, "import clearway.agents.by_pose\n" + OWN_AGENT.format(gives) + body)
    run = trained()
    assert isinstance(run.agent, ForeignTrained) and run.agent.extra == 7 and run.agent.frames == 400
    with pytest.raises((PluginError, AgentError), match=told):
        clearway.evaluate(run, episodes=1, step_limit=5)
    with pytest.raises((PluginError, AgentError), match=told):
        clearway.evaluate_goals(run.agent, SCENE, goals=1, step_limit=5)


def test_an_agent_derived_from_our_network_s_has_a_network(tmp_path, monkeypatch) -> None:
    offer_algorithm(tmp_path, monkeypatch, OWN_NETWORK.format("pass"))
    run = trained(tmp_path / "run", width=16)
    assert isinstance(run.agent, ForeignTrained)
    assert type(load_network(tmp_path / "run")).__name__ == "Mine"


def in_corridor(folder: Path, monkeypatch: pytest.MonkeyPatch, source: str) -> RunInScene:
    """The agent of a run of this algorithm in its scene."""
    offer_algorithm(folder, monkeypatch, source)
    trained(folder / "run", width=16)
    write_scene(SCENE, folder / "corridor.h5")
    return load_run_in_scene(folder / "run", files=[folder / "corridor.h5"])


OWN_ANSWER = """
    def in_scene(self, index):
        found = super().in_scene(index)
        plain = found.forward

        def forward(history, target):
            p, v = plain(history, target)
            return {}

        found.forward = forward
        return found
"""
OWN_FORWARD = """
    def in_scene(self, index):
        found = super().in_scene(index)
        found.forward = lambda history, target: 1 / 0
        return found
"""


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("def in_scene(self, index): 1 / 0", r"in_scene failed \(ZeroDivisionError: division by zero\)"),
        ("def in_scene(self, index): raise SystemExit(3)", r"in_scene failed \(SystemExit: 3\)"),
        ("def in_scene(self, index): return 5", r"in_scene failed \(TypeError: gives 5, expected a ScenePolicy"),
        (OWN_FORWARD, r"its network failed \(ZeroDivisionError: division by zero\)"),
    ],
)
def test_an_agent_of_a_package_that_cannot_be_exported_is_one_line(tmp_path, monkeypatch, body, told) -> None:
    chosen = in_corridor(tmp_path, monkeypatch, OWN_NETWORK.format(body))
    with pytest.raises(PluginError, match=rf"^{SOURCE}: {told}.*\. Ask its authors") as caught:
        export_onnx(chosen, tmp_path / "agent.onnx", with_encoder=False)
    assert "\n" not in str(caught.value) and not (tmp_path / "agent.onnx").exists()


def test_a_package_s_network_that_fails_while_walking_is_its_fault(tmp_path, monkeypatch) -> None:
    chosen = in_corridor(tmp_path, monkeypatch, OWN_NETWORK.format(OWN_FORWARD))
    agent = NetworkAgent(chosen.trained, chosen.index)
    features = {agent.sees[0]: np.asarray(SCENE.features[:1])}
    state = agent.reset(features, np.zeros(1, np.int64))
    with pytest.raises(PluginError, match=rf"^{SOURCE}: its network failed \(ZeroDivisionError: division by zero\)"):
        agent.act(features, state)


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        ("(p.tolist(), v)", "AttributeError: 'list' object has no attribute 'shape'"),
        ("(p, v[:, 0])", r"ValueError: gives tensor\(\[.*, expected \(1, 1\) finite numbers"),
        ("(p[:, :2], v)", r"ValueError: gives tensor\(\[\[.*, expected \(1, 4\) finite numbers"),
        ("(p * float('nan'), v)", r"ValueError: gives tensor\(\[\[nan.*, expected \(1, 4\) finite numbers"),
        ("(p,)", "ValueError: not enough values to unpack"),
    ],
)
def test_answers_of_a_package_s_network_are_looked_at(tmp_path, monkeypatch, answer, told) -> None:
    chosen = in_corridor(tmp_path, monkeypatch, OWN_NETWORK.format(OWN_ANSWER.format(answer)))
    agent = NetworkAgent(chosen.trained, chosen.index)
    features = {agent.sees[0]: np.asarray(SCENE.features[:1])}
    with pytest.raises(PluginError, match=rf"^{SOURCE}: its network failed \({told}.*\. Ask its authors"):
        agent.act(features, agent.reset(features, np.zeros(1, np.int64)))


def test_an_encoder_that_fails_is_not_the_package_s_fault(tmp_path, monkeypatch) -> None:
    chosen = in_corridor(tmp_path, monkeypatch, OWN_NETWORK.format("pass"))
    agent = NetworkAgent(chosen.trained, chosen.index)
    state = agent.reset({agent.sees[0]: np.asarray(SCENE.features[:1])}, np.zeros(1, np.int64))
    with pytest.raises(KeyError, match=r"^'features'$"):
        agent.act({}, state)


NO_LENGTH = """
    def in_scene(self, index):
        class Policy(type(super().in_scene(index))):
            history_length = property(lambda self: 1 / 0)
        return Policy(self.network, self.feature_map, index, 1.0)
"""


def test_a_policy_that_cannot_say_its_length_is_its_package_s_fault(tmp_path, monkeypatch) -> None:
    chosen = in_corridor(tmp_path, monkeypatch, OWN_NETWORK.format(NO_LENGTH))
    with pytest.raises(PluginError, match=rf"^{SOURCE}: its network failed \(ZeroDivisionError"):
        NetworkAgent(chosen.trained, chosen.index)


class Taken(Exception):
    """Who would have walked."""


def test_whoever_walks_by_a_run_s_network_is_guarded(tmp_path, monkeypatch) -> None:
    chosen = in_corridor(tmp_path, monkeypatch, OWN_NETWORK.format("pass"))
    place = SimpleNamespace(encoder=None, live=SimpleNamespace(scene=SCENE), world=None, camera=None)
    (walker,) = live_trial._walkers([place], tmp_path / "run", SimpleNamespace(walker="agent"))
    assert isinstance(walker, NetworkAgent) and issubclass(RunAgent, NetworkAgent)

    def taken(live: object, world: object, agent: object, *_: object) -> None:
        raise Taken(agent)

    monkeypatch.setattr(walks, "run_live_episodes", taken)
    with pytest.raises(Taken) as caught:
        walks.walk_setting([place], {"odd": chosen.trained}, Condition("none", Perturbations()), PROTOCOL)
    assert isinstance(caught.value.args[0], NetworkAgent)


def test_one_that_fails_on_the_grid_before_a_live_walk_is_told_of_too(tmp_path, monkeypatch) -> None:
    chosen = in_corridor(tmp_path, monkeypatch, OWN_NETWORK.format("def on_poses(self, world): 1 / 0"))
    agents = {"odd": load_network(tmp_path / "run")}
    with pytest.raises(PluginError, match=rf"^{SOURCE}: on_poses failed \(ZeroDivisionError"):
        walks.walk_on_grid(agents, [chosen.scene], {SCENE.name: CORRIDOR_TARGETS}, PROTOCOL)


NORMED = """
    def in_scene(self, index):
        if not hasattr(self, "normed"):
            self.normed = super().in_scene(index)
            norm, plain = torch.nn.BatchNorm1d(12), self.normed.forward
            self.normed.add_module("norm", norm)
            self.normed.forward = lambda history, target: plain(history, norm(target))
        return self.normed
"""


def test_an_export_leaves_a_package_s_network_as_it_is(tmp_path, monkeypatch) -> None:
    chosen = in_corridor(tmp_path, monkeypatch, OWN_NETWORK.format(NORMED))
    before = {name: tensor.clone() for name, tensor in chosen.policy.state_dict().items()}
    export_onnx(chosen, tmp_path / "agent.onnx", with_encoder=False)
    after = chosen.policy.state_dict()
    assert "norm.running_var" in before and before.keys() == after.keys()
    assert all(torch.equal(tensor, after[name]) for name, tensor in before.items())


def test_what_a_package_s_agent_tells_of_its_network_is_guarded_too(tmp_path, monkeypatch) -> None:
    chosen = in_corridor(tmp_path, monkeypatch, OWN_NETWORK.format("pass"))
    monkeypatch.setattr(type(chosen.trained), "feature_map", property(lambda self: 1 / 0), raising=False)
    with pytest.raises(PluginError, match=rf"^{SOURCE}: what it tells of its network failed \(ZeroDivisionError"):
        chosen.card(None)


def translator(refuses: tuple[type, ...]) -> Callable[..., SimpleNamespace]:
    """A translator to ONNX that knows everything but modules of these kinds."""

    def export(module: torch.nn.Module, *_: object, **__: object) -> SimpleNamespace:
        if isinstance(module, refuses):
            raise ValueError("no such operator")
        return SimpleNamespace(model_proto=None)

    return export


@pytest.mark.parametrize("inside", [False, True])
def test_a_package_s_network_that_cannot_be_translated_is_its_fault(tmp_path, monkeypatch, inside) -> None:
    monkeypatch.setattr("torch.onnx.export", translator((ScenePolicy, AgentGraph)))
    monkeypatch.setattr(export, "exportable_encoder", lambda _: tiny_encoder())
    chosen = in_corridor(tmp_path, monkeypatch, OWN_NETWORK.format("pass"))
    with pytest.raises(PluginError, match=rf"^{SOURCE}: translating its network failed \(ValueError: no such op"):
        export_onnx(chosen, tmp_path / "a.onnx", with_encoder=inside)


@pytest.mark.parametrize("refuses", [AgentGraph, torch.nn.Module])
def test_what_else_cannot_be_translated_is_not(tmp_path, monkeypatch, refuses) -> None:
    """An operator of our encoder's, or the translator itself."""
    monkeypatch.setattr("torch.onnx.export", translator((refuses,)))
    monkeypatch.setattr(export, "exportable_encoder", lambda _: tiny_encoder())
    chosen = in_corridor(tmp_path, monkeypatch, OWN_NETWORK.format("pass"))
    with pytest.raises(ValueError, match=r"^no such operator"):
        export_onnx(chosen, tmp_path / "a.onnx")


def test_nor_is_a_network_of_ours(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("torch.onnx.export", translator((ScenePolicy,)))
    of_ours = OWN_NETWORK.partition("    def agent")[0].format("pass")
    with pytest.raises(ValueError, match=r"^no such operator"):
        export_onnx(in_corridor(tmp_path, monkeypatch, of_ours), tmp_path / "a.onnx", with_encoder=False)


def tiny_encoder() -> Encoder:
    """One of ours to 12 features."""
    pictures = [np.random.default_rng(0).integers(0, 256, (32, 12, 16, 3), np.uint8)]
    shape = ResNetShape(8, (12,), (1,), "basic")
    return encoder_from_record(fit_record(pictures, shape=shape, preprocessing=Preprocessing(16, 20)))


def recurrent_run(folder: Path, monkeypatch: pytest.MonkeyPatch, body: str) -> clearway.TrainResult:
    """A run of an agent derived from our recurrent one, whose class has this body."""
    offer_algorithm(folder, monkeypatch, OWN_RECURRENT.format(body))
    (scene,) = seen_by_eyes(folder / "eyes", corridor_scene(5))
    return clearway.train(scene, [8, 16], algorithm="odd", **{**SMALL, "frames": 80}, width=8)


def test_an_agent_derived_from_our_recurrent_one_goes_anywhere_as_that_does(tmp_path, monkeypatch) -> None:
    agent = recurrent_run(tmp_path, monkeypatch, "pass").agent
    assert isinstance(agent, ForeignTrained)
    own = agent.trained
    ours = TrainedRecurrent(replace(own.record, learner=clearway.Recurrent()), own.network, own.pairs, own.frames)
    elsewhere, asked = grid_scene(2), {"goals": 4, "step_limit": 20}
    told, *_ = clearway.evaluate_goals(agent, elsewhere, **asked)
    assert told.agent == "odd" and told.scenes == clearway.evaluate_goals(ours, elsewhere, **asked)[0].scenes
    check_knows_any_room(agent)  # of rooms that are generated for it


@pytest.mark.parametrize(
    ("body", "walk", "told"),
    [
        ("def seen(self, scenes): 1 / 0", clearway.evaluate_goals, r"seen failed \(ZeroDivisionError"),
        ("def warn_of_aspect(self, scenes): 1 / 0", clearway.evaluate_live, r"warn_of_aspect failed \(ZeroDivision"),
        ("def behind_camera(self): 1 / 0", clearway.evaluate_live, r"behind_camera failed \(ZeroDivisionError"),
        ("def behind_camera(self): return 5", clearway.evaluate_live, "gives 5, expected an object with sees, reset"),
    ],
)
def test_its_faults_anywhere_are_its_package_s(tmp_path, monkeypatch, body, walk, told) -> None:
    agent = recurrent_run(tmp_path, monkeypatch, body).agent
    with pytest.raises((PluginError, AgentError), match=f"^{SOURCE}: {told}"):
        walk(agent, grid_scene(2), goals=2, step_limit=5)


def test_the_eyes_of_a_package_s_agent_that_fail_are_told_of(tmp_path, monkeypatch) -> None:
    agent = recurrent_run(tmp_path, monkeypatch, "encoder = property(lambda self: 1 / 0)").agent
    monkeypatch.setattr("clearway.live.live_room.check_is_room", lambda scene: None)
    monkeypatch.setattr(agent.trained.__class__, "seen", lambda self, scenes: list(scenes))
    with pytest.raises(PluginError, match=rf"^{SOURCE}: encoder failed \(ZeroDivisionError"):
        clearway.evaluate_goals(agent, grid_scene(2), goals=2, step_limit=5, perturb="light=0.5", takes=1)


def test_what_is_ours_stands_behind_no_guard(tmp_path, monkeypatch) -> None:
    offer_algorithm(tmp_path, monkeypatch, CLASS)
    assert type(trained().agent).__name__ == "TrainedTable"
    world, learner = corridor_world(), clearway.QLearning(**SMALL)
    assert isinstance(made_trainer(learner, world, COLLISION_AWARE, 0), TableTrainer)
    assert isinstance(made_trainer(trained().record.learner, world, COLLISION_AWARE, 0), ForeignTrainer)


def test_rows_have_no_other_names_than_those_that_are_refused() -> None:
    trainer = clearway.QLearning(**SMALL).trainer(corridor_world(), COLLISION_AWARE, 0)
    assert set(metrics_row(trainer, {}, 0.0)) == set(OWN_FIGURES) - {"slowest_worker", "slowest_factor"}


OWN_LOOKUP = """
    def lookup(self, world):
        {}
        class Lookup(type(super().lookup(world))):
            def for_targets(self, *given):
                {}
                found, asked = super().for_targets(*given), []
                plain = found.forward
                def forward(*rows):
                    asked.append(rows)
                    output = plain(*rows)
                    {}
                    return output
                found.forward = forward
                return found
        found = super().lookup(world)
        found.__class__ = Lookup
        return found
"""


def viewed(folder: Path, monkeypatch: pytest.MonkeyPatch, lookup: str = "", targets: str = "", walking: str = ""):
    """A stage on which an agent walks whose network has these lines of its own."""
    source = OWN_LOOKUP.format(*(line or "pass" for line in (lookup, targets, walking)))
    chosen = in_corridor(folder, monkeypatch, OWN_NETWORK.format(source))
    run = StageRun("run", chosen.trained, (SCENE,))
    return Stage((SCENE,), {SCENE.name: CORRIDOR_TARGETS}, (run,))


@pytest.mark.parametrize(("line", "told"), [("1 / 0", "ZeroDivisionError"), ("return None", "TypeError: gives None")])
def test_a_package_s_network_that_cannot_be_shown_is_its_fault(tmp_path, monkeypatch, line, told) -> None:
    stage = viewed(tmp_path, monkeypatch, lookup=line)
    with pytest.raises(PluginError, match=rf"^{SOURCE}: lookup failed \({told}"):
        stage.agents[0].make_ready()


BEGIN = {"do": "begin", "episode": "scene=corridor&start=2&target=8"}


def test_a_package_s_network_without_targets_is_its_fault_in_the_viewer(tmp_path, monkeypatch) -> None:
    answer = Viewing(viewed(tmp_path, monkeypatch, targets="1 / 0")).answer(BEGIN)
    assert answer["kind"] == "refused" and f"{SOURCE}: its network failed (ZeroDivisionError" in answer["text"]


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("if len(asked) == 2: 1 / 0", f"{SOURCE}: failed (ZeroDivisionError: division by zero)"),
        (
            "if len(asked) == 2: output.scores.fill_(float('nan'))",
            "the agent gave probabilities that are negative, not",
        ),
        ("if len(asked) == 2: output.value.fill_(float('nan'))", "the agent gave values that are not finite"),
    ],
)
def test_a_package_s_network_that_fails_at_a_step_ends_the_episode(tmp_path, monkeypatch, line, told) -> None:
    stage = viewed(tmp_path, monkeypatch, walking=line)
    session = Viewing(stage)
    assert session.answer(BEGIN)["kind"] == "episode"
    answer = session.answer({"do": "step"})
    assert answer["kind"] == "refused" and told in answer["text"]
    after = session.answer({"do": "step"})
    assert (after["steps"], after["ended"]) == ([None], [True])
    assert len(session.walkers[0].steps) == 1  # what the page was told
    with pytest.raises(ClearwayError) as caught:
        save_page(stage, tmp_path / "page", first=BEGIN["episode"], episodes=1)
    assert told in str(caught.value) and not (tmp_path / "page").exists()


def test_who_walked_before_another_failed_takes_the_step_back(tmp_path, monkeypatch) -> None:
    stage = viewed(tmp_path, monkeypatch, walking="if len(asked) == 3: 1 / 0")
    (bad,) = stage.agents
    own = bad.trained
    good = StageRun("good", TrainedNetwork(own.record, own.network, own.feature_map, own.frames), (SCENE,))
    session = Viewing(replace(stage, agents=(good, bad)))
    assert session.answer(BEGIN)["kind"] == "episode"
    link = session.answer({"do": "step"})["link"]
    assert session.answer({"do": "step"})["kind"] == "refused"
    assert [len(walker.steps) for walker in session.walkers] == [2, 2]
    after = session.answer({"do": "step"})
    assert (after["steps"], after["ended"], after["link"]) == ([None, None], [True, True], link)


def test_values_of_a_package_s_network_are_looked_at_before_they_are_mapped(tmp_path, monkeypatch) -> None:
    session = Viewing(viewed(tmp_path, monkeypatch, walking="if len(asked) == 2: output.value.fill_(float('nan'))"))
    assert session.answer(BEGIN)["kind"] == "episode"
    answer = session.answer({"do": "map", "walker": 0})
    assert answer["kind"] == "refused" and "values that are not finite" in answer["text"]
