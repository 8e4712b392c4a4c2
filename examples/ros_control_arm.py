#!/usr/bin/env python3
"""Lets plugins command an arm under ros_control by its JointGroupPositionController or JointGroupVelocityController."""

import numpy as np
import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from solfer.msg import JointCommand, Refusals
from solfer.srv import ClaimJoints, GetJointNames, ReleaseJoints
from solfer.transport.lower_level import claimant

SILENCE = 0.1  # without commands or states for longer, the arm stops [s]
GAIN = 5.0  # of velocity drives: speed for each radian of a position error [1/s]


class ArmNode:
    """Sends desired positions [rad], or the velocities that lead there [rad/s], in the order of the controller."""

    def __init__(self):
        self.joints = rospy.get_param("arm_controller/joints")
        self.takes_velocities = "Velocity" in rospy.get_param("arm_controller/type")
        self.owner = ""  # the plugin that may command the arm
        self.commanded_at = self.measured_at = -np.inf  # times of the newest messages [s]
        self.measured = self.position = self.velocity = np.full(len(self.joints), np.nan)
        self.drives = rospy.Publisher("arm_controller/command", Float64MultiArray, queue_size=1, tcp_nodelay=True)
        self.refusals = rospy.Publisher("lower_level/refusals", Refusals, queue_size=10)
        rospy.Service("position_controller/get_joint_names", GetJointNames, lambda _: (True, "", self.joints))
        rospy.Service("lower_level/claim", ClaimJoints, self.claim)
        rospy.Service("lower_level/release", ReleaseJoints, lambda _: (True, ""))  # silence follows, and ends the claim
        rospy.Subscriber("joint_states", JointState, self.receive_state, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("position_controller/command", JointCommand, self.receive_command, queue_size=1)
        rospy.Timer(rospy.Duration(1 / 125), self.send)

    def receive_state(self, message):
        measured = dict(zip(message.name, message.position, strict=True))  # of the arm, perhaps of a gripper
        self.measured = np.array([measured[joint] for joint in self.joints])
        self.measured_at = rospy.get_time()

    def claim(self, request):
        """Grant the arm to one plugin at a time; it begins where the arm is."""
        if self.owner not in ("", request.owner):
            return False, f"{self.owner} commands the arm", False, False
        self.hold(request.owner)
        return True, "", False, False

    def hold(self, owner):
        self.position, self.velocity = self.measured.copy(), np.zeros(len(self.joints))
        self.owner, self.commanded_at = owner, rospy.get_time()

    def receive_command(self, message):
        sender = claimant(message._connection_header["callerid"], message.component)
        if sender != self.owner:  # it was silent: it has to claim the arm again, and then begins where the arm is
            self.refusals.publish(owners=[sender], claims=[True], reasons=["its claim has ended"])
            return
        indices = [self.joints.index(name) for name in message.name]
        self.position[indices] = message.position
        self.velocity[indices] = message.velocity
        self.commanded_at = rospy.get_time()

    def send(self, event):
        now = rospy.get_time()
        if self.owner and now > self.commanded_at + SILENCE:
            rospy.logwarn("%s is silent: the arm holds", self.owner)
            self.hold("")
        command = self.position
        if self.takes_velocities:
            is_measured = now < self.measured_at + SILENCE
            command = self.velocity + GAIN * (self.position - self.measured) if is_measured else 0 * self.velocity
        if np.isfinite(command).all():
            self.drives.publish(data=command)


if __name__ == "__main__":
    rospy.init_node("arm_node")
    node = ArmNode()
    rospy.spin()
