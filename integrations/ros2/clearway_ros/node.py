"""The node: topics, parameters and a timer around `Walk`."""

from __future__ import annotations

import signal
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger

import clearway
from clearway.scenes.actions import Action
from clearway_ros.motion import Command, Drive, Pose
from clearway_ros.pictures import PictureError, compressed_picture, raw_picture, yaw_of
from clearway_ros.walk import Patience, Walk

DRIVE, PATIENCE = ([(field.name, field.default) for field in fields(kind)] for kind in (Drive, Patience))
OWN: dict[str, Any] = {
    "agent": "",  # a file that clearway export wrote, a run folder, or generalist
    "scene": "",  # which of a run's scenes; empty: the first
    "selection": "sampled",  # or argmax
    "seed": -1,  # of the draws; below 0: another one every time
    "target": "",  # a picture file to walk to from the start; empty: wait for a picture on the topic
    "compressed": False,  # pictures come as sensor_msgs/CompressedImage
    "stop_on_arrival": True,  # stand still where the agent holds that it has arrived
    "rate_hz": 20.0,  # of commands
}


class ClearwayNode(Node):
    """Walks to where a picture was taken.

    Raises:
        ClearwayError, ValueError, PictureError: a parameter is of no use; one line says why.
    """

    def __init__(self) -> None:
        super().__init__("clearway")
        asked = {name: self.declare_parameter(name, value).value for name, value in (*OWN.items(), *DRIVE, *PATIENCE)}
        if not asked["agent"]:
            raise ValueError("the parameter agent is empty, expected a file, a run folder, or generalist")
        if not asked["rate_hz"] > 0:
            raise ValueError(f"rate_hz is {asked['rate_hz']!r}, expected a number above 0")
        drive = Drive(**{name: asked[name] for name, _ in DRIVE})
        patience = Patience(**{name: asked[name] for name, _ in PATIENCE})
        self._navigator = clearway.Navigator(
            asked["agent"],
            scene=asked["scene"] or None,
            selection=asked["selection"],
            seed=None if asked["seed"] < 0 else asked["seed"],
        )
        self._twists = self.create_publisher(Twist, "cmd_vel", 10)
        self._arrived = self.create_publisher(Bool, "~/arrived", 10)
        self._states = self.create_publisher(String, "~/state", 10)
        self._said: tuple[str, int] | None = None
        self._complaint = ""
        self.walk = Walk(self._decide, self._send, drive, patience, stops_at_target=asked["stop_on_arrival"])
        self._listen(asked["compressed"], 1 / asked["rate_hz"])
        if not self._navigator.card.tells_arrival:
            self.get_logger().warning("this file says nothing of arrivals. Export it again, or stop the robot yourself")
        if asked["target"]:
            with Path(asked["target"]).open("rb") as file:
                self._set_target(compressed_picture(CompressedImage(data=file.read())))

    def _listen(self, compressed: bool, period_s: float) -> None:
        """The emergency stop has threads of its own: it waits neither for a decision nor for a picture."""
        steps, pictures, safety = (
            MutuallyExclusiveCallbackGroup(),
            MutuallyExclusiveCallbackGroup(),
            ReentrantCallbackGroup(),
        )
        kind, read, suffix = (
            (CompressedImage, compressed_picture, "/compressed") if compressed else (Image, raw_picture, "")
        )

        def seen(message: Any) -> None:
            if (picture := self._read(read, message)) is not None:
                self.walk.see(picture, self._now_s())

        def wanted(message: Any) -> None:
            if (picture := self._read(read, message)) is not None:
                self._set_target(picture)

        def felt(message: Any) -> None:
            place = message.pose.pose
            self.walk.feel(Pose(place.position.x, place.position.y, yaw_of(place.orientation)), self._now_s())

        self.create_subscription(kind, f"image{suffix}", seen, qos_profile_sensor_data, callback_group=pictures)
        self.create_subscription(kind, f"~/target{suffix}", wanted, 1, callback_group=steps)
        self.create_subscription(Odometry, "odom", felt, qos_profile_sensor_data, callback_group=pictures)
        self.create_subscription(
            Bool, "~/stop", lambda message: self.walk.stop(bool(message.data)), 10, callback_group=safety
        )
        self.create_service(Trigger, "~/clear_stop", self._clear, callback_group=safety)
        self.create_timer(period_s, self._tick, callback_group=steps)

    def halt(self) -> None:
        """Stand still, for good: the node ends."""
        self.walk.stop()

    def _tick(self) -> None:
        before = self.walk.given_up
        self.walk.tick(self._now_s())
        if self.walk.given_up > before:
            self.get_logger().warning("a step was given up: something is in the way, or odometry has gone")
        said = self.walk.state, self.walk.decisions
        if said != self._said:
            self._said = said
            self._states.publish(String(data=self.walk.state))
            if self.walk.arrived is not None:
                self._arrived.publish(Bool(data=self.walk.arrived))

    def _decide(self, picture: np.ndarray) -> tuple[Action, bool | None] | None:
        try:
            action = self._navigator.act(picture).action
        except clearway.ClearwayError as fault:
            self._complain(str(fault))
            return None
        self._complaint = ""
        return action, self._navigator.arrived

    def _set_target(self, picture: np.ndarray) -> None:
        try:
            self._navigator.set_target(picture)
        except clearway.ClearwayError as fault:
            self._complain(str(fault))
            return
        self.walk.begin(self._now_s())

    def _send(self, command: Command) -> None:
        twist = Twist()
        twist.linear.x, twist.angular.z = command
        self._twists.publish(twist)

    def _clear(self, request: Any, response: Any) -> Any:
        response.success = self.walk.clear(self._now_s())
        response.message = "" if response.success else "the stop is still pressed: publish false on it first"
        return response

    def _read(self, read: Any, message: Any) -> np.ndarray | None:
        try:
            return read(message)
        except PictureError as fault:
            self._complain(str(fault))
            return None

    def _complain(self, line: str) -> None:
        """Say what is wrong, once until it is something else."""
        if line != self._complaint:
            self._complaint = line
            self.get_logger().error(line)

    def _now_s(self) -> float:
        return self.get_clock().now().nanoseconds / 1e9


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node until it is interrupted; 1 where a parameter is of no use."""
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)  # the last command is to be sent yet
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        node = ClearwayNode()
    except (clearway.ClearwayError, ParameterException, ValueError, OSError) as fault:
        rclpy.logging.get_logger("clearway").fatal(" ".join(str(fault).split()))
        rclpy.try_shutdown()
        return 1
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.halt()
        node.destroy_node()
        rclpy.try_shutdown()
    return 0
