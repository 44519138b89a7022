"""clearway: agents that walk to where a picture was taken, designed to anticipate collisions.

A program of one's own needs no more than this module: `docs/python.md` shows it in use. Importing it loads nothing
heavy; each name brings what it needs when it is first asked for.
"""

from clearway.gymnasium_hook import register_with_gymnasium
from clearway.version import __version__

TYPE_CHECKING = False  # typing itself would be half of what this module costs
if TYPE_CHECKING:
    from clearway.agents.agent import Agent, Decisions
    from clearway.api.environments import make_env
    from clearway.api.evaluation import EvaluateResult, evaluate, load_agent
    from clearway.api.generation import generate
    from clearway.api.goals import evaluate_goals
    from clearway.api.live import evaluate_live
    from clearway.api.pretraining import pretrain
    from clearway.api.scenes import build_room, encode_scenes, load_scene, load_scenes
    from clearway.api.training import TrainResult, train
    from clearway.api.views import open_views, take_views
    from clearway.deploy.navigator import Navigator
    from clearway.errors import ClearwayError
    from clearway.learn.a2c import A2C
    from clearway.learn.a3c.config import A3C
    from clearway.learn.bc import BC
    from clearway.learn.learner import Learner
    from clearway.learn.ppo import PPO
    from clearway.learn.presets import PAPER_A2C, PAPER_A3C
    from clearway.learn.q_learning import QLearning
    from clearway.learn.recurrent import Recurrent
    from clearway.reward import Reward
    from clearway.scenes.scene import Scene

_HOME = {  # of each name, in the order in which a reader meets them
    "Scene": "clearway.scenes.scene",
    "load_scene": "clearway.api.scenes",
    "load_scenes": "clearway.api.scenes",
    "build_room": "clearway.api.scenes",
    "generate": "clearway.api.generation",
    "take_views": "clearway.api.views",
    "open_views": "clearway.api.views",
    "pretrain": "clearway.api.pretraining",
    "encode_scenes": "clearway.api.scenes",
    "Reward": "clearway.reward",
    "make_env": "clearway.api.environments",
    "Learner": "clearway.learn.learner",
    "PPO": "clearway.learn.ppo",
    "A2C": "clearway.learn.a2c",
    "A3C": "clearway.learn.a3c.config",
    "BC": "clearway.learn.bc",
    "QLearning": "clearway.learn.q_learning",
    "Adapt": "clearway.learn.adapt",
    "Recurrent": "clearway.learn.recurrent",
    "PAPER_A2C": "clearway.learn.presets",
    "PAPER_A3C": "clearway.learn.presets",
    "train": "clearway.api.training",
    "TrainResult": "clearway.api.training",
    "Agent": "clearway.agents.agent",
    "Decisions": "clearway.agents.agent",
    "evaluate": "clearway.api.evaluation",
    "EvaluateResult": "clearway.api.evaluation",
    "evaluate_goals": "clearway.api.goals",
    "evaluate_live": "clearway.api.live",
    "load_agent": "clearway.api.evaluation",
    "Navigator": "clearway.deploy.navigator",
    "ClearwayError": "clearway.errors",
}

__all__ = [
    "A2C",
    "A3C",
    "BC",
    "PAPER_A2C",
    "PAPER_A3C",
    "PPO",
    "Adapt",
    "Agent",
    "ClearwayError",
    "Decisions",
    "EvaluateResult",
    "Learner",
    "Navigator",
    "QLearning",
    "Recurrent",
    "Reward",
    "Scene",
    "TrainResult",
    "__version__",
    "build_room",
    "encode_scenes",
    "evaluate",
    "evaluate_goals",
    "evaluate_live",
    "generate",
    "load_agent",
    "load_scene",
    "load_scenes",
    "make_env",
    "open_views",
    "pretrain",
    "take_views",
    "train",
]


def __getattr__(name: str) -> object:
    """A name of `_HOME`, imported when it is first asked for."""
    if name not in _HOME:
        raise AttributeError(f"module 'clearway' has no attribute {name!r}")
    value = globals()[name] = _from_home(name)
    return value


def _from_home(name: str) -> object:
    from importlib import import_module

    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    """What can be asked for, and the modules that are loaded."""
    from types import ModuleType

    loaded = [name for name, value in globals().items() if name.startswith("__") or isinstance(value, ModuleType)]
    return sorted({*loaded, *__all__})


register_with_gymnasium()
