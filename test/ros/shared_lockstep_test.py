#!/usr/bin/env python3
"""The shared plugin of Fig. 5 under ROS sends what it sends in memory, records it, and one member fails alone."""

import os
import signal
import sys
import tempfile
import unittest
from contextlib import closing
from pathlib import Path

import numpy as np
import rospy
import rostest
from recording import STEP, Recording, step_of
from sent import Sent
from std_srvs.srv import Trigger
from system import START, end, program, started, wait_for

from solfer.recording.reader import read
from solfer.srv import MoveJoints
from solfer_tools.cli.main import main

REPOSITORY = Path(os.path.realpath(__file__)).parents[2]
sys.path.append(str(REPOSITORY / "test"))
from support.shared.middlewares import BLEND, LISTED, InMemory, requests, write_listed  # noqa: E402

TOPICS = {
    "/position_controller/command": ("compensation", "position_controller"),
    "/velocity_controller/command": ("compensation", "velocity_controller"),
    "/upper_body": ("upper_body", "upper_body"),
    "/lower_body": ("locomotion", "lower_body"),
    "/base_odometry": ("estimation", "estimated"),
    "/reaction_forces": ("forces", "ground"),
    "/wave": ("wave", "wave"),
}
"""What the shared plugin publishes: the plugin and its pipe."""

SENDER = "/shared"
BLENDED = round(BLEND / STEP)
"""Step of the simulation at which commands are blended in."""

MOTION = 1000
"""Steps of the simulation that are compared after the motion has begun."""


def replay(file, motions, steps):
    """Numbers of all pipes by step, when the motions are carried out at the given steps and the last one is the end."""
    with closing(InMemory(file)) as memory:
        memory.move(motions, steps)
        period = round(1.0 / (memory.set.rate * STEP))
        return {
            1 + period * cycle: dict(zip(memory.names, numbers, strict=True))
            for cycle, numbers in enumerate(memory.sent)
        }


class SharedLockstepTest(unittest.TestCase):
    """A robot with time that stands still before the shared plugin is there."""

    def test_commands_are_those_of_memory(self):
        """The plugins in memory are the oracle for each command under ROS, up to the last digits.

        One member fails meanwhile, the others miss no cycle, and the recording agrees with what was sent.
        """
        rospy.init_node("shared_lockstep_test")
        rospy.set_param("/lockstep", "shared")
        self.enterContext(started(*program("simulator", "--factor", "0")))
        recording, sent = Recording(("/upper_body",)), Sent(TOPICS)
        wait_for(lambda: 0 in recording.joints, START, "joint states")
        with tempfile.TemporaryDirectory() as folder:
            file = write_listed(Path(folder))
            path = os.pathsep.join([str(REPOSITORY / "test"), os.environ.get("PYTHONPATH", "")])
            run = Path(folder, "run.mcap")
            command = ("rosrun", "plugins", "shared", "-n", "shared", "-c", str(file), "--trace", "1")
            command += ("--record", str(run))
            with started(*command, PYTHONPATH=path) as node:
                for service in ("shared/switch", *(f"{name}/switch" for name in LISTED)):
                    rospy.wait_for_service(f"/{service}", START)
                motion = requests(dict(zip(recording.names, recording.joints[0][0], strict=True)))[0]
                wait_for(lambda: max(recording.joints) > BLENDED, START, "commands that are blended in")
                begin = self.carry_out(motion, recording)
                last = begin + MOTION
                wait_for(lambda: max(sent.on("/velocity_controller/command")) > last, START, "a motion")
                self.fail_alone(sent)
                wait_for(run.exists, START, "the process that writes the recording")
                code, output = end(node, signal.SIGTERM)
                self.assertEqual(code, 0, output)
                self.assertRegex(output, "cycle 1 estimation reads .*")
                self.assertRegex(output, "cycle 1 locomotion computes kinematics because of estimation")
            self.compare(replay(file, [motion], (begin, last)), sent, last)
            self.check_recording(run, sent, last)

    def carry_out(self, motion, recording):
        """Ask for a motion of the upper body; the step at which it was carried out."""
        ends = ("/upper_body", SENDER)
        wait_for(lambda: recording.rests(*ends), START, "an upper body at rest")
        ask = rospy.ServiceProxy("/upper_body/trajectory", MoveJoints)
        wait_for(lambda: ask(**motion).success, START, "an upper body that moves")
        wait_for(lambda: len(recording.begins(*ends)) == 1, START, "the motion of the upper body")
        return recording.begins(*ends)[0]

    def fail_alone(self, sent):
        """Let the upper body raise, the first of the list: the others run, and miss no cycle."""
        failing, others = "/upper_body", [topic for topic in TOPICS if topic != "/upper_body"]
        self.assertTrue(rospy.ServiceProxy(f"{failing}/fail", Trigger)().success)
        wait_for(lambda: "broken on request" in self.state("upper_body"), START, "a failure")
        failed = max(sent.on(failing))
        wait_for(lambda: max(sent.on(others[0])) > failed + 300, START, "commands after the failure")
        for topic in others:
            steps = sorted(step for step in sent.on(topic) if failed - 200 <= step <= failed + 250)
            self.assertEqual(set(np.diff(steps)), {5}, topic)
        states = {name: self.state(name) for name in LISTED}
        self.assertEqual([name for name in LISTED if not states[name].startswith("RUNNING")], ["upper_body"], states)

    def state(self, name):
        """State of a plugin, as it publishes it."""
        return rospy.ServiceProxy(f"/{name}/state", Trigger)().message

    def compare(self, expected, sent, last):
        """All that was sent is what was expected, and the legs and an arm moved."""
        names = set(expected[1])
        compared = 0
        for topic, pipe in TOPICS.items():
            carried = {name for name in names if name[:2] == pipe}
            for step, numbers in sent.on(topic).items():
                if step <= last:
                    self.assertEqual(numbers.keys(), carried)
                    self.assertLess(max(abs(expected[step][name] - numbers[name]) for name in carried), 1e-9, topic)
                    compared += 1
        self.assertGreater(compared, len(TOPICS) * MOTION / 5)
        for joint in ("hip_pitch_1", "knee_pitch_3", "j_arm1_1", "torso_yaw"):
            name = (*TOPICS["/position_controller/command"], "position", joint)
            self.assertGreater(np.ptp([numbers[name] for step, numbers in expected.items() if step > BLENDED]), 0.1)

    def check_recording(self, file, sent, last):
        """Compare what was recorded of a component with what it sent; a replay sends the same."""
        recording = read(file)
        self.assertEqual((recording.lost, recording.missing), (0, ()))
        wave = recording["wave/command/wave/position"]
        rows = {step_of(rospy.Time.from_sec(time)): row for time, row in zip(wave.times, wave.values, strict=True)}
        compared = 0
        for step, numbers in sent.on("/wave").items():
            if step <= last:
                there = [numbers["wave", "wave", "position", joint] for joint in wave.columns]
                np.testing.assert_allclose(rows[step], there, rtol=0.0, atol=1e-9)
                compared += 1
        self.assertGreater(compared, MOTION / 5)
        self.assertGreater(np.ptp(wave.values, axis=0).min(), 0.2)
        self.assertEqual(main(["replay", str(file), "-n", "wave"]), 0)


if __name__ == "__main__":
    rostest.rosrun("solfer", "shared_lockstep", SharedLockstepTest)
