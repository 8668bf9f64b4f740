from xml.etree import ElementTree as ET

import pytest

from ses_core.robot_profile import JACKAL, TURTLEBOT4
from ses_core.simulation.jackal_urdf import JACKAL_FRAME, WHEELS, robot_frame, robot_urdf


def test_the_jackal_weighs_what_it_weighs_and_stands_on_four_wheels() -> None:
    robot = ET.fromstring(robot_urdf(robot_frame(JACKAL), name="jackal"))
    masses = [float(mass.attrib["value"]) for mass in robot.iter("mass")]
    assert sum(masses) == pytest.approx(16.523 + 4 * 0.477)
    assert [joint.attrib["name"] for joint in robot.findall("joint")] == list(WHEELS)
    origins = {
        joint.attrib["name"]: joint.find("origin").attrib["xyz"].split()  # type: ignore[union-attr]
        for joint in robot.findall("joint")
    }
    front, rear = float(origins["front_left"][0]), float(origins["rear_left"][0])
    left, right = float(origins["front_left"][1]), float(origins["front_right"][1])
    assert front - rear == pytest.approx(JACKAL_FRAME.wheelbase)
    assert left - right == pytest.approx(JACKAL_FRAME.track, abs=1e-4)


def test_the_body_is_the_profiles_own_outline() -> None:
    frame = robot_frame(JACKAL)
    assert (frame.length, frame.width) == pytest.approx((0.42, 0.33))
    turtlebot = robot_frame(TURTLEBOT4)
    assert turtlebot.is_round
    assert turtlebot.length == pytest.approx(2 * TURTLEBOT4.radius_m)
    assert '<cylinder radius="0.18900"' in robot_urdf(turtlebot, name="turtlebot4")
