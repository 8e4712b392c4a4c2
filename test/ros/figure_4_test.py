#!/usr/bin/env python3
"""Fig. 4 by its launch file and the commands of its page: both parts move as on the memory middleware."""

import os
import re
import shlex
import unittest
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import rospy
import rostest
import yaml
from recording import STEP, Recording
from replayed import replay
from ros_tools import shown
from system import NODES, START, Robot, wait_for

from solfer.recording.reader import read
from solfer.srv import MoveJoints

PAGE = NODES.parent / "docs/how-to/shared_control.md"
PLUGINS = ("upper_body", "lower_body", "shared_compensation")
WHEELS = {
    "joints": ("j_wheel_1", "j_wheel_2", "j_wheel_3", "j_wheel_4"),
    "velocities": (1.0, -1.0, 1.0, -1.0),
}
ROLL = 1.0
"""Simulated time that the wheels turn [s]."""

COMMAND = "position_controller/command"
TOPICS = {"joint_states": "sensor_msgs/JointState", "floating_base": "nav_msgs/Odometry"}


class Figure4Test(unittest.TestCase):
    """What the page promises."""

    def test_the_commands_of_the_page_move_both_parts_as_in_memory(self):
        """Joints, base and commands are those of memory to the last digits, for requests at the same steps."""
        rospy.init_node("figure_4_test")
        robot, recording = Robot(), Recording(("/upper_body", "/lower_body", f"/{COMMAND}"))
        lines = re.findall(r"^rosservice call .*$", PAGE.read_text(), re.MULTILINE)
        before = robot.positions()
        requests = [self.obey(line, recording) for line in lines]
        self.assertEqual([service for _, service, _ in requests], ["upper_body/trajectory", "lower_body/trajectory"])
        turn = rospy.ServiceProxy("/lower_body/trajectory", MoveJoints)
        step = self.carry_out("lower_body", lambda: turn(**WHEELS).success, recording)
        requests.append((step, "lower_body/trajectory", WHEELS))
        last = step + round(ROLL / STEP)
        wait_for(lambda: max(recording.joints) > last, START, "wheels that roll")
        robot.arrive({"torso_yaw": 0.3, **self.legs(before)}, START)
        self.check_recording(Path(os.environ["ROS_HOME"], "figure_4.mcap"))
        self.check_motion(recording, requests, last)

    def obey(self, line: str, recording: Recording) -> tuple[int, str, dict[str, object]]:
        """Call a service by the command of the page; the step of the motion, the service, and the request."""
        _, _, service, request = shlex.split(line)
        rospy.wait_for_service(service, START)
        step = self.carry_out(service.split("/")[1], lambda: shown(*shlex.split(line))["success"], recording)
        return step, service.lstrip("/"), yaml.safe_load(request)

    @staticmethod
    def carry_out(plugin: str, asks: Callable[[], bool], recording: Recording) -> int:
        """Ask a plugin at rest for a motion; the step at which it was carried out."""
        ends = (f"/{plugin}",) * 2  # the topic has the name of the node
        wait_for(lambda: recording.rests(*ends), START, f"{plugin} at rest")
        count = len(recording.begins(*ends))
        wait_for(asks, START, f"{plugin} that moves")
        wait_for(lambda: len(recording.begins(*ends)) > count, START, f"motion of {plugin}")
        return recording.begins(*ends)[count]

    def legs(self, before: dict[str, float]) -> dict[str, float]:
        """Goals of the legs that the page's named state has far from where they were."""
        joints = ElementTree.fromstring(rospy.get_param("/robot_semantic_description")).findall(
            "group_state[@name='mammal_wide_high']/joint"
        )
        goals = {each.get("name"): float(each.get("value")) for each in joints if "pitch" in each.get("name")}
        moved = {name: goal for name, goal in goals.items() if name in before and abs(goal - before[name]) > 0.1}
        self.assertGreater(len(moved), 3)
        return moved

    def check_recording(self, file: Path) -> None:
        """Look into what `record:=FILE` has made of the three plugins so far; rows are written a moment later."""
        commanded = "shared_compensation/command/position_controller/position"

        def is_complete() -> bool:
            recording = read(file)
            if not set(PLUGINS) <= set(recording.plugins):
                return False
            requests = [event for event in recording.events if (event.plugin, event.kind) == ("upper_body", "request")]
            yaw = recording[commanded].column("torso_yaw")
            return bool(requests) and len(yaw) > 0 and abs(yaw[-1] - 0.3) < 0.005

        wait_for(is_complete, START, f"{commanded} of torso_yaw at 0.3, and the request, in {file}")

    def check_motion(self, recording: Recording, requests: list[tuple[int, str, dict[str, object]]], last: int) -> None:
        """Check that what was measured and commanded is what the same requests lead to in memory."""
        joints, base, commands = replay(PLUGINS, requests, last, TOPICS, {COMMAND: "solfer/JointCommand"}).values()
        self.compare(
            {step: np.array([each.position, each.velocity]) for step, each in joints.items()}, recording.joints
        )
        self.compare(
            {step: np.concatenate([each.position, each.orientation]) for step, each in base.items()}, recording.base
        )
        sent = {one.step: one for one in recording.commanded(f"/{COMMAND}", f"/{PLUGINS[2]}") if one.step in commands}
        for step, one in sent.items():
            self.assertEqual(list(one.position), list(commands[step].names))
        self.compare(
            {
                step: np.concatenate([each.position, [] if each.velocity is None else each.velocity])
                for step, each in commands.items()
            },
            {step: np.array([*one.position.values(), *one.velocity.values()]) for step, one in sent.items()},
        )

    def compare(self, expected: dict[int, np.ndarray], measured: dict[int, np.ndarray]) -> None:
        """Check that both hold the same numbers at the same steps."""
        common = sorted((expected.keys() & measured.keys()) - {0})
        self.assertGreater(len(common), 300)
        self.assertEqual(common, sorted(step for step in measured if 0 < step <= max(expected)))
        for step in common:
            off = np.abs(expected[step] - measured[step])
            self.assertLess(off.max(), 1e-9, f"step {step}: {np.argwhere(off >= 1e-9).tolist()}")
        self.assertGreater(max(np.abs(measured[step] - measured[common[0]]).max() for step in common), 0.05)


if __name__ == "__main__":
    rostest.rosrun("solfer", "figure_4", Figure4Test)
