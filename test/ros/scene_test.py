#!/usr/bin/env python3
"""The scene: its markers and frames, and a hand that is dragged by an interactive marker."""

import unittest
from collections import Counter

import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import PointStamped
from system import START, wait_for
from visualization_msgs.msg import InteractiveMarkerFeedback, InteractiveMarkerInit, MarkerArray

SHOWN = {"center": 3, "polygon": 1, "forces": 4, "cones": 4, "references": 2, "desired": 2, "names": 2}
"""Markers of a standing robot with two tasks, by their namespaces."""


class SceneTest(unittest.TestCase):
    """What the node publishes and receives."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.buffer = tf2_ros.Buffer()
        cls.listener = tf2_ros.TransformListener(cls.buffer)

    def place(self, frame, link):
        """Return where a link is [m], once it is known."""
        wait_for(lambda: self.buffer.can_transform(frame, link, rospy.Time(0)), START, f"{link} on /tf")
        place = self.buffer.lookup_transform(frame, link, rospy.Time(0)).transform.translation
        return place.x, place.y, place.z

    def test_markers_and_the_desired_robot_are_published(self):
        received = []
        subscriber = rospy.Subscriber("scene/markers", MarkerArray, received.append)

        def counted():
            return Counter(marker.ns for marker in received[-1].markers) if received else {}

        wait_for(lambda: counted() == SHOWN, START, lambda: f"{SHOWN}, not {counted()}")
        subscriber.unregister()
        self.assertEqual({marker.header.frame_id for marker in received[-1].markers}, {"world"})
        for measured, desired in zip(self.place("world", "arm1_7"), self.place("world", "desired/arm1_7"), strict=True):
            self.assertLess(abs(measured - desired), 0.03)  # springs give way

    def test_a_dragged_marker_moves_the_hand(self):
        """The hand rises by 4 cm with the marker; when that is released, another sender brings it back."""
        shown = {}
        rospy.Subscriber(
            "scene/references/update_full",
            InteractiveMarkerInit,
            lambda message: shown.update({each.name: each for each in message.markers}),
        )
        wait_for(lambda: "manipulation/left" in shown, START, "a marker of the hand")
        marker = shown["manipulation/left"]
        self.assertEqual(marker.header.frame_id, "pelvis")
        before = self.place("pelvis", "arm1_7")
        drags = rospy.Publisher("scene/references/feedback", InteractiveMarkerFeedback, queue_size=1)
        feedback = InteractiveMarkerFeedback(client_id="rviz", marker_name=marker.name, pose=marker.pose)
        feedback.header.frame_id = marker.header.frame_id
        begin = PointStamped(point=type(marker.pose.position)(*(getattr(marker.pose.position, axis) for axis in "xyz")))
        feedback.pose.position.z += 0.04

        def risen():
            feedback.event_type = feedback.POSE_UPDATE
            drags.publish(feedback)
            rospy.sleep(0.1)
            return abs(self.place("pelvis", "arm1_7")[2] - before[2] - 0.04) < 0.01

        wait_for(risen, START, lambda: f"a hand above {before}, not at {self.place('pelvis', 'arm1_7')}")
        feedback.event_type = feedback.MOUSE_UP
        drags.publish(feedback)
        sender = rospy.Publisher("manipulation/left/reference", PointStamped, queue_size=1)

        def returned():
            sender.publish(begin)
            rospy.sleep(0.1)
            return abs(self.place("pelvis", "arm1_7")[2] - before[2]) < 0.01

        wait_for(returned, START, "a hand where it was")


if __name__ == "__main__":
    rostest.rosrun("solfer", "scene_test", SceneTest)
