"""The little of ROS 2 that the node uses, without ROS: what it publishes is kept, time is set by hand."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any, ClassVar

import pytest


class Message(SimpleNamespace):
    """Any message; fields that are not given are zeros where the node reads them."""


class Twist(Message):
    def __init__(self) -> None:
        super().__init__(linear=Message(x=0.0, y=0.0, z=0.0), angular=Message(x=0.0, y=0.0, z=0.0))


class Logger:
    def __init__(self) -> None:
        self.lines: list[str] = []

    def error(self, line: str) -> None:
        self.lines.append(line)

    warning = fatal = info = error


LOGGER = Logger()


class Node:
    """Keeps what is made on it, by name."""

    parameters: ClassVar[dict[str, Any]] = {}
    made: ClassVar[list[Any]] = []

    def __init__(self, name: str) -> None:
        self.name, self.seconds = name, 0.0
        self.published: list[tuple[str, Any]] = []
        self.subscriptions_: dict[str, tuple[type, Callable[[Any], None], Any]] = {}
        self.services_: dict[str, Callable[[Any, Any], Any]] = {}
        self.timers_: list[tuple[float, Callable[[], None]]] = []
        self.groups: dict[str, Any] = {}
        self.destroyed = False
        Node.made.append(self)

    def declare_parameter(self, name: str, default: Any) -> Any:
        value = self.parameters.get(name, default)
        if type(value) is not type(default):
            raise PARAMETER_FAULT(f"{name} has another type")
        return SimpleNamespace(value=value)

    def create_publisher(self, kind: type, topic: str, depth: int) -> Any:
        return SimpleNamespace(publish=lambda message: self.published.append((topic, message)))

    def create_subscription(self, kind: type, topic: str, heard: Any, quality: Any, *, callback_group: Any) -> None:
        self.subscriptions_[topic], self.groups[topic] = (kind, heard, quality), callback_group

    def create_service(self, kind: type, name: str, answer: Any, *, callback_group: Any) -> None:
        self.services_[name], self.groups[name] = answer, callback_group

    def create_timer(self, period_s: float, tick: Callable[[], None], *, callback_group: Any) -> None:
        self.timers_.append((period_s, tick))
        self.groups["timer"] = callback_group

    def get_logger(self) -> Logger:
        return LOGGER

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=int(self.seconds * 1e9)))

    def destroy_node(self) -> None:
        self.destroyed = True

    # For tests

    def hear(self, topic: str, message: Any) -> None:
        """Give it a message."""
        self.subscriptions_[topic][1](message)

    def heard_on(self, topic: str) -> list[Any]:
        """What it has published on a topic."""
        return [message for name, message in self.published if name == topic]


class ParameterFault(Exception):
    """Stands for rclpy's own."""


PARAMETER_FAULT = ParameterFault


class Executor:
    """Does nothing, and is interrupted."""

    def __init__(self, num_threads: int) -> None:
        self.num_threads = num_threads

    def add_node(self, node: Node) -> None:
        assert not node.destroyed

    def spin(self) -> None:
        raise KeyboardInterrupt


def modules() -> dict[str, ModuleType]:
    """The modules by name."""
    made = {
        "rclpy": {
            "init": lambda **given: None,
            "try_shutdown": lambda: None,
            "logging": SimpleNamespace(get_logger=lambda name: LOGGER),
        },
        "rclpy.node": {"Node": Node},
        "rclpy.callback_groups": {
            "MutuallyExclusiveCallbackGroup": type("MutuallyExclusiveCallbackGroup", (), {}),
            "ReentrantCallbackGroup": type("ReentrantCallbackGroup", (), {}),
        },
        "rclpy.exceptions": {"ParameterException": ParameterFault},
        "rclpy.executors": {
            "ExternalShutdownException": type("ExternalShutdownException", (Exception,), {}),
            "MultiThreadedExecutor": Executor,
        },
        "rclpy.qos": {"qos_profile_sensor_data": "best effort"},
        "rclpy.signals": {"SignalHandlerOptions": SimpleNamespace(NO=0)},
        "geometry_msgs.msg": {"Twist": Twist},
        "nav_msgs.msg": {"Odometry": type("Odometry", (Message,), {})},
        "sensor_msgs.msg": {name: type(name, (Message,), {}) for name in ("Image", "CompressedImage")},
        "std_msgs.msg": {name: type(name, (Message,), {}) for name in ("Bool", "String")},
        "std_srvs.srv": {"Trigger": type("Trigger", (), {})},
    }
    found: dict[str, ModuleType] = {}
    for name, contents in made.items():
        found.setdefault(name.partition(".")[0], ModuleType(name.partition(".")[0]))
        found.setdefault(name, ModuleType(name))
        vars(found[name]).update(contents)
    return found


def stand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    """Put the modules where imports look for them, and forget what other tests left."""
    for name, module in modules().items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(Node, "parameters", {})
    monkeypatch.setattr(Node, "made", [])
    LOGGER.lines.clear()
