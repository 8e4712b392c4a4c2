#!/usr/bin/env python3
"""An arm under ros_control as far as its topics show: joint states at 125 Hz, of drives that follow with a lag."""

import numpy as np
import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

PERIOD = 1 / 125  # [s]
LAG = 0.03  # time constant of the drives [s]


class FakeArm:
    """Joints that follow the newest command of a JointGroupPositionController or JointGroupVelocityController."""

    def __init__(self):
        self.joints = rospy.get_param("arm_controller/joints")
        self.takes_velocities = "Velocity" in rospy.get_param("arm_controller/type")
        self.position = np.linspace(-1.2, 0.8, len(self.joints))
        self.velocity = np.zeros(len(self.joints))
        self.command = np.zeros(len(self.joints)) if self.takes_velocities else self.position.copy()
        self.states = rospy.Publisher("joint_states", JointState, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("arm_controller/command", Float64MultiArray, self.receive, queue_size=1, tcp_nodelay=True)
        rospy.Timer(rospy.Duration(PERIOD), self.step)

    def receive(self, message):
        """Take a command that fits, as the controllers do; they have no timeout."""
        if len(message.data) == len(self.joints):
            self.command = np.array(message.data)

    def step(self, event):
        """Go on by a period, and publish."""
        share = 1 - np.exp(-PERIOD / LAG)
        if self.takes_velocities:
            self.velocity = self.velocity + share * (self.command - self.velocity)
        else:
            self.velocity = share * (self.command - self.position) / PERIOD
        self.position = self.position + PERIOD * self.velocity
        message = JointState(name=self.joints, position=self.position, velocity=self.velocity, effort=0 * self.velocity)
        message.header.stamp = rospy.Time.now()
        self.states.publish(message)


if __name__ == "__main__":
    rospy.init_node("fake_arm")
    arm = FakeArm()
    rospy.spin()
