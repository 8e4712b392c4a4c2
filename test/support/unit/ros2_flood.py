"""Floods a topic or a service: `ros2_flood.py topic|service SECONDS`; prints how many were sent each second."""

import os
import sys
import time

import rclpy
from sensor_msgs.msg import JointState

from solfer.srv import MoveJoints

RATE = 10_000
"""Messages or requests each second [Hz]."""

kind, seconds = sys.argv[1], float(sys.argv[2])
rclpy.init()
node = rclpy.create_node(f"flood_{os.getpid()}")
if kind == "topic":
    publisher, message = node.create_publisher(JointState, "/joint_states", 10), JointState(name=["stranger"])

    def send() -> None:
        """Publish a message."""
        publisher.publish(message)

else:
    client, request = node.create_client(MoveJoints, "/joint_states/trajectory"), MoveJoints.Request()
    assert client.wait_for_service(10.0)

    def send() -> None:
        """Send a request, and leave its reply."""
        client.handle.send_request(request)


begin = time.monotonic()
count = 0
while (passed := time.monotonic() - begin) < seconds:
    if count < RATE * passed:
        send()
        count += 1
print(round(count / seconds))
