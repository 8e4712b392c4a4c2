#!/usr/bin/env python3
"""Two clients of the action of trajectories, actionlib's and ours: goals in flight at a switch, a cancel and a kill."""

import contextlib
import os
import signal
import sys
import unittest
from pathlib import Path

import actionlib
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal, JointTolerance
from std_srvs.srv import SetBool
from system import START, Robot, end, soak, started, wait_for
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

HERE = Path(os.path.realpath(__file__)).parent
NODE = (sys.executable, str(HERE / "several.py"), str(HERE.parents[1] / "config/centauro.yaml"), "joint_states")
OURS = (sys.executable, str(HERE / "trajectory_client.py"))
NECK = ("neck_yaw", "neck_pitch")
INVALID_JOINTS = -2


def to(yaw, pitch, time):
    """Make a trajectory of the neck to a posture, through half of the way, in so much time [s]."""
    points = [
        JointTrajectoryPoint(
            positions=[share * yaw, share * pitch], velocities=[0.0, 0.0], time_from_start=rospy.Duration(share * time)
        )
        for share in (0.5, 1.0)
    ]
    return JointTrajectory(joint_names=list(NECK), points=points)


class TrajectoriesTest(unittest.TestCase):
    """One robot, one plugin at a time, and a client in a process of its own beside actionlib's."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot, cls.feedback = Robot(), []
        cls.theirs = actionlib.SimpleActionClient("/joint_states/follow_joint_trajectory", FollowJointTrajectoryAction)

    @contextlib.contextmanager
    def plugin(self):
        """Run the plugin meanwhile, connected and ready."""
        with started(*NODE) as process:
            self.assertTrue(self.theirs.wait_for_server(rospy.Duration(START)))
            wait_for(self.ready, START, "a plugin that takes goals")
            yield process

    def ready(self) -> bool:
        """Whether a goal to where the neck is succeeds."""
        at = self.robot.positions()
        self.send(to(*(at[name] for name in NECK), 0.1))
        return self.theirs.wait_for_result(rospy.Duration(5.0)) and self.theirs.get_state() == GoalStatus.SUCCEEDED

    def send(self, trajectory, **tolerances):
        """Send a goal by actionlib's client."""
        goal = FollowJointTrajectoryGoal(trajectory=trajectory, **tolerances)
        self.theirs.send_goal(goal, feedback_cb=self.feedback.append)

    def moves(self):
        """Wait until that goal is under way."""
        self.feedback.clear()
        wait_for(lambda: len(self.feedback) > 3, START, "feedback of actionlib's client")

    def becomes(self, state):
        """Wait until that goal has ended, in a state."""
        self.assertTrue(self.theirs.wait_for_result(rospy.Duration(START)))
        self.assertEqual(self.theirs.get_state(), state, self.theirs.get_goal_status_text())

    def await_state(self, ours, state):
        """Check what our client prints next."""
        self.assertEqual(ours.stdout.readline().strip(), state)

    def test_goals_in_flight(self):
        with self.plugin():
            self.succeeds()
            self.is_refused()
            self.is_cancelled()
            self.is_preempted_and_switched_off()
            self.follows_a_topic()

    @soak
    def test_a_goal_of_a_killed_plugin_is_lost(self):
        with self.plugin() as process, started(*OURS) as ours:
            self.await_state(ours, "ACTIVE")
            process.kill()
            process.wait()
            with self.plugin() as again:
                self.await_state(ours, "LOST")
                self.assertEqual(end(again, signal.SIGINT)[0], 0)

    def succeeds(self):
        """Check a goal with tolerances and feedback."""
        tolerances = [JointTolerance(name=name, position=0.05) for name in NECK]
        late = rospy.Duration(5.0)
        self.send(to(0.3, 0.2, 1.0), path_tolerance=tolerances, goal_tolerance=tolerances, goal_time_tolerance=late)
        self.becomes(GoalStatus.SUCCEEDED)
        self.assertEqual(self.theirs.get_result().error_code, 0)
        self.robot.arrive(dict(zip(NECK, (0.3, 0.2), strict=True)), START)
        self.assertGreater(len(self.feedback), 10)
        self.assertEqual(tuple(self.feedback[-1].joint_names), NECK)

    def is_refused(self):
        """Check a goal of an unknown joint."""
        wrong = to(0.0, 0.0, 1.0)
        wrong.joint_names[0] = "neck_jaw"
        self.send(wrong)
        self.becomes(GoalStatus.REJECTED)
        self.assertEqual(self.theirs.get_result().error_code, INVALID_JOINTS)
        self.assertIn("neck_yaw", self.theirs.get_goal_status_text())

    def is_cancelled(self):
        """Cancel a goal in motion: the joints stop on their way."""
        self.send(to(-0.3, 0.0, 10.0))
        self.moves()
        self.theirs.cancel_goal()
        self.becomes(GoalStatus.PREEMPTED)
        self.robot.passes(0.5)
        self.assertGreater(self.robot.positions()["neck_yaw"], -0.25)

    def is_preempted_and_switched_off(self):
        """Take over from our client; the switch aborts the goal, and others are refused until it is on again."""
        switch = rospy.ServiceProxy("/joint_states/switch", SetBool)
        with started(*OURS) as ours:
            self.await_state(ours, "ACTIVE")
            self.send(to(0.3, 0.2, 30.0))
            self.await_state(ours, "PREEMPTED")
        self.moves()
        self.assertTrue(switch(False).success)
        self.becomes(GoalStatus.ABORTED)
        self.assertIn("stopped", self.theirs.get_goal_status_text())
        self.send(to(0.3, 0.2, 1.0))
        self.becomes(GoalStatus.REJECTED)
        self.assertTrue(switch(True).success)
        wait_for(self.ready, START, "a plugin that takes goals again")

    def follows_a_topic(self):
        """Publish a trajectory without a goal."""
        publisher = rospy.Publisher("/joint_states/joint_trajectory", JointTrajectory, queue_size=1)
        wait_for(lambda: publisher.get_num_connections() > 0, START, "a subscriber of trajectories")
        publisher.publish(to(0.1, 0.1, 1.0))
        self.robot.arrive(dict(zip(NECK, (0.1, 0.1), strict=True)), START)


if __name__ == "__main__":
    rostest.rosrun("solfer", "trajectories", TrajectoriesTest)
