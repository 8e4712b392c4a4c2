"""The topics beside a node, where the master knows no type of what only others receive."""

from types import SimpleNamespace

import pytest

from solfer.middleware.ros import topics
from solfer.middleware.ros.endpoints import RosReader, RosWriter
from solfer.middleware.ros.node.master import Graph


def writer(topic, carries, receivers):
    """Make a writer that some nodes have connected to, without a master."""
    made = object.__new__(RosWriter)
    made.topic, made.carries = topic, carries
    made.topic_publisher = SimpleNamespace(receivers=lambda: receivers)
    return made


@pytest.mark.parametrize(
    ("receivers", "asked", "expected"),
    [
        ((), "std_msgs/Int8", {"/t": "std_msgs/Int8"}),  # it receives another type
        ((), "std_msgs/Bool", {"/t": "std_msgs/Bool"}),  # it has not connected yet
        ((), "", {}),  # it has ended without a word to the master
        (("/other",), "", {"/t": "std_msgs/Bool"}),  # it is connected, and need not be asked
    ],
)
def test_a_receiver_that_did_not_connect_is_asked_for_its_type(monkeypatch, receivers, asked, expected):
    graph = Graph({"/t": ["/me"], "/u": ["/me", "/other"]}, {"/t": ["/me", "/other"]}, {"/t": "std_msgs/Bool"})
    monkeypatch.setattr(topics, "graph", lambda: graph)
    monkeypatch.setattr(topics, "subscribed_type", lambda node, topic: asked)
    found = topics.topics_beside("/me", [writer("/t", "std_msgs/Bool", receivers), object.__new__(RosReader)])
    assert (found.published, found.received) == ({"/u": ""}, expected)
