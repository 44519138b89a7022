"""The ROS 2 node against a stand-in of `rclpy`."""

import io
import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image as Picture

import clearway
from helpers.ros_stand_in import LOGGER, Message, Node, ParameterFault, stand_in
from helpers.sums import Sums, plain


class Telling(Sums):
    """Moves ahead, and has arrived where the picture is as grey as the target."""

    card = clearway.deploy.card.Card(**{**vars(Sums.card), "settings": {"arrival": {}}})

    def act(self, observation, state):
        decisions, after = super().act(observation, state)
        action = np.zeros(len(decisions.action), np.int64)
        return replace(decisions, action=action, arrived=self._means(observation) == state["target"]), after


def raw(picture, encoding="rgb8"):
    height, width = picture.shape[:2]
    return Message(encoding=encoding, height=height, width=width, step=width * 3, data=picture.tobytes())


def compressed(picture):
    file = io.BytesIO()
    Picture.fromarray(picture).save(file, "PNG")
    return Message(data=file.getvalue())


def odometry(x=0.0, yaw=0.0):
    orientation = Message(x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2))
    return Message(pose=Message(pose=Message(position=Message(x=x, y=0.0), orientation=orientation)))


@pytest.fixture
def make(monkeypatch):
    """Makes a node with parameters."""
    stand_in(monkeypatch)
    monkeypatch.delitem(sys.modules, "clearway_ros.node", raising=False)
    monkeypatch.setattr("clearway.deploy.navigator.open_agent", lambda source, scene: Telling())

    def made(**parameters):
        from clearway_ros import node

        monkeypatch.setattr(Node, "parameters", {"agent": "some.onnx", "seed": 0, **parameters})
        return node.ClearwayNode()

    return made


def run(node, seconds, picture=None):
    """Let its timer tick; velocities sent meanwhile."""
    before = len(node.published)
    ((period_s, tick),) = node.timers_
    for _ in range(round(seconds / period_s)):
        if picture is not None:
            node.hear("image", raw(picture))
        tick()
        node.seconds += period_s
    return [(message.linear.x, message.angular.z) for topic, message in node.published[before:] if topic == "cmd_vel"]


def test_from_a_target_to_velocities_to_an_arrival(make) -> None:
    node = make()
    assert run(node, 1, plain(3)) == []
    node.hear("~/target", raw(plain(9)))
    sent = run(node, 1, plain(3))
    assert max(sent)[0] == pytest.approx(0.2) and all(turn == 0 for _, turn in sent)
    run(node, 3, plain(9))
    assert run(node, 1, plain(9)) == []
    assert [message.data for message in node.heard_on("~/state")][-1] == "arrived"
    assert [message.data for message in node.heard_on("~/arrived")][-2:] == [False, True]


def test_the_stop_topic_is_latched_and_the_service_clears_it(make) -> None:
    node = make()
    node.hear("~/target", raw(plain(9)))
    assert any(speed for speed, _ in run(node, 1, plain(3)))
    node.hear("~/stop", Message(data=True))
    assert node.heard_on("cmd_vel")[-1].linear.x == 0
    node.hear("~/stop", Message(data=False))
    assert not any(speed for speed, _ in run(node, 2, plain(3)))
    node.hear("~/stop", Message(data=True))
    answer = node.services_["~/clear_stop"](None, Message(success=None, message=None))
    assert not answer.success and "still pressed" in answer.message
    node.hear("~/stop", Message(data=False))
    assert node.services_["~/clear_stop"](None, Message(success=None, message=None)).success
    assert any(speed for speed, _ in run(node, 1, plain(3)))


def test_the_stop_shares_no_thread_with_what_takes_long(make) -> None:
    node = make()
    groups = node.groups
    assert groups["~/stop"] is groups["~/clear_stop"]
    assert groups["~/stop"] not in (groups["timer"], groups["image"])
    assert groups["timer"] is groups["~/target"]  # the navigator is asked by one at a time
    assert type(groups["~/stop"]).__name__ == "ReentrantCallbackGroup"


def test_no_picture_for_a_second_and_it_stands_still(make) -> None:
    node = make()
    node.hear("~/target", raw(plain(9)))
    run(node, 0.5, plain(3))
    assert any(speed for speed, _ in run(node, 0.9))
    run(node, 0.2)
    assert not any(speed for speed, _ in run(node, 2))


def test_odometry_measures_moves(make) -> None:
    node = make()
    node.hear("~/target", raw(plain(9)))
    gone = 0.0
    for _ in range(200):
        node.hear("odom", odometry(x=gone, yaw=0.0))
        for speed, _ in run(node, 0.05, plain(3)):
            gone += 0.5 * speed * 0.05  # a base that slips
        if node.walk.decisions == 2:
            break
    assert gone == pytest.approx(0.5, abs=0.03)


def test_compressed_pictures_have_topics_of_their_own(make) -> None:
    node = make(compressed=True)
    assert {"image/compressed", "~/target/compressed"} <= set(
        node.subscriptions_
    ) and "image" not in node.subscriptions_
    node.hear("~/target/compressed", compressed(plain(9)))
    node.hear("image/compressed", compressed(plain(3)))
    assert any(speed for speed, _ in run(node, 0.5))


def test_a_target_may_be_a_file(make, tmp_path) -> None:
    (tmp_path / "target.png").write_bytes(compressed(plain(9)).data)
    node = make(target=str(tmp_path / "target.png"))
    assert any(speed for speed, _ in run(node, 0.5, plain(3)))


@pytest.mark.parametrize(
    ("message", "said"),
    [
        (Message(encoding="16UC1", height=1, width=1, step=2, data=b"12"), "encoding '16UC1'"),
        (Message(encoding="rgb8", height=2, width=2, step=6, data=b"123"), "do not fit"),
        (Message(encoding="rgb8", height=0, width=2, step=6, data=b""), "do not fit"),
        (Message(encoding="rgb8", height=1, width=9000, step=27000, data=bytes(27000)), "above 4096"),
    ],
)
def test_pictures_of_no_use_are_told_once_and_move_nothing(make, message, said) -> None:
    node = make()
    node.hear("~/target", raw(plain(9)))
    for _ in range(3):
        node.hear("image", message)
    assert len(LOGGER.lines) == 1 and said in LOGGER.lines[0]
    assert not any(speed for speed, _ in run(node, 0.5))


@pytest.mark.parametrize("encoding", ["rgb8", "bgr8", "rgba8", "bgra8", "mono8"])
def test_pictures_of_all_encodings_come_out_as_rgb(encoding) -> None:
    from clearway_ros.pictures import raw_picture

    wanted = np.random.default_rng(0).integers(0, 256, (3, 5, 3), dtype=np.uint8)
    if encoding == "mono8":
        wanted[:] = wanted[..., :1]
    channels = {"rgb8": wanted, "bgr8": wanted[..., ::-1], "mono8": wanted[..., :1]}
    alpha = np.full((3, 5, 1), 7, np.uint8)
    channels |= {"rgba8": np.concatenate([wanted, alpha], 2), "bgra8": np.concatenate([wanted[..., ::-1], alpha], 2)}
    rows = channels[encoding].reshape(3, -1)
    padded = np.concatenate([rows, np.zeros((3, 2), np.uint8)], axis=1)
    message = Message(encoding=encoding, height=3, width=5, step=padded.shape[1], data=padded.tobytes())
    np.testing.assert_array_equal(raw_picture(message), wanted)


def test_a_picture_of_huge_sides_is_one_line() -> None:
    import struct
    import zlib

    from clearway_ros.pictures import PictureError, compressed_picture

    content = b"\x89PNG\r\n\x1a\n"
    for chunk in (b"IHDR" + struct.pack(">IIBBBBB", 60_000, 60_000, 8, 2, 0, 0, 0), b"IDAT" + zlib.compress(b"")):
        content += struct.pack(">I", len(chunk) - 4) + chunk + struct.pack(">I", zlib.crc32(chunk))
    with pytest.raises(PictureError):
        compressed_picture(Message(data=content))


def test_a_compressed_picture_that_is_none_is_one_line() -> None:
    from clearway_ros.pictures import PictureError, compressed_picture

    for content in (b"", b"GIF89a", compressed(plain(1)).data[:40]):
        with pytest.raises(PictureError, match="cannot be read"):
            compressed_picture(Message(data=content))


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"agent": ""}, "the parameter agent is empty"),
        ({"rate_hz": 0.0}, "rate_hz is 0.0"),
        ({"step_m": -1.0}, "step_m is -1.0"),
        ({"step_m": 1}, "step_m has another type"),
        ({"selection": "best"}, "selection is 'best'"),
        ({"target": "/nowhere.png"}, "/nowhere.png"),
    ],
)
def test_parameters_of_no_use_end_the_node_with_one_line(make, parameters, said) -> None:
    with pytest.raises((clearway.ClearwayError, ValueError, OSError, ParameterFault)):
        make(**parameters)
    from clearway_ros.node import main

    assert main([]) == 1
    assert said in LOGGER.lines[-1] and "\n" not in LOGGER.lines[-1]


def test_a_node_that_ends_stops_the_robot_first(make, monkeypatch) -> None:
    make()
    from clearway_ros import node

    monkeypatch.setattr(node.signal, "signal", lambda *given: None)
    assert node.main([]) == 0
    ended = Node.made[-1]
    assert ended.destroyed and ended.heard_on("cmd_vel")[-1].linear.x == 0
