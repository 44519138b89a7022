"""When the robot looks, moves and stands still; above all, when it stands still."""

import threading
from itertools import pairwise

import numpy as np
import pytest

from clearway.scenes.actions import Action

PICTURE = np.zeros((4, 4, 3), np.uint8)
TICK_S = 0.05


class Robot:
    """A walk whose agent does what it is told, with a clock and a camera."""

    def __init__(self, *, answers=((Action.MOVE_FORWARD, False),), camera=True, **kwargs) -> None:
        from clearway_ros.motion import Drive
        from clearway_ros.walk import Patience, Walk

        self.sent, self.asked, self.now, self.camera = [], [], 0.0, camera
        self._answers = list(answers)
        self.walk = Walk(self._decide, self.sent.append, Drive(), Patience(), **kwargs)

    def _decide(self, picture):
        self.asked.append(self.now)
        return self._answers[min(len(self.asked), len(self._answers)) - 1]

    def run(self, seconds):
        """Tick on; the commands sent meanwhile."""
        before, end = len(self.sent), self.now + seconds
        while self.now < end - 1e-9:
            if self.camera:
                self.walk.see(PICTURE, self.now)
            self.walk.tick(self.now)
            self.now += TICK_S
        return self.sent[before:]

    def begin(self):
        self.walk.begin(self.now)
        return self


def moving(commands):
    return [command for command in commands if any(command)]


def test_without_a_target_nothing_is_sent_so_that_others_may_drive() -> None:
    robot = Robot()
    assert robot.run(1) == [] and robot.walk.state == "standing" and robot.asked == []


def test_it_moves_settles_and_looks_again() -> None:
    robot = Robot(answers=[(Action.MOVE_FORWARD, False), (Action.TURN_LEFT, False)]).begin()
    first = robot.run(3.0)
    assert all(command.angular_rad_s == 0 for command in first)
    assert sum(command.linear_m_s for command in first) * TICK_S == pytest.approx(0.5, abs=0.02)
    robot.run(0.5)
    assert robot.asked == pytest.approx([0, 3.35], abs=2.1 * TICK_S)  # from the next tick 3 s of profile, 0.3 to settle
    assert moving(robot.run(1))[0].angular_rad_s > 0
    assert robot.walk.decisions == 2


def test_a_picture_from_before_the_end_of_an_action_decides_nothing() -> None:
    robot = Robot().begin()
    robot.run(2.9)
    robot.camera = False
    robot.run(0.5)
    robot.run(0.3)  # the picture is fresh, but was taken on the way
    assert len(robot.asked) == 1
    robot.camera = True
    robot.run(0.1)
    assert len(robot.asked) == 2


def test_where_it_has_arrived_it_stands_still_and_falls_silent() -> None:
    robot = Robot(answers=[(Action.MOVE_FORWARD, True)]).begin()
    assert moving(robot.run(2)) == []
    assert robot.walk.state == "arrived" and robot.walk.arrived is True and len(robot.asked) == 1
    assert robot.run(1) == []
    robot.begin()
    assert robot.walk.state == "looking" and robot.walk.arrived is None


def test_it_may_be_told_to_walk_on() -> None:
    robot = Robot(answers=[(Action.MOVE_FORWARD, True)], stops_at_target=False).begin()
    assert moving(robot.run(1)) and robot.walk.arrived is True


def test_an_agent_that_cannot_tell_walks_on() -> None:
    robot = Robot(answers=[(Action.MOVE_FORWARD, None)]).begin()
    assert moving(robot.run(1)) and robot.walk.arrived is None


def test_the_stop_is_at_once_and_stays_until_it_is_cleared() -> None:
    robot = Robot().begin()
    assert moving(robot.run(1))
    sent = len(robot.sent)
    robot.walk.stop()
    assert robot.sent[sent:] == [(0, 0)]  # before any tick
    assert robot.walk.state == "stopped"
    assert moving(robot.run(5)) == [] and len(robot.run(1)) == 20  # and it goes on saying so
    robot.walk.stop(False)  # letting go is no clearing
    robot.begin()  # nor is a new target
    assert moving(robot.run(2)) == [] and robot.walk.state == "stopped"
    assert robot.walk.clear(robot.now)
    assert moving(robot.run(1))


def test_a_stop_that_is_still_pressed_cannot_be_cleared() -> None:
    robot = Robot().begin()
    robot.walk.stop()
    assert not robot.walk.clear(robot.now)
    assert moving(robot.run(1)) == []
    robot.walk.stop(False)
    assert robot.walk.clear(robot.now)


def test_a_stop_without_a_target_is_kept() -> None:
    robot = Robot()
    robot.walk.stop()
    robot.begin()
    assert moving(robot.run(1)) == []


def test_after_a_stop_it_looks_anew_before_it_moves() -> None:
    robot = Robot().begin()
    robot.run(1)
    robot.walk.stop()
    robot.walk.stop(False)
    robot.camera = False
    robot.walk.clear(robot.now)
    assert moving(robot.run(0.5)) == []
    robot.camera = True
    assert moving(robot.run(0.5)) and len(robot.asked) == 2


def test_a_stop_does_not_wait_for_a_decision_which_is_then_not_carried_out() -> None:
    robot, asked, go_on = Robot(), threading.Event(), threading.Event()

    def slow(picture):
        asked.set()
        assert go_on.wait(10)
        return Action.MOVE_FORWARD, False

    robot.walk._decide = slow
    robot.begin().walk.see(PICTURE, 0.0)
    thread = threading.Thread(target=robot.walk.tick, args=(0.0,))
    thread.start()
    assert asked.wait(10)
    robot.walk.stop()  # returns although the agent thinks
    assert robot.sent[-1] == (0, 0)
    go_on.set()
    thread.join(10)
    assert moving(robot.sent) == []
    robot.walk.stop(False)
    assert robot.walk.clear(0.1)
    robot.walk.tick(0.2)  # no new picture: the old decision is void
    assert moving(robot.sent) == [] and robot.walk.state == "looking"


def test_a_stop_that_is_cleared_while_the_agent_thinks_makes_its_decision_void() -> None:
    robot = Robot()

    def stopped(picture):
        robot.walk.stop(True)
        robot.walk.stop(False)
        assert robot.walk.clear(0.0)
        return Action.MOVE_FORWARD, False

    robot.walk._decide = stopped
    robot.begin().walk.see(PICTURE, 0.0)
    robot.walk.tick(0.0)
    assert robot.walk.state == "looking"
    robot.walk._decide = robot._decide
    robot.walk.tick(0.05)
    assert moving(robot.sent) == [] and robot.asked == []  # there is no new picture yet
    assert moving(robot.run(0.2))


def test_the_time_that_a_decision_takes_is_none_of_the_move() -> None:
    robot = Robot().begin()
    robot.walk.see(PICTURE, 0.0)
    robot.walk.tick(0.0)
    robot.now = 0.9  # it thought so long
    commands = robot.run(3.2)
    speeds = [command.linear_m_s for command in commands]
    assert sum(speeds) * TICK_S == pytest.approx(0.5, abs=0.02)
    assert max(after - before for before, after in pairwise(speeds)) < 0.03  # a ramp


def test_odometry_that_is_no_number_tells_nothing() -> None:
    from clearway_ros.motion import Pose

    robot = Robot().begin()
    robot.walk.feel(Pose(float("nan"), 0.0, 0.0), 0.0)
    robot.run(0.2)
    assert not robot.walk._motion.measured


def test_a_target_that_changes_during_a_decision_makes_it_void() -> None:
    robot = Robot()

    def changing(picture):
        robot.walk.begin(0.0)
        return Action.MOVE_FORWARD, True

    robot.walk._decide = changing
    robot.begin().walk.see(PICTURE, 0.0)
    robot.walk.tick(0.0)
    assert robot.walk.state == "looking" and robot.walk.decisions == 0


def test_without_pictures_it_stands_still_and_goes_on_once_it_sees() -> None:
    robot = Robot().begin()
    robot.run(0.5)
    robot.camera = False
    robot.run(1.0)
    assert moving(robot.run(3)) == [] and robot.walk.state == "looking"
    robot.camera = True
    assert moving(robot.run(1))


def test_a_picture_of_no_use_moves_nothing() -> None:
    robot = Robot(answers=[None]).begin()
    assert moving(robot.run(1)) == [] and robot.walk.state == "looking"


def test_odometry_measures_where_there_is_some_and_its_loss_ends_a_move() -> None:
    from clearway_ros.motion import Pose

    robot = Robot().begin()
    robot.walk.feel(Pose(1.0, 2.0, 0.0), 0.0)
    assert moving(robot.run(0.4))
    assert robot.walk._motion.measured
    robot.run(0.3)
    assert robot.walk._motion is None and robot.walk.state == "looking" and robot.walk.given_up == 1
    robot.run(0.5)
    assert not robot.walk._motion.measured  # what is old tells nothing


@pytest.mark.parametrize("seconds", [-1.0, float("inf"), "1"])
def test_times_that_cannot_be_are_one_line(seconds) -> None:
    from clearway_ros.walk import Patience

    with pytest.raises(ValueError, match="picture_timeout_s is"):
        Patience(picture_timeout_s=seconds)
