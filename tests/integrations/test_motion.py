"""One action as velocities over time, against a base of exact arithmetic."""

import math
from itertools import pairwise

import pytest

from clearway.scenes.actions import Action

TICK_S = 0.05
ENDS = {
    Action.MOVE_FORWARD: (0.5, 0.0, 0.0),
    Action.MOVE_BACKWARD: (-0.5, 0.0, 0.0),
    Action.TURN_LEFT: (0.0, 0.0, 90.0),
    Action.TURN_RIGHT: (0.0, 0.0, -90.0),
}


def executed(action, *, measured, slip=1.0, heading_deg=0.0, tick_s=TICK_S, drive=None):
    """Where a base ends that does `slip` of what it is told, relative to its start; seconds; the motion."""
    from clearway_ros.motion import Drive, Motion, Pose

    yaw = math.radians(heading_deg)
    x = y = now = 0.0
    motion = Motion(action, drive or Drive(), now, Pose(x, y, yaw) if measured else None)
    while (command := motion.command(now, Pose(x, y, yaw) if measured else None)) is not None:
        yaw += slip * command.angular_rad_s * tick_s
        x += slip * command.linear_m_s * tick_s * math.cos(yaw)
        y += slip * command.linear_m_s * tick_s * math.sin(yaw)
        now += tick_s
        assert now < 60
    start = math.radians(heading_deg)
    ahead, aside = x * math.cos(start) + y * math.sin(start), y * math.cos(start) - x * math.sin(start)
    return (ahead, aside, math.degrees(yaw) - heading_deg), now, motion


def test_a_profile_covers_its_distance_and_keeps_its_limits() -> None:
    from clearway_ros.motion import profile_seconds, profile_speed

    assert profile_seconds(0.5, 0.2, 0.4) == pytest.approx(3.0)  # two ramps of half a second, 0.4 m at 0.2 m/s
    assert profile_seconds(0.1, 1.0, 0.4) == pytest.approx(1.0)  # never comes to speed
    for distance, speed, acceleration in ((0.5, 0.2, 0.4), (0.1, 1.0, 0.4), (math.pi / 2, 0.5, 1.0)):
        step_s = 0.001
        speeds = [profile_speed(distance, speed, acceleration, i * step_s) for i in range(8_000)]
        assert sum(speeds) * step_s == pytest.approx(distance, rel=1e-3)
        assert max(speeds) <= speed + 1e-9
        steepest = max(abs(b - a) for a, b in pairwise(speeds)) / step_s
        assert steepest <= acceleration * 1.001
    assert profile_speed(0.5, 0.2, 0.4, -1) == profile_speed(0.5, 0.2, 0.4, 99) == 0


@pytest.mark.parametrize("action", list(Action))
@pytest.mark.parametrize("heading_deg", [0, 100, 179])
def test_a_timed_action_ends_where_it_should_on_a_base_that_obeys(action, heading_deg) -> None:
    end, seconds, motion = executed(action, measured=False, heading_deg=heading_deg)
    assert end == pytest.approx(ENDS[action], abs=0.02 if action in (0, 3) else 2)
    assert seconds == pytest.approx(motion.seconds, abs=TICK_S)


@pytest.mark.parametrize("action", list(Action))
@pytest.mark.parametrize("slip", [0.7, 1.0, 1.2])
def test_a_measured_action_ends_where_it_should_on_a_base_that_slips(action, slip) -> None:
    end, _, motion = executed(action, measured=True, slip=slip, heading_deg=170)
    metres = end[0] - ENDS[action][0], end[1]
    assert metres == pytest.approx((0, 0), abs=0.02)
    assert end[2] == pytest.approx(ENDS[action][2], abs=2.5)
    assert not motion.given_up
    timed, _, _ = executed(action, measured=False, slip=0.7)
    assert timed != pytest.approx(ENDS[action], abs=0.1)


def test_a_measured_action_against_a_wall_is_given_up() -> None:
    end, seconds, motion = executed(Action.MOVE_FORWARD, measured=True, slip=0.0)
    assert motion.given_up and end == (0, 0, 0)
    assert seconds == pytest.approx(3 * motion.seconds, abs=2 * TICK_S)


def test_a_measured_action_without_odometry_ends() -> None:
    from clearway_ros.motion import Drive, Motion, Pose

    motion = Motion(Action.MOVE_FORWARD, Drive(), 0.0, Pose(0, 0, 0))
    assert motion.command(0.1, Pose(0, 0, 0)).linear_m_s > 0
    assert motion.command(0.2, None) is None and motion.given_up


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"step_m": 0.0}, "step_m is 0.0"),
        ({"linear_m_s": math.nan}, "linear_m_s is nan"),
        ({"turn_deg": 180.0}, "turn_deg is 180"),
        ({"patience": 0.5}, "patience is 0.5"),
    ],
)
def test_a_drive_that_cannot_be_is_one_line(given, said) -> None:
    from clearway_ros.motion import Drive

    with pytest.raises(ValueError, match=said):
        Drive(**given)
